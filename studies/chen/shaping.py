"""The shaping factor: chains, convergence, spread and held-out coverage of G_1 ... G_8."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from studies.chen.convergence import evaluations_at, gelman_rubin
from studies.chen.experiment import blocks
from studies.chen.laboratory import AS_PUBLISHED, Laboratory, Posterior
from studies.chen.library import Array, ExactErrors, Record, band
from studies.chen.published import THRESHOLD
from studies.chen.responses import LEVEL, simulate
from studies.chen.scores import coverage

SETTLE = 0.5  # s; ten time constants of the slower test
WIDEST = 0.5  # posterior over prior standard deviation
NEAR = 0.03  # coverage this near to the level counts as covering
STRICT = 1.05  # rank-normalised R-hat of the runs that carry results


@dataclass(frozen=True, slots=True, eq=False)
class ConvergenceTrace:
    """R-hat of one run against its likelihood evaluations.

    Attributes:
        evaluations: shape (c,).
        rhat: Gelman-Rubin of each parameter over the last half of the chains, shape (c, 4).
    """

    evaluations: Array
    rhat: Array

    @classmethod
    def of(cls, posterior: Posterior, points: int = 60) -> ConvergenceTrace:
        """Return R-hat at lengths of a run that grow by equal factors."""
        draws = posterior.chains.draws
        lengths = np.unique(np.geomspace(min(20, len(draws)), len(draws), points).astype(int))
        return cls(
            np.array([evaluations_at(posterior.chains, n - 1) for n in lengths], dtype=float),
            np.array([gelman_rubin(draws[:n]) for n in lengths]),
        )

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
    published_trace: ConvergenceTrace
    ours: Posterior
    ours_trace: ConvergenceTrace
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
    """The shaping factor chosen automatically.

    Attributes:
        shaping_factor: G.
        held_out: share of held-out samples inside its 95 % GLUE band.
        usable: candidates that converged and are narrower than half their prior; 0 where none
            was and the largest G stands in.
        dropped: shaping factors of the other candidates.
    """

    shaping_factor: float
    held_out: float
    usable: int
    dropped: tuple[float, ...]

    @property
    def covers(self) -> bool:
        """Whether its GLUE band covers held-out samples within `NEAR` of its level."""
        return self.usable > 0 and abs(self.held_out - LEVEL) <= NEAR


def study(
    laboratory: Laboratory,
    records: Sequence[Record],
    shaping_factors: Sequence[float],
    evaluations: tuple[int, int],
    *,
    added_rms: float,
    draws: int,
) -> list[Shaped]:
    """Sample every shaping factor three times: as published, ours, and ours on fit blocks only.

    Args:
        laboratory: where to sample.
        records: both tests.
        shaping_factors: G.
        evaluations: of each of our runs, and of each run as published.
        added_rms: uncorrelated residual added to the records [m].
        draws: parameter draws per band.
    """
    whole = ExactErrors(records)
    fit = [r.slice(part.start, part.stop) for r in records for part in blocks(r)[0]]
    kept = ExactErrors(fit, round(SETTLE / records[0].period), initial='measured')
    word, found = round(added_rms * 1e9), []
    for i, factor in enumerate(shaping_factors):
        published = laboratory.run(
            (50, i, word),
            whole,
            factor,
            evaluations[1],
            added_rms=added_rms,
            settings=AS_PUBLISHED,
        )
        ours = laboratory.run((51, i, word), whole, factor, evaluations[0], added_rms=added_rms)
        part = laboratory.run((52, i, word), kept, factor, evaluations[0], added_rms=added_rms)
        inside, width = _held_out(part.thinned(draws), records, added_rms)
        found.append(
            Shaped(
                factor,
                published,
                ConvergenceTrace.of(published),
                ours,
                ConvergenceTrace.of(ours),
                inside,
                width,
            )
        )
    return found


def _held_out(theta: Array, records: Sequence[Record], added_rms: float) -> tuple[float, float]:
    columns = []
    for record in records:
        lower, upper = band(simulate(theta, record), [LEVEL]).at(LEVEL)
        columns.append(np.stack([record.measured, lower, upper])[:, blocks(record)[1]])
    measured, lower, upper = np.concatenate(columns, axis=1)
    return expected_coverage(measured, lower, upper, added_rms), float(np.mean(upper - lower))


def expected_coverage(measured: Array, lower: Array, upper: Array, added_rms: float) -> float:
    """Return the share of samples (n,) inside a band that hold an added residual.

    The likelihood was told of the residual, so the samples counted must hold it too. As there,
    its expectation is taken, not one realisation: each sample counts by the probability that it
    lies inside once a normal residual is added.

    Args:
        measured: samples without the residual [m].
        lower: lower limits of the band [m].
        upper: upper limits [m].
        added_rms: rms of the added residual [m]; with 0 this is the plain coverage.
    """
    if not added_rms > 0.0:
        return coverage(measured, lower, upper)
    below, above = (norm.cdf((edge - measured) / added_rms) for edge in (lower, upper))
    return float(np.mean(above - below))


def choose(shaped: Sequence[Shaped]) -> Choice:
    """Choose a shaping factor: converged, informative, held-out coverage nearest to nominal.

    Of two equally near, the larger G (the narrower band).

    Args:
        shaped: from `study`, in any order.
    """
    usable = [s for s in shaped if s.converged and s.informative]
    dropped = tuple(s.shaping_factor for s in shaped if s not in usable)
    best = (
        min(usable, key=lambda s: (round(abs(s.held_out - LEVEL), 3), -s.shaping_factor))
        if usable
        else max(shaped, key=lambda s: s.shaping_factor)
    )
    return Choice(best.shaping_factor, best.held_out, len(usable), dropped)
