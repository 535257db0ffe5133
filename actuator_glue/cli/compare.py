"""Compare two tests, days or stretches of days of an actuator: is it another machine.

Exit code 0: no difference beyond ageing and scatter of days. 1: another machine. 2: the input
cannot be used.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict

from actuator_glue.arguments import Input
from actuator_glue.cli._output import add_json, beside, note, say, table
from actuator_glue.io.json_file import write_json

EXAMPLES = (
    'compare campaign 2026-03-01 2026-03-15 --actuator north',
    'compare campaign 2026-01-01:2026-03-31 2026-04-01:2026-06-30 --actuator north --json -',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('folder', type=Input, metavar='DIR', help='what `campaign --out DIR` made')
    parser.add_argument(
        'a', metavar='A', help='a day, a stretch of days FIRST:LAST, or the name of a test'
    )
    parser.add_argument('b', metavar='B', help='the other side')
    parser.add_argument(
        '--actuator', metavar='NAME', help='whose days (default: the only one, or the test tells)'
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print how B differs from A.

    Raises:
        InputError: no campaign there, no such test or day.
    """
    from actuator_glue.campaigns.comparison import HEADER, compare

    found = compare(args.folder, args.a, args.b, actuator=args.actuator)
    content = {'schema': 'actuator_glue.comparison/1', **asdict(found)}
    failed = beside(args.json, lambda out: write_json(content, out))
    say(found.summary(), args)
    sides = ((args.b, found.b), (args.a, found.a))
    title = ' over '.join(f'{n} ({len(d)} day{"s" * (len(d) != 1)})' for n, d in sides)
    table(title, HEADER, [d.row() for d in found.differences], args)
    for line in found.notes:
        note(line)
    return failed or (1 if found.different else 0)
