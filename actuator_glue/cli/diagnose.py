"""Diagnose records: is Eq. (2) enough; if not, which effect is missing, error before and after.

Exit code 0: the model is enough, or what it lacks was named. 1: something remains unexplained, or
the held-out records do not bear out what the fitting records say. 2: the input cannot be used.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

from actuator_glue.api.bar import progress
from actuator_glue.api.held_out_stiffness import with_stiffness
from actuator_glue.arguments import Input, Output, whole
from actuator_glue.cli._effects_file import add_effects_file, load_effects
from actuator_glue.cli._first_page import add_partition, show_first
from actuator_glue.cli._heap import give_back
from actuator_glue.cli._output import add_json, add_report, beside, note, table
from actuator_glue.cli._prior import add_prior, prior_options
from actuator_glue.cli._records import add_records, load
from actuator_glue.io.json_file import write_json
from actuator_glue.records import Record

if TYPE_CHECKING:
    from actuator_glue.api.diagnosis import Diagnosis
    from actuator_glue.io.load import Stiffness

EXAMPLES = (
    'diagnose free.csv clamped.csv --stiffness 0 250e3 --report report.html',
    'diagnose free.csv clamped.csv --stiffness 0 250e3 250e3 --holdout earthquake.csv --json -',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_records(parser)
    parser.add_argument(
        '--holdout',
        action='append',
        default=[],
        type=Input,
        metavar='RECORD',
        help='record that decides nothing and gives the error before and after; repeatable '
        '(default: every fourth block of each record). Where its file does not say its specimen '
        'stiffness, --stiffness has one more value for it behind those of the records',
    )
    add_effects_file(parser)
    add_report(parser)
    parser.add_argument(
        '--save-effects',
        type=Output,
        metavar='OUT.yaml',
        help='also write learned terms, if there are any, as a file for --effects-file',
    )
    parser.add_argument(
        '--false-alarms',
        type=float,
        default=0.01,
        metavar='P',
        help='probability of an addition on a healthy machine (default 0.01)',
    )
    parser.add_argument(
        '--use-force',
        action='store_true',
        help='the recorded force chooses among effects that the displacement cannot tell apart',
    )
    add_partition(parser)
    add_prior(parser)
    parser.add_argument('--seed', type=whole, default=1, metavar='S', help='seed (default 1)')
    parser.add_argument(
        '--effort',
        type=float,
        default=1.0,
        metavar='X',
        help='how much is simulated before what is known by then is told, in times of the usual, '
        'about a minute on two cores (default 1)',
    )
    parser.add_argument(
        '--jobs', type=whole, default=2, metavar='N', help='threads for the refits (default 2)'
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Diagnose, print, and write what was asked for.

    Raises:
        InputError: a record or option cannot be used.
    """
    load_effects(args)
    records, held = _load(args)
    trim = give_back([*records, *held])

    from actuator_glue.api.diagnosis import diagnose

    with progress('diagnose', 1.0) as done:

        def tell(stage: str, share: float) -> None:
            trim()
            done(share)

        found = diagnose(
            records,
            holdout=held or None,
            seed=args.seed,
            jobs=args.jobs,
            progress=tell,
            false_alarms=args.false_alarms,
            use_force=args.use_force,
            effort=args.effort,
            first_look=lambda look: note(look.sentence()),
            **prior_options(args),
        )
    command = shlex.join(['actuator-glue', *sys.argv[1:]])
    found = replace(found, provenance={'command': command, **found.provenance})
    content = found.to_json()
    failed = beside(args.json, lambda out: write_json(content, out))
    if found.learned:
        failed = beside(args.save_effects, found.save_effects) or failed
    following = _show(found, args)
    if args.save_effects is not None and not found.learned:
        note(f'{args.save_effects}: not written, for no term was learned')
    drawn = beside(args.report, lambda out: found.report(out, args.partition, following))
    failed = drawn or failed
    return failed or (0 if found.complete else 1)


def _load(args: argparse.Namespace) -> tuple[list[Record], list[Record]]:
    """Load the fitting and the held-out records.

    `--stiffness` has one value for all, or one for each record and then one for each held-out one,
    or values of the records alone.

    Raises:
        InputError: a record cannot be used, or the stiffness of a held-out one is not known.
    """
    given = list(args.stiffness or ())
    own: list[Stiffness] = []
    if args.holdout and len(given) > 1 and len(given) == len(args.records) + len(args.holdout):
        own = given[len(args.records) :]
        args.stiffness = given[: len(args.records)]
    records = load(args)
    if not args.holdout:
        return records, []
    args.records, args.stiffness = args.holdout, own or (given if len(given) == 1 else None)
    held, assumed = with_stiffness(load(args), records)
    for line in assumed:
        note(line)
    return records, held


def _show(found: Diagnosis, args: argparse.Namespace) -> str:
    """Print the answer; return the command that it says to type next."""
    from actuator_glue.report.diagnosis_summary import next_command

    page = found.first_page(args.partition)
    if found.learned and args.save_effects is not None:
        with_them = next_command(replace(found, learned=()))
        page = page.ending_with(f'{with_them} --effects-file {shlex.quote(args.save_effects)}')
    following = show_first(page, args)
    table(
        'Candidates, Eq. (2) + one effect, refitted',
        ['effect', 'rms um', 'score nats'],
        [[c.name, f'{1e6 * c.error:.2f}', f'{c.score:.1f}'] for c in found.candidates[:8]],
        args,
    )
    for line in found.advice:
        note(line)
    return following
