"""Calibrate the servo-hydraulic model from one or several records jointly (GLUE, DREAM(ZS)).

Exit code 0: a posterior to go on with. 1: more than noise is left, so that the intervals do not
hold, or a bound holds a parameter; the first line says so. 2: the input cannot be used.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_glue.api.bar import progress
from actuator_glue.arguments import Output, number, number_or_auto, whole
from actuator_glue.cli._effects_file import add_effects_file, load_effects
from actuator_glue.cli._first_page import add_partition, show_first
from actuator_glue.cli._output import add_json, add_report, beside, note, say, show
from actuator_glue.cli._prior import add_prior, prior_options
from actuator_glue.cli._records import add_records, load
from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json

if TYPE_CHECKING:
    from actuator_glue.api.calibration_options import CalibrationOptions
    from actuator_glue.api.calibration_result import Calibration
    from actuator_glue.api.combinations import Combinations
    from actuator_glue.records import Record
    from actuator_glue.report.html import Table

EXAMPLES = (
    'calibrate free.csv clamped.csv --stiffness 0 250e3 --save monday.npz',
    'calibrate free.csv clamped.csv --stiffness 0 250e3 --effect backlash --report out.html',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_records(parser)
    parser.add_argument(
        '--shaping-factor',
        type=number_or_auto,
        default='auto',
        metavar='G',
        help='G of L = -G ln Var[E], Eq. (4); the paper shows 256 (default auto: half of the '
        'independent samples that the residual is worth by its autocorrelation)',
    )
    parser.add_argument(
        '--likelihood',
        choices=('glue', 'gaussian', 'ar1'),
        default='glue',
        help='glue is Eq. (4); gaussian and ar1 are formal ones (default glue)',
    )
    parser.add_argument(
        '--evaluations',
        type=whole,
        default=60_000,
        metavar='N',
        help='likelihood evaluations (default 60000); with effects and an automatic G as many '
        'again where it changes',
    )
    parser.add_argument('--seed', type=whole, default=1, metavar='S', help='seed (default 1)')
    parser.add_argument(
        '--sampler',
        choices=('adaptive', 'published'),
        default='adaptive',
        help='adaptive is DREAM(ZS) with an adaptive independence move and an annealed start; '
        'published is DREAM(ZS) as Vrugt (2016) runs it, three chains from the prior, and needs '
        'many times the evaluations (default adaptive)',
    )
    parser.add_argument(
        '--effect',
        action='append',
        default=[],
        metavar='NAME',
        help='calibrate Eq. (2) with this effect of the catalogue as well; repeatable',
    )
    add_effects_file(parser)
    parser.add_argument(
        '--initial',
        choices=('auto', 'rest', 'measured'),
        default='auto',
        help='state at the first sample: at rest at zero, or from the first measured samples '
        '(auto: by looking)',
    )
    parser.add_argument(
        '--settle',
        type=number,
        metavar='SECONDS',
        help='start of each record that only lets the initial state be forgotten '
        '(default 0 from rest, else 1 s)',
    )
    parser.add_argument(
        '--bounds',
        action='append',
        default=[],
        metavar='NAME=LO:HI',
        help='prior bounds of a parameter in the unit of the table, as in beta_1=0:800, in place '
        'of those of Table 3 or the catalogue; repeatable',
    )
    parser.add_argument(
        '--use-force',
        action='store_true',
        help='the recorded force is evidence, too: it tells friction, leakage and the specimen '
        'apart; gain and offset of its transducer are fitted in each record',
    )
    add_prior(parser)
    add_partition(parser)
    parser.add_argument(
        '--save',
        '--draws',
        type=Output,
        metavar='OUT.npz|OUT.mat',
        help='save draws, bounds, units and provenance, for `plot --draws` and for others (.npz), '
        'or draws and models for MATLAB (.mat)',
    )
    add_report(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Calibrate and print the posterior moments, first what forbids their use.

    Raises:
        InputError: a record, option or output cannot be used.
    """
    _check_save(args.save)
    load_effects(args)

    from actuator_glue.api.calibration import calibrate
    from actuator_glue.api.calibration_options import CalibrationOptions
    from actuator_glue.api.calibration_report import moments

    options = CalibrationOptions(
        effects=tuple(args.effect),
        bounds=bounds(args.bounds),
        likelihood=args.likelihood,
        shaping_factor=args.shaping_factor,
        evaluations=args.evaluations,
        seed=args.seed,
        sampler=args.sampler,
        initial=args.initial,
        settle=args.settle,
        use_force=args.use_force,
        **prior_options(args),
    )
    records = load(args)
    if args.stiffness and 'unknown' in args.stiffness:
        return _combinations(records, options, args)
    with progress('calibrating', args.evaluations) as done:
        found = calibrate(records, options, progress=done)
    known = moments(found)
    mostly = ['prior' if p.prior_dominated else '' for p in found.parameters.values()]
    if any(mostly):
        rows = [(*row, text) for row, text in zip(known.rows, mostly, strict=True)]
        known = replace(known, header=(*known.header, 'mostly'), rows=rows)
    return _tell(found, known, found.notes, args, args.partition)


