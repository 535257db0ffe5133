"""Run the online estimator over a recorded bag; compare bit by bit with what it published live."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from actuator_glue.api.bar import progress
from actuator_glue.arguments import Input, number, number_or_auto, whole
from actuator_glue.cli._output import add_json, note, say, show
from actuator_glue.cli._records import add_reading, load
from actuator_glue.io.json_file import write_json

if TYPE_CHECKING:
    from actuator_glue.api.replay_result import Replay

SETTINGS = ('window', 'hop', 'settle', 'shaping_factor', 'evaluations', 'seed')

EXAMPLES = (
    'replay bag_of_test',
    'replay test.csv --stiffness 250e3 --window 5 --hop 1',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        'bag', type=Input, metavar='BAG', help='bag folder, .mcap, or a laboratory file'
    )
    add_reading(parser)
    parser.add_argument(
        '--namespace', metavar='/NS', help='whose samples, where a bag has several actuators'
    )
    parser.add_argument(
        '--tracking',
        action='store_true',
        help='of each window delay, amplitude, bandwidth, FEI, J1 to J3, TI and HSEM',
    )
    group = parser.add_argument_group(
        'settings', 'for what was not estimated live, or to estimate it differently'
    )
    group.add_argument('--window', type=number, metavar='S', help='length of a window')
    group.add_argument('--hop', type=number, metavar='S', help='time between windows')
    group.add_argument('--settle', type=number, metavar='S', help='uncounted start of a window')
    group.add_argument(
        '--shaping-factor',
        type=number_or_auto,
        metavar='G',
        help="G of Eq. (4); 'auto': half of the samples that each window's residual is worth",
    )
    group.add_argument('--evaluations', type=whole, metavar='N', help='evaluations per window')
    group.add_argument('--seed', type=whole, metavar='S', help='seed of the sampler')
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Replay; 1 where the bag holds a live estimate and the replay differs from it.

    Raises:
        InputError: the bag or a setting cannot be used.
    """
    from actuator_glue.api.replaying import replay
    from actuator_glue.io.bag_reader import is_bag
    from actuator_glue.motion import speak

    source = args.bag
    if not is_bag(args.bag) or args.stiffness is not None or args.hold is not None:
        args.records = [args.bag]
        source = load(args)
    settings = {name: getattr(args, name) for name in SETTINGS}
    with progress('replaying', 1.0) as done:
        found = replay(
            source,
            namespace=args.namespace,
            tracking=args.tracking,
            progress=done,
            **settings,
        )
    speak(found.motion)
    write_json(found.to_json(), args.json)
    from actuator_glue.api.replay_report import tables
    from actuator_glue.report.first_lines import first_lines

    show(tables(found), args)
    for line in (*first_lines(found.notes, 'notes'), *first_lines(found.events, 'events')):
        note(line)
    _verdict(found, args)
    say(
        f'{len(found.windows)} windows over {found.data_seconds:.1f} s of data in '
        f'{found.seconds:.2f} s ({found.times_real_time:.0f} x real time)',
        args,
    )
    return 1 if found.identical is False else 0


def _verdict(found: Replay, args: argparse.Namespace) -> None:
    from actuator_glue.report.first_lines import first_lines

    if found.compared is None:
        say('nothing published live with these settings: nothing to compare with', args)
        return
    lost = found.compared.unrepeatable
    if lost:
        say(f'{len(lost)} windows of the live run cannot be repeated to the bit:', args)
        for line in first_lines(lost, 'windows'):
            say(f'  {line}', args)
    if found.identical is None:
        return
    verdict = 'identical, bit for bit' if found.identical else 'NOT identical'
    say(
        f'replay against live: {verdict} ({found.compared.posteriors} posteriors, '
        f'{found.compared.bands} bands)',
        args,
    )
    for line in first_lines(found.compared.differing, 'differences'):
        say(f'  {line}', args)
