"""GLUE posteriors of Eq. (2) on the reconstructed tests, with more residual where asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from studies.chen.library import (
    Array,
    Chains,
    Errors,
    GlueLikelihood,
    Moments,
    SamplerSettings,
    Target,
    bounds,
    moments,
    sample,
)

# The sampler the paper cites, as Vrugt (2016) runs it: three chains, from the prior.
AS_PUBLISHED = SamplerSettings.published()

# Called with the stage and the share of the whole study that is done.
Progress = Callable[[str, float], None]


class AddedResidual:
    """Error sums with a residual added that is uncorrelated with everything simulated.

    Its expectation n rms^2 is added to the sum of squares of each record: what white noise, hum
    or drift does to Eq. (4), without the chance of one realisation.

    Args:
        errors: error sums of the records as they are.
        rms: of the added residual [m].
    """

    def __init__(self, errors: Errors, rms: float) -> None:
        self.errors = errors
        self.rms = rms

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Counted samples of every record, shape (R,)."""
        return self.errors.sizes

    def __call__(self, theta: Array, /) -> Array:
        """Return (sum e, sum e^2) of theta (m, 4) and record, shape (m, R, 2) [m, m^2]."""
        sums = self.errors(theta).copy()
        sums[..., 1] += self.sizes * self.rms**2
        return sums


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """One GLUE posterior.

    Attributes:
        shaping_factor: G of Eq. (4).
        added_rms: rms of the added uncorrelated residual [m].
        best_rms: root of the smallest Var[E] visited [m].
        chains: all draws and their convergence.
        moments: Table 4 for these draws.
    """

    shaping_factor: float
    added_rms: float
    best_rms: float
    chains: Chains
    moments: Moments

    def thinned(self, size: int) -> Array:
        """Return at most `size` draws spread evenly over the posterior ones, shape (m, 4)."""
        draws = self.chains.posterior()
        return np.asarray(draws[np.linspace(0, len(draws) - 1, min(size, len(draws))).astype(int)])

    def prior_share(self) -> Array:
        """Posterior over prior standard deviation, shape (4,): 1 where the data say nothing."""
        lower, upper = bounds()
        return np.asarray(self.moments.stddev / ((upper - lower) / np.sqrt(12.0)))


@dataclass(slots=True)
class Laboratory:
    """Where the study's posteriors are sampled: its seed, and how far its work has come.

    Attributes:
        seed: of the whole study, 0 or more.
        total: likelihood evaluations (or work worth as many) of the whole study.
        progress: called with the stage and the share done.
        stage: what is being done.
        done: evaluations made.
    """

    seed: int
    total: int = 1
    progress: Progress = field(default=lambda stage, share: None)
    stage: str = ''
    done: int = 0

    def enter(self, stage: str) -> None:
        """Tell that a stage begins."""
        self.stage = stage
        self.add(0)

    def add(self, evaluations: int) -> None:
        """Tell that work has been done."""
        self.done += evaluations
        self.progress(self.stage, min(self.done / self.total, 1.0))

    def run(
        self,
        words: Sequence[int],
        errors: Errors,
        shaping_factor: float,
        evaluations: int,
        *,
        added_rms: float = 0.0,
        settings: SamplerSettings | None = None,
    ) -> Posterior:
        """Sample the posterior of Eq. (4) within Table 3's bounds.

        Args:
            words: tell this run's seed from those of the study's other runs.
            errors: error sums of the records.
            shaping_factor: G.
            evaluations: likelihood evaluations.
            added_rms: rms of an uncorrelated residual to add [m].
            settings: of the sampler; its defaults where not given.
        """
        start = self.done

        def tell(done: int, most: int) -> None:
            self.progress(self.stage, min((start + evaluations * done / most) / self.total, 1.0))

        likelihood = GlueLikelihood(AddedResidual(errors, added_rms), shaping_factor)
        chains = sample(
            Target(likelihood, bounds()),
            (self.seed, *words),
            evaluations,
            settings=settings,
            progress=tell,
        )
        self.add(evaluations)
        best = float(np.exp(-0.5 * chains.log_density.max() / shaping_factor))
        found = moments(chains.posterior(), *bounds())
        return Posterior(shaping_factor, added_rms, best, chains, found)