def _combinations(
    records: list[Record], options: CalibrationOptions, args: argparse.Namespace
) -> int:
    """Print what holds without a stiffness, and return the exit code."""
    from actuator_glue.api.combinations import combinations
    from actuator_glue.api.combinations_report import moments

    if args.partition is not None:
        raise InputError('a hybrid test cannot be judged without the specimen stiffness; give it')
    if any(record.stiffness is not None for record in records):
        raise InputError(
            'one stiffness is given and another is unknown; calibrate the tests of the one and of '
            'the other on their own'
        )
    with progress('calibrating', args.evaluations) as done:
        found = combinations(records, options, progress=done)
    return _tell(found, moments(found), found.notes[1:], args)


def _tell(
    found: Calibration | Combinations,
    known: Table,
    notes: Sequence[str],
    args: argparse.Namespace,
    *partition: str | None,
) -> int:
    """Write and print what was found, the answer first; return the exit code."""
    from actuator_glue.api.tracking import tables

    content = found.to_json()
    failed = beside(args.json, lambda out: write_json(content, out))
    failed = beside(args.save, _saving(found, args)) or failed
    following = show_first(found.first_page(*partition), args)
    show([known, *tables(found.tracking)], args)
    say(f'{found.evaluations} evaluations in {found.seconds:.1f} s', args)
    compiled = getattr(found, 'compile_seconds', 0.0)
    if compiled > 0.5:
        say(f'{compiled:.1f} s of compilation besides, once per installation', args)
    for line in notes:
        note(line)
    asked: tuple[Any, ...] = (*partition, following)
    failed = beside(args.report, lambda out: found.report(out, *asked)) or failed
    return failed or (1 if found.problems else 0)


def _saving(found: Calibration | Combinations, args: argparse.Namespace) -> Callable[[str], Path]:
    """Return what writes the draws as the suffix of the file says."""
    as_mat = args.save is not None and Path(args.save).suffix.lower() == '.mat'
    return found.save_mat if as_mat else found.save


def _check_save(out: str | None) -> None:
    """Refuse a file of draws that no program would know by its name, before any work.

    Raises:
        InputError: neither .npz nor .mat.
    """
    if out is not None and Path(out).suffix.lower() not in ('.npz', '.mat'):
        raise InputError(
            f'--save {out}: draws are saved as .npz, for `plot`, `rths` and `--prior`, or as '
            '.mat, for MATLAB; give a name that ends in one of these'
        )


def bounds(given: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Return the bounds of options NAME=LO:HI by parameter.

    Raises:
        InputError: not of this form, or a parameter twice.
    """
    out: dict[str, tuple[float, float]] = {}
    for text in given:
        name, _, values = text.partition('=')
        try:
            lower, upper = map(float, values.split(':'))
        except ValueError:
            raise InputError(f'--bounds {text}: give NAME=LO:HI, as in beta_1=0:800') from None
        if name in out:
            raise InputError(f'--bounds {text}: {name} has bounds already')
        out[name] = (lower, upper)
    return out
