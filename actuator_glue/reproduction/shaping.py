"""The shaping factor: chains, convergence, spread and held-out coverage of G_1 ... G_8."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuator_glue.inference.bands import band
from actuator_glue.inference.convergence import gelman_rubin
from actuator_glue.inference.scores import coverage
from actuator_glue.model import linear
from actuator_glue.model.exact import ExactErrors
from actuator_glue.records import Array, Record
from actuator_glue.reproduction.posterior import AS_PUBLISHED, Posterior, Progress, run
from actuator_glue.reproduction.published import THRESHOLD

BLOCK = 6.0  # s; blocks alternate between fit and held out, so that both see every frequency
SETTLE = 0.5  # s; ten time constants of the slower test
WIDEST = 0.5  # posterior over prior standard deviation
LEVEL = 0.95
NEAR = 0.03  # coverage this near to the level counts as covering
STRICT = 1.05  # rank-normalised R-hat of the runs that carry results


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """R-hat of one run against its likelihood evaluations.

    Attributes:
        evaluations: shape (c,).
        rhat: Gelman-Rubin of each parameter over the last half of the chains, shape (c, 4).
    """

    evaluations: Array
    rhat: Array

    def converged_at(self) -> float:
        """Evaluations after which every parameter stays below 1.2; infinity if never."""
        above = np.flatnonzero(~(self.rhat < THRESHOLD).all(axis=1))
        after = int(above[-1]) + 1 if above.size else 0
        return float(self.evaluations[after]) if after < len(self.evaluations) else np.inf


@dataclass(frozen=True, slots=True, eq=False)
class Shaped:
    """What one shaping factor leads to.

    Attributes:
        shaping_factor: G.
        published: DREAM(ZS) from the prior, three chains, as the paper ran it.
        published_trace: its R-hat.
        ours: the posterior with this project's start and moves.
        ours_trace: its R-hat.
        held_out: share of held-out measured samples inside the 95 % GLUE band.
        width: mean width of that band [m].
    """

    shaping_factor: float
    published: Posterior
    published_trace: Trace
    ours: Posterior
    ours_trace: Trace
    held_out: float
    width: float

    @property
    def converged(self) -> bool:
        """Whether our run converged (rank-normalised R-hat, stricter than the paper's)."""
        return bool((self.ours.chains.rhat < STRICT).all())

    @property
    def informative(self) -> bool:
        """Whether every parameter is narrower than half its prior."""
        return bool((self.ours.prior_share() < WIDEST).all())


@dataclass(frozen=True, slots=True)
class Choice:
    """The shaping factor chosen, and why.

    Attributes:
        shaping_factor: G.
        reason: one sentence.
        covers: whether its GLUE band covers held-out samples within `NEAR` of its level.
    """

    shaping_factor: float
    reason: str
    covers: bool


def trace(posterior: Posterior, points: int = 60) -> Trace:
    """Return R-hat at lengths of a run that grow by equal factors."""
    draws = posterior.chains.draws
    lengths = np.unique(np.geomspace(min(20, len(draws)), len(draws), points).astype(int))
    return Trace(
        np.array([posterior.chains.evaluations_at(n - 1) for n in lengths], dtype=float),
        np.array([gelman_rubin(draws[:n]) for n in lengths]),
    )


def blocks(record: Record) -> tuple[list[Record], list[slice]]:
    """Return the fit blocks of a record and where its held-out blocks lie."""
    size = round(BLOCK / record.period)
    starts = range(0, len(record) - size // 2, size)
    fit = [record.slice(s, s + size) for i, s in enumerate(starts) if i % 2 == 0]
    held = [slice(s, min(s + size, len(record))) for i, s in enumerate(starts) if i % 2 == 1]
    return fit, held


def study(
    seed: int,
    records: Sequence[Record],
    shaping_factors: Sequence[float],
    evaluations: int,
    published_evaluations: int,
    *,
    added_rms: float,
    draws: int,
    progress: Progress,
) -> list[Shaped]:
    """Sample every shaping factor three times: as published, ours, and ours on fit blocks only.

    Args:
        seed: of the whole study.
        records: both tests.
        shaping_factors: G.
        evaluations: of each of our runs.
        published_evaluations: of each run as published.
        added_rms: uncorrelated residual added to the records [m].
        draws: parameter draws per band.
        progress: called with the share done.
    """
    whole = ExactErrors(records)
    split = [blocks(r) for r in records]
    fit = [part for parts, _ in split for part in parts]
    settle = round(SETTLE / records[0].period)
    kept = ExactErrors(fit, settle, initial='measured')
    found = []
    for i, factor in enumerate(shaping_factors):
        word = round(added_rms * 1e9)
        published = run(
            (seed, 50, i, word), whole, factor, published_evaluations,
            added_rms=added_rms, settings=AS_PUBLISHED,
        )  # fmt: skip
        ours = run((seed, 51, i, word), whole, factor, evaluations, added_rms=added_rms)
        part = run((seed, 52, i, word), kept, factor, evaluations, added_rms=added_rms)
        inside, width = _held_out(part.thinned(draws), records, [held for _, held in split])
        found.append(Shaped(factor, published, trace(published), ours, trace(ours), inside, width))
        progress((i + 1) / len(shaping_factors))
    return found


def _held_out(
    theta: Array, records: Sequence[Record], held: Sequence[Sequence[slice]]
) -> tuple[float, float]:
    measured, lower, upper = [], [], []
    for record, parts in zip(records, held, strict=True):
        responses = linear.simulate(
            theta, record.command, stiffness=record.known_stiffness(),
            period=record.period, hold=record.hold,
        )  # fmt: skip
        low, high = band(responses, [LEVEL]).at(LEVEL)
        for part in parts:
            measured.append(record.measured[part])
            lower.append(low[part])
            upper.append(high[part])
    low, high = np.concatenate(lower), np.concatenate(upper)
    return coverage(np.concatenate(measured), low, high), float(np.mean(high - low))


def choose(shaped: Sequence[Shaped]) -> Choice:
    """Choose a shaping factor: converged, informative, held-out coverage nearest to nominal.

    Of two equally near, the larger G (the narrower band).

    Args:
        shaped: from `study`, in any order.
    """
    usable = [s for s in shaped if s.converged and s.informative]
    if not usable:
        narrow = max(shaped, key=lambda s: s.shaping_factor)
        reason = 'no candidate both converged and is narrower than half its prior; the largest G'
        return Choice(narrow.shaping_factor, reason, False)
    best = min(usable, key=lambda s: (round(abs(s.held_out - LEVEL), 3), -s.shaping_factor))
    dropped = [f'{s.shaping_factor:g}' for s in shaped if s not in usable]
    why = f' (dropped as unconverged or prior-dominated: {", ".join(dropped)})' if dropped else ''
    miss = abs(best.held_out - LEVEL)
    verdict = (
        ''
        if miss <= NEAR
        else ', near it but not on it'
        if miss <= 2 * NEAR
        else ': far from it, a parameter band is not a predictive one'
    )
    reason = (
        f'of {len(usable)} converged and informative candidates{why} its 95 % GLUE band covers '
        f'held-out samples nearest to its level, {100 * best.held_out:.1f} %{verdict}'
    )  # fmt: skip
    return Choice(best.shaping_factor, reason, miss <= NEAR)
