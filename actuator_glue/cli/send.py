"""Send a record as a laboratory's controller would: UDP datagrams, TCP lines or LSL."""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict

from actuator_glue.api.bar import progress
from actuator_glue.arguments import Input, number
from actuator_glue.cli._output import add_json, note, say
from actuator_glue.cli._records import add_reading, load
from actuator_glue.io.json_file import write_json

EXAMPLES = (
    'send test.csv --to udp://127.0.0.1:5005',
    'send test.csv --to tcp://127.0.0.1:5006 --speed 10',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        'record', type=Input, metavar='RECORD', help='bag folder, .mcap, or laboratory file'
    )
    parser.add_argument(
        '--to',
        required=True,
        metavar='ADDRESS',
        help='udp://HOST:PORT, tcp://HOST:PORT or lsl:NAME; what lab_bridge has as `source`',
    )
    parser.add_argument(
        '--layout',
        type=Input,
        metavar='FILE.yaml',
        help='what a packet holds; without it little-endian counter (uint32), time, command, '
        'measured, force (float64, SI units)',
    )
    parser.add_argument(
        '--speed',
        type=number,
        default=1.0,
        metavar='X',
        help='record seconds per second; 0 sends as fast as possible, which UDP may not survive',
    )
    parser.add_argument(
        '--key-file',
        type=Input,
        metavar='FILE',
        help='sign every message with this key (HMAC-SHA256)',
    )
    add_reading(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Send; 1 where the sender could not keep up with the record's rate.

    Raises:
        InputError: the record, the layout or the address cannot be used.
    """
    from actuator_glue.errors import InputError
    from actuator_glue.streams import play
    from actuator_glue.streams.address import Allowed
    from actuator_glue.streams.layout import PLAIN
    from actuator_glue.streams.layout_file import read_layout
    from actuator_glue.streams.seal import read_key
    from actuator_glue.streams.transports import Terms, target

    if args.speed < 0.0:
        raise InputError(f'--speed {args.speed:g} is negative; 1 is real time, 0 no waiting')
    connect, address = target(args.to)
    layout = read_layout(args.layout) if args.layout else PLAIN
    seal = read_key(args.key_file) if args.key_file else None
    args.records = [args.record]
    records = load(args)
    if len(records) > 1:
        raise InputError(f'{args.record} holds {len(records)} records; send them one by one')
    (record,) = records
    play.check(record, layout)
    sender = connect(address, Terms(layout, record.rate, time.time_ns, Allowed(), seal))
    try:
        with progress(f'sending to {address}', 1.0) as done:
            sent = play.play(record, layout, sender, args.speed, done)
    finally:
        sender.close()
    if sender.unheard:
        note(f'nobody listened at {address} to {sender.unheard} or more of the datagrams')
    expected = record.duration / args.speed if args.speed else 0.0
    slow = bool(args.speed) and sent.seconds > 1.01 * expected + 0.1
    say(
        f'{sent.samples} samples in {sent.messages} messages to {address} in {sent.seconds:.2f} s'
        f' ({sent.late} times late, {1e3 * sent.latest:.1f} ms at worst)',
        args,
    )
    if slow:
        note(f'the record is {expected:.2f} s long: this computer could not keep up')
    write_json(
        {
            'schema': 'actuator_glue.sent/1',
            'to': str(address),
            **asdict(sent),
            'unheard': sender.unheard,
            'kept_up': not slow,
        },
        args.json,
    )
    return 1 if slow else 0
