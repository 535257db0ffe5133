"""Whether probabilities and intervals are what they say: `reliability.py [--fit] FOLDER...`.

Reads the answers that campaigns left (`FOLDER/**/*.json`), counts how often names were right that
were given a probability, and how often 95 % intervals held the true size. With `--fit` it prints
the curve from shares of the weight to probabilities that these machines ask for: give it none
that are to be judged.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from equivalents import OTHERWISE, catalogued
from score import share
from statsmodels.stats.proportion import proportion_confint

from actuator_glue.diagnosis.score import reliability
from actuator_glue.model.parameters import NAMES
from actuator_glue.report import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Json = dict[str, Any]
_EDGES = (0.0, 0.3, 0.6, 0.85, 0.95, 1.0)
# Misses on one machine go together (alpha_1 beta_0 and alpha_2 correlate by 0.83): over 720
# machines of known structure their number varied 1.7 times as much as that of single misses.
_TOGETHER = 1.7


def answers(folders: Iterable[Path]) -> list[Json]:
    """Return the answers below some folders."""
    paths = sorted(p for folder in folders for p in folder.rglob('*.json'))
    read = [json.loads(p.read_text()) for p in paths]
    return [r for r in read if 'diagnosis' in r]


def truths(result: Json) -> set[str]:
    """Names of a case's effects, as the catalogue has them."""
    return {catalogued(name) for name in result['effects']}


def _tied(effect: Json) -> set[str]:
    """A name and those that are tied with it."""
    return {effect['name'], *(n for pair in effect['alternatives'] for n in pair.split(' + '))}


def named(results: Iterable[Json]) -> list[tuple[float, bool, bool]]:
    """Probability of every name that has one, whether the name is right, whether its set is."""
    out = []
    for result in results:
        true = truths(result)
        for effect in result['diagnosis']['effects']:
            if effect['probability'] is not None:
                held = bool(true & _tied(effect))
                out.append((effect['probability'], effect['name'] in true, held))
    return out


def behind_names(results: Iterable[Json]) -> list[tuple[float, bool]]:
    """Share of the weight behind every name and its rivals, and whether one told is right."""
    out = []
    for result in results:
        true = truths(result)
        for effect in result['diagnosis']['effects']:
            if effect['probability'] is not None:
                share_behind = reliability.share_of(1.0 - effect['none_of_these'])
                out.append((share_behind, bool(true & _tied(effect))))
    return out


def curve(rows: list[tuple[float, bool]]) -> tuple[float, float]:
    """Return how often names are right where no weight is theirs, and where all is.

    The likeliest line; one that is right and one that is wrong are added at both of its ends
    (Laplace's rule), so that no probability is certain.
    """
    rows = [*rows, (0.0, True), (0.0, False), (1.0, True), (1.0, False)]
    share, right = (np.array(column) for column in zip(*rows, strict=True))

    def unlikely(ends: Any) -> float:
        told = ends[0] + (ends[1] - ends[0]) * share
        return -float(np.sum(np.log(np.where(right, told, 1.0 - told))))

    inside = [(1e-3, 1.0 - 1e-3)] * 2
    luck, known = scipy.optimize.minimize(unlikely, [0.2, 0.9], bounds=inside).x
    return float(luck), float(known)


def bins(rows: list[tuple[float, bool, bool]]) -> list[Json]:
    """Count names by their probability."""
    out = []
    for low, high in pairwise(_EDGES):
        inside = [r for r in rows if low <= r[0] < high or r[0] == high == 1.0]
        mean = float(np.mean([r[0] for r in inside])) if inside else None
        out.append(
            {'from': low, 'to': high, 'mean': mean}
            | {'right': share([r[1] for r in inside]), 'in_set': share([r[2] for r in inside])}
        )
    return out


def _holds(estimate: Json, value: float) -> bool:
    return bool(estimate['lower'] <= value <= estimate['upper'])


