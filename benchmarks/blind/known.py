"""Whether 95 % intervals hold the truth where the structure is known: `known.py --cases 300`.

Machines of a generator with effects whose equation is the catalogue's, prepared as a diagnosis
prepares them; their own structure is refitted and its posterior drawn. What search and naming do
is not in it, so hundreds take minutes. A size counts that is 3.3 standard deviations from neutral,
as one that is told would be, and so does a parameter that the records identify.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
sys.path.insert(0, str(HERE.parents[1]))

_SEEN = 3.3  # standard deviations from neutral: once in a thousand by chance
_NO_MEAN = ('quantisation', 'timing-jitter', 'hum')


class Interval(NamedTuple):
    """One parameter's name, how far the truth is in standard deviations, whether it is inside."""

    name: str
    pull: float
    holds: bool


def intervals(seed: int, generator: str, evaluations: int) -> list[Interval]:
    """Return the intervals of one machine; none of what the catalogue writes in another way."""
    import numpy as np
    from equivalents import OTHERWISE

    from actuator_glue.diagnosis.posterior import posterior
    from actuator_glue.diagnosis.posterior.discrepancy import beside, responses
    from actuator_glue.diagnosis.posterior.ridge import left_open
    from actuator_glue.diagnosis.refits.candidates import mean_effects
    from actuator_glue.diagnosis.refits.refits import Refits
    from actuator_glue.diagnosis.samples.preparation import prepare
    from actuator_glue.diagnosis.score.scorer import Scorer, pooled, splits_of
    from actuator_glue.diagnosis.thresholds import least_material
    from actuator_glue.inference.least_squares.fit import fit
    from actuator_glue.inference.least_squares.space import Space
    from actuator_glue.model.effects import CATALOGUE
    from actuator_glue.model.parameters import NAMES
    from actuator_glue.model.structure import Structure
    from actuator_glue.records import Record

    case = import_module(generator).build(seed)
    # Healthy ones have what does not matter beside Eq. (2), others onsets, in their sizes alone.
    usual = all(n in CATALOGUE and n not in _NO_MEAN for n in (*case.effects, *case.sizes))
    if not usual or (case.kind == 'none' and case.sizes) or OTHERWISE.intersection(case.effects):
        return []
    model = Structure(tuple(case.effects))
    values = dict(zip(NAMES, map(float, case.theta), strict=True)) | case.parameters
    if any(p.name not in values for p in model.parameters):
        return []
    true = np.array([values[p.name] for p in model.parameters])
    rows = zip(case.commands, case.measured, case.stiffness, strict=True)
    *records, held = (Record(u, y, 1.0 / case.rate, stiffness=k) for u, y, k in rows)
    data = prepare(records, [held]).fit
    found = fit(data, model, true)
    splits = splits_of(data, found.error)
    scorer = Scorer.of(data, splits)
    scorer = replace(scorer, data=replace(data, finer=not model.linear))  # as a diagnosis does
    refits = Refits(data, mean_effects())
    refits.base()
    matters = least_material(pooled(data, splits)[1], refits.scale().stroke)
    draws = posterior.sample(
        model,
        found,
        scorer,
        beside=beside(responses(refits, matters), model.effects, scorer),
        rng=np.random.default_rng(seed),
        evaluations=evaluations,
        progress=lambda share: None,
    ).points
    space = Space(model, data.duration)
    known = posterior.identified(space, draws, left_open(space, model, scorer, found.theta))
    low, high = np.quantile(draws, [0.025, 0.975], axis=0)
    mean, spread = draws.mean(axis=0), draws.std(axis=0)
    out = []
    for j, p in enumerate(model.parameters):
        told = p.neutral is None or abs(mean[j] - p.neutral) > _SEEN * spread[j]
        if known[j] and told:
            holds = bool(low[j] <= true[j] <= high[j])
            out.append(Interval(p.name, float((mean[j] - true[j]) / spread[j]), holds))
    return out


def said(what: str, found: list[Interval]) -> str:
    """Return how many intervals hold the truth, with 95 % limits, and the mean squared pull."""
    from score import share

    if not found:
        return f'{what}: none'
    hits = [f.holds for f in found]
    low, high = share(hits)['ci']
    square = sum(f.pull**2 for f in found) / len(found)
    return (
        f'{what}: {sum(hits)} of {len(hits)} ({100 * low:.1f} to {100 * high:.1f} %), '
        f'mean squared pull {square:.2f}'
    )


def main() -> int:
    """Draw the machines and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--generator', choices=('cases', 'variant', 'mixed', 'far'), nargs='+')
    parser.add_argument('--first', type=int, default=1000)
    parser.add_argument('--cases', type=int, default=300)
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--evaluations', type=int, default=12_000, help='0: normal approximation')
    args = parser.parse_args()
    from actuator_glue.model.parameters import NAMES

    every: list[Interval] = []
    for generator in args.generator or ('cases', 'variant', 'mixed', 'far'):
        seeds = range(args.first, args.first + args.cases)
        one = partial(intervals, generator=generator, evaluations=args.evaluations)
        with ProcessPoolExecutor(args.jobs) as pool:
            found = [i for some in pool.map(one, seeds) for i in some]
        every += found
        _print(generator, found, NAMES)
    _print('all', every, NAMES)
    return 0


def _print(name: str, found: list[Interval], base: Iterable[str]) -> None:
    print(said(f'{name}, sizes', [f for f in found if f.name not in base]), flush=True)
    print(said(f"{name}, Eq. (2)'s parameters", [f for f in found if f.name in base]), flush=True)


if __name__ == '__main__':
    raise SystemExit(main())
