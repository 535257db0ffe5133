"""Tell how likely a hybrid test is unstable with a calibrated actuator: go or no-go.

Exit code 0: P(unstable) is told and, with --limit, its upper bound stays within. 1: it exceeds the
limit, or the posterior must not be used as it stands. 2: the input cannot be used.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from actuator_glue.api.bar import progress
from actuator_glue.arguments import Input, Output, number, whole
from actuator_glue.cli._output import add_json, add_report, beside, note, say, table
from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json

EXAMPLES = (
    'rths sdof --posterior monday.npz --limit 0.01',
    'rths benchmark_case_1 --posterior monday.npz --compensator best --report rths.html',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        'partition',
        type=Input,
        metavar='PARTITION',
        help='YAML file of the hybrid test, or a shipped one: benchmark_case_1 ... 4, sdof',
    )
    parser.add_argument(
        '--posterior',
        required=True,
        type=Input,
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
        '--draws', type=whole, default=1000, metavar='N', help='draws to use (default 1000)'
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
        choices=('none', 'inverse', 'ats-fixed', 'ats', 'robust', 'best'),
        default='none',
        help='inverse of the posterior mean; the same within the limits of the adaptive time '
        'series (ats-fixed), or adaptive (ats); robust: smallest 95th percentile of J2; best: try '
        'all and take the best (default none)',
    )
    parser.add_argument(
        '--ground-motion',
        type=Input,
        metavar='RECORD',
        help='every draw runs this record: AT2 (PEER), text with time and acceleration and their '
        'units in the names (m/s^2 where none is said), or artificial[:SEED]',
    )
    parser.add_argument(
        '--scale', type=number, metavar='F', help='factor of the ground motion (default 1)'
    )
    parser.add_argument(
        '--fail',
        type=_criterion,
        action='append',
        metavar='WHAT=LIMIT',
        help='tell how likely drift or displacement [m] of a floor, or force [N] of the specimen '
        'exceeds this; repeatable',
    )
    parser.add_argument(
        '--seed',
        type=whole,
        default=1,
        metavar='S',
        help='seed of specimens and sensor noise (default 1)',
    )
    parser.add_argument(
        '--save', type=Output, metavar='OUT.npz', help='save the result with all its draws'
    )
    add_report(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Compute and print the stability of the test, the answer first.

    Raises:
        InputError: partition, posterior, option or output cannot be used.
    """
    from actuator_glue.api.calibration_result import Calibration
    from actuator_glue.api.compensation import HEADER as COMPARED
    from actuator_glue.api.compensation import compare_compensators
    from actuator_glue.api.rths import rths
    from actuator_glue.api.stability_data import limit_given
    from actuator_glue.api.stability_report import HEADER, lines, rows
    from actuator_glue.api.tracking import FREQUENCIES
    from actuator_glue.io.ground_motion import read_ground_motion

    if args.limit is not None:
        limit_given(args.limit)  # before anything is computed
    motion = None if args.ground_motion is None else read_ground_motion(args.ground_motion, note)
    if args.scale is not None:
        if motion is None:
            raise InputError('--scale needs a --ground-motion to scale')
        motion = motion.scaled(args.scale)
    criteria: dict[str, float] = {}
    for name, limit in args.fail or ():
        if name in criteria:
            raise InputError(f'--fail {name}: one limit for each; take the others out')
        criteria[name] = limit
    calibration = Calibration.load(args.posterior)
    options = {
        'draws': args.draws,
        'frequencies': args.frequency or FREQUENCIES,
        'criteria': criteria,
        'seed': args.seed,
    }
    compared = None
    if args.compensator == 'best':
        with progress('comparing compensators', 1.0) as done:
            compared = compare_compensators(
                args.partition, calibration, motion or 'artificial', progress=done, **options
            )
        found = compared.found[compared.best]
    else:
        bar: AbstractContextManager[Callable[[float], object] | bool] = nullcontext(False)
        if motion is not None:
            bar = progress('virtual test', 1.0)
        with bar as shown:
            found = rths(
                args.partition,
                calibration,
                compensator=args.compensator,
                ground_motion=motion,
                progress=shown,
                **options,
            )
    go = not found.problems if args.limit is None else found.go(args.limit)
    more: dict[str, Any] = {} if args.limit is None else {'limit': args.limit, 'go': go}
    if compared is not None:
        more['comparison'] = compared.to_json()
    content = {**found.to_json(), **more}
    failed = beside(args.json, lambda out: write_json(content, out))
    failed = beside(args.save, found.save) or failed
    for line in found.problems:
        say(line, args)
    if args.limit is not None:
        say(f'{"GO" if go else "NO-GO"} (limit {args.limit:g})', args)
    if compared is not None:
        say(compared.summary(), args)
        table('compensators', COMPARED, compared.rows(), args)
    say(found.summary(), args)
    for line in lines(found):
        say(line, args)
    table(f'{found.partition}, compensator: {found.compensator}', HEADER, rows(found), args)
    for line in found.notes:
        note(line)
    failed = beside(args.report, found.report) or failed
    return failed or (0 if go else 1)


def _criterion(text: str) -> tuple[str, float]:
    name, _, limit = text.partition('=')
    try:
        return name, float(limit)
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            f'{text!r} is no criterion; give for example drift=0.005'
        ) from error
