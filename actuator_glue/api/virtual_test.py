"""The result of a virtual hybrid test over the draws of a posterior."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from os import cpu_count
from typing import Any

import numpy as np

from actuator_glue.api.spread import Spread, spread
from actuator_glue.errors import InputError
from actuator_glue.hybrid.stability import Share, share
from actuator_glue.hybrid.virtual import Responses, VirtualTest, joined
from actuator_glue.records import Array

CRITERIA = {'drift': 'm', 'displacement': 'm', 'force': 'N'}


@dataclass(frozen=True, slots=True)
class Failure:
    """How likely a criterion is exceeded.

    Attributes:
        criterion: 'drift', 'displacement' (of any floor) or 'force' (of the specimen).
        limit: peak that must not be exceeded [m or N].
        probability: share of the draws that exceed it, or diverge.
    """

    criterion: str
    limit: float
    probability: Share


@dataclass(frozen=True, slots=True, eq=False)
class VirtualResult:
    """What the draws did under a ground motion.

    Attributes:
        ground_motion: its name.
        duration_s: its length.
        diverged: share of draws whose floors left five times the reference's peak.
        indicators: J1_s to J3 of the piston's tracking, then rms error of each floor against the
            reference structure, then peak error of each; peaks of displacement, drift and force.
            Over the draws that did not diverge; empty where all did.
        j2_percentile_95: of J2 over all draws; None where more than 5 % diverged.
        failures: of the criteria that were asked for.
        time_s: of the bands, (times,).
        lower, median, upper: 95 % band of each floor's displacement over the draws that did not
            diverge, (times, floors) [m].
        reference: of the reference structure, their median, (times, floors) [m].
    """

    ground_motion: str
    duration_s: float
    diverged: Share
    indicators: dict[str, Spread]
    j2_percentile_95: float | None
    failures: tuple[Failure, ...]
    time_s: Array
    lower: Array
    median: Array
    upper: Array
    reference: Array

    def to_json(self) -> dict[str, Any]:
        """Return everything but the bands."""
        return {
            'ground_motion': self.ground_motion,
            'duration_s': self.duration_s,
            'diverged': asdict(self.diverged),
            'indicators': {name: asdict(s) for name, s in self.indicators.items()},
            'j2_percentile_95': self.j2_percentile_95,
            'failures': [asdict(f) for f in self.failures],
        }


def check_criteria(criteria: Mapping[str, float]) -> None:
    """Refuse unknown criteria and limits that are not positive.

    Raises:
        InputError: one of them.
    """
    for name, limit in criteria.items():
        if name not in CRITERIA:
            raise InputError(f'criterion {name!r} is unknown; use one of {", ".join(CRITERIA)}')
        if not 0.0 < limit < np.inf:
            raise InputError(f'criterion {name}: limit {limit:g} {CRITERIA[name]} is not positive')


def run(test: VirtualTest, done: Callable[[float], object]) -> Responses:
    """Run all blocks of a virtual test, one to a core.

    Args:
        test: the virtual test.
        done: called with the share of the blocks that have run, in (0, 1].
    """
    parts = []
    with ThreadPoolExecutor(cpu_count() or 1) as pool:
        for part in pool.map(test.run, range(test.blocks)):
            parts.append(part)
            done(len(parts) / test.blocks)
    return joined(parts)


def summarise(
    responses: Responses,
    time: Array,
    motion: tuple[str, float],
    criteria: Mapping[str, float],
    effective: float,
) -> VirtualResult:
    """Return what responses say.

    Args:
        responses: of all draws.
        time: of the responses kept, (times,) [s].
        motion: name and length [s] of the ground motion.
        criteria: limits of 'drift', 'displacement', 'force'.
        effective: independent draws that these are worth.
    """
    whole = ~responses.diverged
    floors = len(responses.drift)
    named = {'J1_s': responses.j1, 'J2': responses.j2, 'J3': responses.j3}
    named |= {f'J{4 + i}': row for i, row in enumerate(responses.rms_error)}
    named |= {f'J{4 + floors + i}': row for i, row in enumerate(responses.peak_error)}
    peaks = {
        'displacement': responses.displacement.max(axis=0),
        'drift': responses.drift.max(axis=0),
        'force': responses.force,
    }
    named |= {f'peak_{name}_{CRITERIA[name].lower()}': row for name, row in peaks.items()}
    failures = tuple(
        Failure(name, limit, share(~(peaks[name] <= limit) | ~whole, effective))
        for name, limit in criteria.items()
    )
    kept, perfect = responses.response[..., whole], responses.whole[..., whole]
    nothing = np.full((*kept.shape[:2],), np.nan)
    # The next test is one more draw: between the order statistics i and j of m draws it lies with
    # probability (j - i)/(m + 1), which these quantiles make 95 %; plainer ones hold less.
    bands = [nothing] * 3
    if whole.any():
        bands = list(np.quantile(kept, (0.025, 0.5, 0.975), axis=2, method='weibull'))
    j2 = np.where(whole, responses.j2, np.inf)
    # Nothing lies between a number and infinity.
    worst = float(np.percentile(j2, 95.0, method='linear' if whole.all() else 'higher'))
    return VirtualResult(
        ground_motion=motion[0],
        duration_s=motion[1],
        diverged=share(responses.diverged, effective),
        indicators={n: spread(row[whole]) for n, row in named.items()} if whole.any() else {},
        j2_percentile_95=worst if np.isfinite(worst) else None,
        failures=failures,
        time_s=time,
        lower=bands[0],
        median=bands[1],
        upper=bands[2],
        reference=np.median(perfect, axis=2) if whole.any() else nothing,
    )
