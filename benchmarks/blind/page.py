"""Write what campaigns of one commit found as a page: `page.py FOLDER... --out docs/scores.md`.

Answers of several commits are refused: a score pooled over versions is nobody's.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from reliability import answers, bins, coverage, named, picture
from reliability import table as reliability_table
from score import QUESTIONS, ask_looked_at, judging, scores, share, told, without

from actuator_glue.report import style

Json = dict[str, Any]
GENERATORS = {
    'cases': "one effect on plants around the paper's and the benchmark's",
    'variant': (
        'an implicit step, five families of machines, other forms of effects, fourteen kinds '
        'outside the catalogue'
    ),
    'mixed': (
        'one to four effects at a time, a third with one outside the catalogue; spikes in half; '
        'effects that appear in the middle of a record; no, one or two stiffnesses'
    ),
    'far': (
        "the catalogue's effects on machines and tests of any scale: 2.4 to 40 Hz, 0.02 to 50 mm, "
        '100 to 2048 samples a second, eight shapes of commands'
    ),
}
MACHINES = (
    '## Machines',
    '',
    'Four generators of simulated machines (modules of `benchmarks/blind/`), the first three with '
    "no code of the model; where an equation of theirs is the catalogue's, both agree to 0.06 um "
    '(`test/diagnosis/test_blind_generator.py`).',
    '',
    '| generator | machines |',
    '|---|---|',
    *(f'| `{name}` | {says} |' for name, says in GENERATORS.items()),
    '',
)
NAMES = """How often names were right that were given a probability. The curve from weights to
probabilities was set with other machines (`benchmarks/blind/reliability.py --fit`)."""
SECONDS = """Times, from records in memory to the answer, are those of the computer as it was then:
what runs beside a diagnosis makes them longer. The time left is that of a progress bar, looked at
twice a second; the mean over machines."""
PICTURE = '![Share of right names against the probability given](images/reliability.png)'


def page(results: list[Json], looked_at: Collection[str] = ()) -> str:
    """Return the page.

    Args:
        results: answers of all campaigns.
        looked_at: machines that were left out of them, each `generator:seed`.

    Raises:
        SystemExit: they are of several commits.
    """
    commits = sorted({r.get('commit', 'unknown') for r in results})
    if len(commits) != 1:
        raise SystemExit(f'answers of several commits cannot be pooled: {", ".join(commits)}')
    groups = {
        name: [r for r in results if r['generator'] == name] for name in _generators(results)
    }
    columns = {'all': results, **groups}
    lines = [
        '# Diagnosis: scores',
        '',
        f'Written by `benchmarks/blind/page.py` (`make scores`) from {len(results)} machines '
        f'diagnosed by commit {commits[0]}; brackets are 95 % Clopper-Pearson intervals. '
        '[Beside an earlier commit](scores_paired.md); what was measured of parts alone, and on '
        f'real machines: [measured apart](measured.md).{without(looked_at)}',
        '',
        *MACHINES,
        '## Answers',
        '',
        f'| what | {" | ".join(columns)} |',
        f'|---|{"---|" * len(columns)}',
        '| seeds | ' + ' | '.join(_seeds(rows) for rows in columns.values()) + ' |',
    ]
    counted = {name: scores(rows) for name, rows in columns.items()}
    for key, question in QUESTIONS.items():
        lines.append(
            f'| {question.text} | ' + ' | '.join(told(c[key]) for c in counted.values()) + ' |'
        )
    for text, which in (('sizes of right names', 0), ("Eq. (2)'s parameters", 1)):
        cells = [
            told(share([held for _, held in coverage(rows)[which]])) for rows in columns.values()
        ]
        lines.append(f'| 95 % intervals of {text} that hold the truth | {" | ".join(cells)} |')
    ratio = [c['after_over_true_structure'] for c in counted.values()]
    cells = ['-' if r['median'] is None else f'{r["median"]:.2f}, {r["p90"]:.2f}' for r in ratio]
    lines.append(
        f'| held-out error over that of the true structure: median, 90 % | {" | ".join(cells)} |'
    )
    for text, told_of in TIMES.items():
        cells = [told_of(rows) for rows in columns.values()]
        lines.append(f'| {text} | {" | ".join(cells)} |')
    names = reliability_table(bins(named(results)))
    lines += ['', SECONDS, '', '## Names and probabilities', '', NAMES, '', names, '', PICTURE, '']
    return '\n'.join(lines)


def _generators(results: list[Json]) -> list[str]:
    return sorted({r['generator'] for r in results})


def _seeds(rows: list[Json]) -> str:
    seeds = [r['seed'] for r in rows]
    return f'{min(seeds)} to {max(seeds)}, {len(seeds)}'


def _seconds(rows: list[Json], key: str = 'processor_seconds') -> str:
    times = np.array([r[key] for r in rows])
    return f'{np.median(times):.0f}, {np.quantile(times, 0.95):.0f}, {times.max():.0f}'


def _waited(rows: list[Json]) -> str:
    two = all(r.get('threads') == 2 for r in rows)
    return _seconds(rows, 'seconds') if two else '-'


def _in_time(rows: list[Json]) -> str:
    known = [r['told_in_time'] for r in rows if 'told_in_time' in r]
    return f'{100.0 * np.mean(known):.0f} %' if len(known) == len(rows) else '-'


TIMES = {
    'processor time [s]: median, 95 %, most': _seconds,
    'seconds until the answer with two threads: median, 95 %, most': _waited,
    'time left told within a factor of two, or a second': _in_time,
}


def main() -> int:
    """Read the answers and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('folders', nargs='+', type=Path, help='OUT of campaigns')
    parser.add_argument('--out', type=Path, default=Path('docs/scores.md'))
    ask_looked_at(parser)
    args = parser.parse_args()
    results = judging(answers(args.folders), args.looked_at)
    args.out.write_text(page(results, args.looked_at))
    style.save(picture(bins(named(results))), args.out.parent / 'images' / 'reliability.png')
    print(args.out)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
