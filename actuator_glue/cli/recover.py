"""Mend a bag that was cut off by a killed recorder, a full disk or an incomplete copy."""

from __future__ import annotations

import argparse

from actuator_glue.arguments import Input
from actuator_glue.cli._output import add_json, say
from actuator_glue.io.json_file import write_json

EXAMPLES = (
    'recover cut_off_bag',
    'recover bag_of_test/bag_of_test_0.mcap',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('bag', type=Input, metavar='BAG', help='bag folder or lone .mcap')
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Recover a bag; the original of each mended file stays beside it as NAME.mcap.cut.

    Raises:
        InputError: nothing can be recovered.
    """
    from actuator_glue.io.recover import recover

    recovery = recover(args.bag)
    for line in recovery.notes:
        say(f'found: {line}', args)
    if recovery.rewritten or recovery.notes:
        kept = ', '.join(f'{name}.cut' for name in recovery.rewritten)
        say(
            f'{args.bag}: mended; {recovery.messages} messages over {recovery.seconds:.3f} s are '
            f'whole{f"; originals kept as {kept}" if kept else ""}',
            args,
        )
    else:
        say(f'{args.bag}: nothing to mend, {recovery.messages} messages', args)
    content = {
        'schema': 'actuator_glue.recovery/1',
        'bag': str(args.bag),
        'messages': recovery.messages,
        'seconds': recovery.seconds,
        'rewritten': recovery.rewritten,
        'notes': recovery.notes,
    }
    write_json(content, args.json)
    return 0
