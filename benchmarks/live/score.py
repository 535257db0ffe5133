"""What a run of the live loop came to, held against the truth."""

from __future__ import annotations

from typing import Any

import numpy as np

from actuator_glue.api.live import carriable
from actuator_glue.online.job import WindowResult
from actuator_glue.online.structures import MATERIAL
from benchmarks.live.cases import NOISE, RATE, Case, Streamed
from benchmarks.live.chain import Chain


def scored(case: Case, given: Streamed, ran: Chain) -> dict[str, Any]:
    """Return one stream's numbers.

    Intervals are mean and 1.96 standard deviations as published, of Eq. (2)'s parameters that a
    window identifies, in windows from the first addition on; of a healthy machine in all.
    """
    inside: list[bool] = []
    weights: list[float] = []
    covered: list[float] = []
    errors: list[float] = []
    worse = longest = 0
    rate = case.drift / case.seconds + given.sizes.get('gain_drift', 0.0)
    truth, proposed = frozenset(carriable(case.effects)), False
    first = ran.added if truth else 0.0
    for result, material in zip(ran.results, ran.material, strict=True):
        worse = worse + 1 if made_worse(result, material) else 0
        longest = max(longest, worse)
        end = result.window.end / RATE
        for band in result.scored:
            if band.kind == 'total' and band.coverage is not None:
                covered.append(float(band.coverage[-1]))
                errors.append(band.rms_error)
        told = dict(zip(map(frozenset, result.structures), result.weights, strict=True))
        proposed = proposed or (bool(truth) and truth in told)
        if proposed:
            weights.append(told.get(truth, 0.0))
        if not end >= first or result.moments is None:
            continue
        theta = given.theta.copy()
        # A model that has the drift itself has the gain at the window's beginning.
        own = 'gain-drift' in result.model.effects
        at = end - (1.0 if own else 0.5) * len(result.window.record) / RATE
        theta[1] *= 1.0 + rate * (at - case.onset)
        mean, sd = result.moments.mean[:4], result.moments.stddev[:4]
        known = ~np.array(result.prior_dominated[:4])
        inside += (np.abs(mean - theta) <= 1.96 * sd)[known].tolist()
    last = ran.results[-1]
    return {
        'inside': float(np.mean(inside)) if inside else np.nan,
        'windows': len(inside),
        'true_weight': weights[-1] if weights else 0.0,
        'true_least': min(weights) if weights else np.nan,
        'leading': list(last.structures[0]),
        'right': frozenset(last.structures[0]) == truth,
        'coverage': float(np.mean(covered)),
        'error': float(np.sqrt(np.mean(np.square(errors[-20:])))) / NOISE,
        'broke': ran.broke,
        'added': ran.added,
        'delay': ran.added - ran.broke,
        'removed': ran.removed,
        'proposals': [[at, [list(s) for s in what]] for at, what in ran.proposals],
        'looks': ran.looks,
        'worse': longest,
    }


def made_worse(result: WindowResult, material: float) -> bool:
    """Whether the leading structure's forecasts were worse than Eq. (2)'s by what matters [m]."""
    if not result.errors or not result.model.effects:
        return False
    material = MATERIAL * result.noise if np.isnan(material) else material
    plain = [
        error
        for error, rival in zip(result.errors[1:], result.rivals, strict=True)
        if not rival.model.effects and np.isfinite(error)
    ]
    return bool(plain) and result.errors[0] > min(plain) + material**2
