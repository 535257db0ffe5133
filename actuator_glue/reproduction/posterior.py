"""GLUE posteriors of Eq. (2) on the reconstructed tests, with more residual where asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.dream import Chains, Settings, sample
from actuator_glue.inference.likelihood import Errors, GlueLikelihood
from actuator_glue.inference.moments import Moments, moments
from actuator_glue.model.exact import ExactErrors
from actuator_glue.model.parameters import bounds
from actuator_glue.records import Array, Record

# The sampler the paper cites, as Vrugt (2016) runs it: three chains, from the prior.
AS_PUBLISHED = Settings(chains=3, start='prior', independence=0.0)

Progress = Callable[[float], None]


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
    """

    shaping_factor: float
    added_rms: float
    best_rms: float
    chains: Chains

    @property
    def moments(self) -> Moments:
        """Table 4 for these draws."""
        return moments(self.chains.posterior(), *bounds())

    def thinned(self, size: int) -> Array:
        """Return at most `size` draws spread evenly over the posterior ones, shape (m, 4)."""
        draws = self.chains.posterior()
        return np.asarray(draws[np.linspace(0, len(draws) - 1, min(size, len(draws))).astype(int)])

    def prior_share(self) -> Array:
        """Posterior over prior standard deviation, shape (4,): 1 where the data say nothing."""
        lower, upper = bounds()
        return np.asarray(self.moments.stddev / ((upper - lower) / np.sqrt(12.0)))


def run(
    seed: Sequence[int],
    errors: Errors,
    shaping_factor: float,
    evaluations: int,
    *,
    added_rms: float = 0.0,
    settings: Settings | None = None,
    progress: Progress | None = None,
) -> Posterior:
    """Sample the posterior of Eq. (4) within Table 3's bounds.

    Args:
        seed: words of the seed of this run.
        errors: error sums of the records.
        shaping_factor: G.
        evaluations: likelihood evaluations.
        added_rms: rms of an uncorrelated residual to add [m].
        settings: of the sampler; its defaults where not given.
        progress: called with the share done.
    """
    lower, upper = bounds()
    likelihood = GlueLikelihood(AddedResidual(errors, added_rms), shaping_factor)
    told = None if progress is None else (lambda done, most: progress(done / most))
    chains = sample(
        np.random.default_rng(list(seed)), likelihood, lower, upper,
        evaluations=evaluations, settings=settings, progress=told,
    )  # fmt: skip
    best = float(np.exp(-0.5 * chains.log_density.max() / shaping_factor))
    return Posterior(shaping_factor, added_rms, best, chains)


def altered(records: Sequence[Record], change: Callable[[Record], Array]) -> ExactErrors:
    """Return error sums of records whose measured displacement is replaced by `change`."""
    return ExactErrors([replace(r, measured=change(r)) for r in records])
