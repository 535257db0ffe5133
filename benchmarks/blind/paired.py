"""Hold the answers of one commit against another's: `paired.py BEFORE AFTER [--out FILE]`.

`--looked-at mixed:95004` leaves out a machine that something was mended on: it does not judge.

Both folders are `--out` of campaigns over the same generators and seeds. Only machines that both
have are compared, each with itself: what differs is told by the machines that changed (McNemar
1947, exact), not by two intervals that overlap. Exit code 1: something is worse beyond chance.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from reliability import answers, coverage
from scipy.stats import binomtest
from score import QUESTIONS, ask_looked_at, judging, share, told, without

Json = dict[str, Any]
Pair = tuple[Json, Json]
_CHANCE = 0.05  # what is less probable than this by chance is no chance
_FAR = 1.05  # held-out errors that differ by this factor are not the same answer


def pairs(before: list[Json], after: list[Json], looked_at: Collection[str] = ()) -> list[Pair]:
    """Return the answers of both commits about each machine that both have.

    Args:
        before: of one commit.
        after: of another.
        looked_at: machines left out, each `generator:seed`.

    Raises:
        SystemExit: none, or answers of several commits on a side.
    """
    for name, results in (('BEFORE', before), ('AFTER', after)):
        commits = sorted({r['commit'] for r in results})
        if len(commits) > 1:
            raise SystemExit(f'{name} has answers of several commits: {", ".join(commits)}')
    known = {(r['generator'], r['seed']): r for r in before}
    asked = judging(after, looked_at)
    found = [(known[key], r) for r in asked if (key := (r['generator'], r['seed'])) in known]
    if not found:
        raise SystemExit('no machine is in both folders')
    return found


def by_chance(lost: int, won: int) -> float:
    """Return the probability that chance alone changes answers as unevenly, either way.

    Args:
        lost: machines whose answer was right before and is wrong now.
        won: machines whose answer was wrong before and is right now.
    """
    changed = lost + won
    return float(binomtest(min(lost, won), changed).pvalue) if changed else 1.0


def table(found: list[Pair]) -> tuple[list[str], bool]:
    """Return the rows of a Markdown table, and whether something is worse beyond chance."""
    lines = [
        '| what | before | after | lost, won | by chance |',
        '|---|---|---|---|---|',
    ]
    worse = False
    for question in QUESTIONS.values():
        asked = [(question.yes(b), question.yes(a)) for b, a in found if question.of(b)]
        good = [(b == question.wanted, a == question.wanted) for b, a in asked]
        lost = sum(b and not a for b, a in good)
        won = sum(a and not b for b, a in good)
        chance = by_chance(lost, won)
        worse |= lost > won and chance < _CHANCE
        sides = [told(share([side[i] for side in asked])) for i in (0, 1)]
        lines.append(f'| {question.text} | {" | ".join(sides)} | {lost}, {won} | {chance:.2f} |')
    for i, text in enumerate(('sizes of right names', "Eq. (2)'s parameters")):
        sides = [
            told(share([hit for _, hit in coverage([pair[side] for pair in found])[i]]))
            for side in (0, 1)
        ]
        lines.append(f'| 95 % intervals of {text} that hold the truth | {" | ".join(sides)} | | |')
    return lines, worse


def held_out(found: list[Pair]) -> str:
    """Say how the errors of held-out records compare."""
    errors = [[side['diagnosis']['error']['after'] for side in pair] for pair in found]
    ratio = np.array([after / before for before, after in errors])
    return (
        f'Held-out error, after over before: {np.exp(np.mean(np.log(ratio))):.3f} (geometric '
        f'mean), {ratio.min():.2f} to {ratio.max():.2f}; {(ratio > _FAR).sum()} machines worse '
        f'by more than {_FAR - 1.0:.0%}, {(ratio < 1.0 / _FAR).sum()} better.'
    )


def seconds(found: list[Pair]) -> str:
    """Say how the times of a processor compare."""
    times = np.array([[side['processor_seconds'] for side in pair] for pair in found])
    sides = [f'{np.median(t):.0f}, {np.quantile(t, 0.95):.0f}, {t.max():.0f} s' for t in times.T]
    ratio = float(np.median(times[:, 1] / times[:, 0]))
    return (
        f'Processor time, median, 95 % and most: {sides[0]} before, {sides[1]} after; '
        f'{ratio:.2f} times as long on the median machine.'
    )


def page(found: list[Pair], looked_at: Collection[str] = ()) -> tuple[str, bool]:
    """Return the page, and whether something is worse beyond chance."""
    lines, worse = table(found)
    counts = ', '.join(
        f'{sum(a["generator"] == name for _, a in found)} of `{name}`'
        for name in sorted({a['generator'] for _, a in found})
    )
    seeds = [a['seed'] for _, a in found]
    before, after = found[0]
    head = (
        f'Written by `benchmarks/blind/paired.py` from {len(found)} machines ({counts}; seeds '
        f'{min(seeds)} to {max(seeds)}), each diagnosed by commit {before["commit"]} and by '
        f'commit {after["commit"]}. `by chance`: how probable it is that those which changed are '
        'as uneven (McNemar 1947, exact). What the generators are is in '
        f'[scores](scores.md).{without(looked_at)}'
    )
    title = '# Diagnosis: two commits about the same machines'
    return '\n'.join(
        [title, '', head, '', *lines, '', held_out(found), '', seconds(found), '']
    ), worse


def main() -> int:
    """Compare, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('before', type=Path, help='OUT of campaigns of one commit')
    parser.add_argument('after', type=Path, help="OUT of the same machines' campaigns of another")
    parser.add_argument('--out', type=Path, help='Markdown file to write')
    parser.add_argument('--add', type=Path, help='Markdown file to add the comparison to')
    ask_looked_at(parser)
    args = parser.parse_args()
    found = pairs(answers([args.before]), answers([args.after]), args.looked_at)
    text, worse = page(found, args.looked_at)
    print(text)
    if args.out:
        args.out.write_text(text)
    if args.add:
        before, after = (side['commit'] for side in found[0])
        _, _, rest = text.partition('\n')
        with args.add.open('a') as file:
            file.write(f'\n## {before} and {after}\n{rest}')
    return int(worse)


if __name__ == '__main__':
    raise SystemExit(main())
