"""Tell how likely a hybrid test is unstable with a calibrated actuator: go or no-go.

Exit code 0: P(unstable) is told and, with --limit, its upper bound stays within. 1: it exceeds the
limit, or the posterior must not be used as it stands. 2: the input cannot be used.
"""

from __future__ import annotations

import argparse

from actuator_glue.arguments import Output, number
from actuator_glue.cli._output import add_json, note, say, table
from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        'partition',
        metavar='PARTITION',
        help='YAML file of the hybrid test, or a shipped one: benchmark_case_1 ... 4, sdof',
    )
    parser.add_argument(
        '--posterior',
        required=True,
        metavar='DRAWS.npz',
        help='what `calibrate --save` wrote',
    )
    parser.add_argument(
        '--limit',
        type=number,
        metavar='P',
        help='largest P(unstable) to go with, 0 to 1; its upper 95 %% bound is held to it',
    )
    parser.add_argument(
        '--draws', type=int, default=1000, metavar='N', help='draws to use (default 1000)'
    )
    parser.add_argument(
        '--frequency',
        type=number,
        action='append',
        metavar='HZ',
        help='tell delay and amplitude of the actuator here; repeatable (default 1 5 10)',
    )
    parser.add_argument(
        '--compensator',
        choices=('none', 'inverse'),
        default='none',
        help='inverse: the band-limited inverse of the posterior mean (default none)',
    )
    parser.add_argument(
        '--band',
        type=number,
        metavar='HZ',
        help='low-pass of the inverse (default a fortieth of the sample rate)',
    )
    parser.add_argument(
        '--seed', type=int, default=1, metavar='S', help="seed of the specimen's draws (default 1)"
    )
    parser.add_argument(
        '--save', type=Output, metavar='OUT.npz', help='save the result with all its draws'
    )
    parser.add_argument(
        '--report', type=Output, metavar='OUT.html', help='also write a report, one HTML file'
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Compute and print the stability of the test, the answer first.

    Raises:
        InputError: partition, posterior, option or output cannot be used.
    """
    if args.limit is not None and not 0.0 <= args.limit <= 1.0:
        raise InputError(f'--limit {args.limit:g}: a probability lies between 0 and 1')

    from actuator_glue.api.calibration_result import Calibration
    from actuator_glue.api.rths import FREQUENCIES, rths
    from actuator_glue.api.stability_report import HEADER, margin_line, rows, sensitivity_line

    found = rths(
        args.partition,
        Calibration.load(args.posterior),
        draws=args.draws,
        frequencies=args.frequency or FREQUENCIES,
        compensator=args.compensator,
        band_hz=args.band,
        seed=args.seed,
    )
    go = not found.problems if args.limit is None else found.go(args.limit)
    for line in found.problems:
        say(line, args)
    if args.limit is not None:
        say(f'{"GO" if go else "NO-GO"} (limit {args.limit:g})', args)
    say(found.summary(), args)
    say(margin_line(found), args)
    table(f'{found.partition}, compensator: {found.compensator}', HEADER, rows(found), args)
    say(sensitivity_line(found), args)
    for line in found.notes:
        note(line)
    if args.save is not None:
        found.save(args.save)
    if args.report is not None:
        found.report(args.report)
    decision = {} if args.limit is None else {'limit': args.limit, 'go': go}
    write_json({**found.to_json(), **decision}, args.json)
    return 0 if go else 1