def coverage(results: Iterable[Json]) -> tuple[list[tuple[str, bool]], list[tuple[str, bool]]]:
    """Return whether intervals hold the truth, with the parameter's name.

    First of the sizes of names that are right, then of Eq. (2)'s parameters on machines all of
    whose effects are named and nothing else (healthy ones among them). What is told as not
    identified has no interval of the data.
    """
    sizes, base = [], []
    for result in results:
        found, values = result['diagnosis'], result['parameters']
        true = truths(result)
        for effect in found['effects']:
            if effect['name'] in true and effect['noise'] is None:
                sizes += [
                    (name, _holds(e, values[name]))
                    for name, e in effect['parameters'].items()
                    if name in values and e['identified']
                ]
        told = {e['name'] for e in found['effects']}
        if told == true and found['complete'] and not told & OTHERWISE:
            base += [
                (name, _holds(found['base'][name], values[name]))
                for name in NAMES
                if found['base'][name]['identified']
            ]
    return sizes, base


def table(rows: list[Json]) -> str:
    """Return the counts as Markdown."""
    lines = ['| probability given | mean | names right | right or in the set of alternatives |']
    lines += ['|---|---|---|---|']
    for row in rows:
        n = row['right']['n']
        if n:
            lines.append(
                f'| {row["from"]:g} to {row["to"]:g} | {row["mean"]:.2f} | '
                f'{_told(row["right"])} | {_told(row["in_set"])} |'
            )
    return '\n'.join(lines)


def _told(found: Json, together: float = 1.0) -> str:
    """Return counts and their interval; `together` such hits count as one."""
    n = found['n']
    if not n:
        return 'none'
    k, size = found['share'] * n / together, n / together
    low, high = proportion_confint(k, size, 0.05, 'beta')
    low, high = float(np.nan_to_num(low)), min(1.0, float(np.nan_to_num(high, nan=1.0)))
    return f'{round(found["share"] * n)} of {n} ({low:.0%} to {high:.0%})'


@style.styled
def picture(rows: list[Json]) -> Figure:
    """Draw the reliability diagram."""
    used = [r for r in rows if r['right']['n']]
    figure = style.new_figure(4.0, 4.2)
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color=style.COMMAND, lw=0.8)
    x = np.array([r['mean'] for r in used])
    y = np.array([r['right']['share'] for r in used])
    low, high = np.reshape([r['right']['ci'] for r in used], (-1, 2)).T
    axes.errorbar(x, y, [y - low, high - y], fmt='o', color=style.BAND, capsize=3)
    for r in used:
        at = r['mean'], r['right']['share']
        axes.annotate(str(r['right']['n']), at, (6, -10), textcoords='offset points')
    axes.set(xlim=(0, 1.02), ylim=(0, 1.02), xlabel='probability given', ylabel='share right')
    return figure


def main() -> int:
    """Print the tables and draw the diagram."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('folders', nargs='+', type=Path)
    parser.add_argument('--picture', type=Path)
    parser.add_argument('--fit', action='store_true', help='print the curve these ask for')
    args = parser.parse_args()
    results = answers(args.folders)
    if args.fit:
        pairs = behind_names(results)
        luck, known = curve(pairs)
        print(f'{len(pairs)} names of {len(results)} machines: {luck:.3f}, {known:.3f}')
    rows = bins(named(results))
    print(f'{len(results)} machines\n\n{table(rows)}\n')
    sizes, base = coverage(results)
    kinds = ('sizes of right names', sizes, 1.0), ("Eq. (2)'s parameters", base, _TOGETHER)
    for title, found, together in kinds:
        print(f'95 % intervals, {title}: {_told(share([hit for _, hit in found]), together)}')
        for name in sorted({n for n, hit in found if not hit}):
            print(f'  missed: {name} {_told(share([h for n, h in found if n == name]))}')
    if args.picture:
        style.save(picture(rows), args.picture)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
