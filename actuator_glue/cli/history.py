"""Tell what the tests of a campaign say of each actuator: changes, effects, its next test."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

from actuator_glue.arguments import Folder, Input, duration, whole
from actuator_glue.cli._output import add_json, beside, note, say, table
from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json

EXAMPLES = (
    'history campaign --report pages',
    'history campaign --actuator north --prior priors --ahead 7d',
)

_LONGEST = 60  # letters of a file's name


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('folder', type=Input, metavar='DIR', help='what `campaign --out DIR` made')
    parser.add_argument(
        '--actuator', metavar='NAME', help='of this one alone (default: every one with days)'
    )
    parser.add_argument(
        '--report', type=Folder, metavar='DIR', help='write a page for each actuator, NAME.html'
    )
    parser.add_argument(
        '--prior',
        type=Folder,
        metavar='DIR',
        help='write what is known of the next test, NAME.npz, for --prior of calibrate, diagnose',
    )
    parser.add_argument(
        '--ahead',
        type=duration,
        metavar='TIME',
        help='time from the last test to the next one, as 12h or 7d (default: as between tests)',
    )
    parser.add_argument('--seed', type=whole, default=1, metavar='S', help='seed (default 1)')
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print the history of each actuator, and write pages and priors.

    Raises:
        InputError: no campaign there, no such actuator, or a folder that cannot be written.
    """
    from actuator_glue.api.given import seed_given
    from actuator_glue.campaigns.actuator_history import ActuatorHistory, history
    from actuator_glue.campaigns.history_page import lead
    from actuator_glue.campaigns.rows import read_results
    from actuator_glue.campaigns.series import actuators_of
    from actuator_glue.report.quantity import said

    seed_given(args.seed)  # one that is wrong is wrong of every actuator
    results = read_results(args.folder)
    names = [args.actuator] if args.actuator else actuators_of(results)
    if not names:
        raise InputError(
            f'{args.folder}: no test has an actuator and a day; let names, a table or the files '
            'say them (see `names` of the recipe)'
        )
    ahead = None if args.ahead is None else args.ahead / 86400.0
    found: list[ActuatorHistory] = []
    for name in names:
        try:
            found.append(history(args.folder, name, ahead=ahead, seed=args.seed, results=results))
        except InputError as error:
            if args.actuator:
                raise
            note(str(error))  # the others have a history all the same
    content = {
        'schema': 'actuator_glue.histories/1',
        'actuators': [one.to_json() for one in found],
    }
    failed = beside(args.json, lambda out: write_json(content, out))
    for one in found:
        say(f'{one.actuator}: {lead(one)}', args)
        if one.changes:
            rows = [
                (c.day, f'{c.earliest} to {c.latest}', f'{c.probability:.3f}', ', '.join(c.moved))
                for c in one.changes
            ]
            table('Changes', ['first test after', '95 %', 'probability', 'moved'], rows, args)
        low, high = one.pooled.next_interval()
        units = _units()
        predicted = [
            (n, said(low[i], units[n], 4), said(high[i], units[n], 4))
            for i, n in enumerate(one.pooled.names)
        ]
        table('The next test', ['parameter', '2.5 %', '97.5 %'], predicted, args)
    for one, stem in zip(found, _stems([one.actuator for one in found]), strict=True):
        for folder, suffix, write in (
            (args.prior, '.npz', one.prior.save),
            (args.report, '.html', one.report),
        ):
            if folder is not None:
                Path(folder).mkdir(parents=True, exist_ok=True)
                failed = beside(str(Path(folder) / f'{stem}{suffix}'), write) or failed
    return failed or (0 if found else 2)


def _stems(names: Sequence[str]) -> list[str]:
    """Return a file's name for each actuator: what only a folder or no file may have is `_`."""
    out: list[str] = []
    for name in names:
        stem = re.sub(r'[^\w .-]', '_', name).strip(' .')[:_LONGEST] or '_'
        while stem in out:
            stem += '_'
        out.append(stem)
    return out


def _units() -> dict[str, str]:
    from actuator_glue.model.parameters import BASE

    return {p.name: p.unit for p in BASE}
