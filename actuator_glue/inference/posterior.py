"""Records, model and likelihood to a posterior: the one place that puts them together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.inference import dream
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.inference.compiled import Compiled, compiled
from actuator_glue.inference.evaluate import LogDensity
from actuator_glue.inference.informative_prior import InformativePrior, informative_prior
from actuator_glue.inference.likelihood import (
    Ar1Likelihood,
    ForceLikelihood,
    GaussianLikelihood,
    GlueLikelihood,
)
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.transforms import Composed, Transform
from actuator_glue.inference.transforms.inverse_response import Ridge
from actuator_glue.inference.transforms.triangular import Triangular
from actuator_glue.model.exact import Initial
from actuator_glue.model.fast import FastErrors
from actuator_glue.model.force_errors import ForceErrors
from actuator_glue.model.structure import Structure
from actuator_glue.model.structure_errors import StructureErrors
from actuator_glue.records import Array, Record

Likelihood: TypeAlias = Literal['glue', 'gaussian', 'ar1']

# Points per parameter that can show a bend.
_ENOUGH = 20
# Steps after burn-in from which R-hat can be computed.
_FEWEST = 4
# Points of the prior that a start without an earlier posterior is fitted to.
_PRIOR = 2000


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """A log likelihood, its prior, and the coordinates in which it is sampled.

    Attributes:
        log_likelihood: of physical parameters, (m, p) -> (m,).
        bounds: lower and upper bounds of the parameters, (p,) each.
        transform: from the parameters to the coordinates; None: they are their own.
        prior: what is known beside the bounds; None: the prior is uniform.
    """

    log_likelihood: LogDensity
    bounds: tuple[Array, Array]
    transform: Transform | None = None
    prior: InformativePrior | None = None

    def density(self) -> LogDensity:
        """Return the log posterior density (m,) of coordinates (m, p), up to a constant."""
        assert self.transform is not None
        return _Density(self.log_likelihood, self.transform, self.prior)


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Records under a model: what a posterior is asked of.

    Attributes:
        records: the tests, each with its stiffness.
        model: the model and the prior's box.
        likelihood: 'glue' is Eq. (4); 'gaussian' and 'ar1' are formal ones. 'ar1' wants a model
            `with_autocorrelation`.
        shaping_factor: G of Eq. (4).
        initial: state at each record's first sample.
        settle: uncounted start of each record [s].
        first_index: samples of the test before the records: drifts count from the start of the
            test.
        near: parameters (p,) near the best fit, where known; they save time and change nothing.
        shown: parameters (m, p) of an earlier posterior of this model, which straighten the
            coordinates.
        prior: draws of what is known of the parameters; None: no more than the box.
        force: G of the measured force; None where it is no evidence.
    """

    records: Sequence[Record]
    model: ModelChoice
    likelihood: Likelihood = 'glue'
    shaping_factor: float = 256.0
    initial: Initial = 'rest'
    settle: float = 0.0
    first_index: int = 0
    near: Array | None = None
    shown: Array | None = None
    prior: Carried | None = None
    force: float | None = None

    def target(self) -> Target:
        """Return the log likelihood with its prior and the coordinates to sample it in.

        Raises:
            InputError: records or settings that cannot be used.
        """
        return Target(
            self._log_likelihood(), self.model.bounds, self._transform(), self._informative()
        )

    def _log_likelihood(self) -> LogDensity:
        counts = [round(self.settle / r.period) for r in self.records]
        displacement = self._displacement(counts)
        if self.force is None:
            return displacement
        origin = self.first_index * self.records[0].period
        structure = Structure(self.model.effects)
        errors = ForceErrors(structure, self.records, counts, self.initial, origin)
        return ForceLikelihood(displacement, errors, self.force)

    def _displacement(self, counts: Sequence[int]) -> LogDensity:
        effects, initial = self.model.effects, self.initial
        if self.likelihood == 'ar1' or effects:
            origin = self.first_index * self.records[0].period
            errors = StructureErrors(Structure(effects), self.records, counts, initial, origin)
            if self.likelihood == 'ar1':
                return Ar1Likelihood(errors)
        sums = errors if effects else FastErrors(self.records, counts, initial, near=self.near)
        if self.likelihood == 'glue':
            return GlueLikelihood(sums, self.shaping_factor)
        return GaussianLikelihood(sums)

    def _informative(self) -> InformativePrior | None:
        if self.prior is None:
            return None
        model = self.model
        return informative_prior(
            self.prior, model.names, model.lower, model.upper, self._stiffness()
        )

    def _stiffness(self) -> float | None:
        """Return the one specimen stiffness of the records [N/m]; None where they have several."""
        stiffnesses = {r.known_stiffness() for r in self.records}
        return stiffnesses.pop() if len(stiffnesses) == 1 else None

    def _transform(self) -> Transform | None:
        """Coordinates for the bent ridge that one stiffness leaves; None for several."""
        stiffness = self._stiffness()
        if stiffness is None:
            return None
        record, names = self.records[0], self.model.names
        middle = (self.first_index + 0.5 * len(record)) * record.period
        ridge = Ridge(names, *self.model.bounds, stiffness, middle)
        few = self.shown is None or len(self.shown) < _ENOUGH * len(names)
        if few or not self.model.effects:
            return ridge
        assert self.shown is not None
        return Composed(ridge, Triangular(ridge.forward(self.shown)))


class NoPosteriorError(InputError):
    """A run was over before it had draws of the posterior."""


def sample(
    target: Target,
    seed: Sequence[int],
    evaluations: int,
    *,
    settings: SamplerSettings | None = None,
    archive: Array | None = None,
    stop: Callable[[dream.State], bool] | None = None,
    enough: Callable[[Chains], bool] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Chains:
    """Draw from a posterior; return chains of physical parameters with their log likelihoods.

    With an informative prior its log density is part of them. A sampler that starts from the prior
    as published moves in the physical parameters, whatever coordinates the target has.

    Args:
        target: what is sampled.
        seed: words of the seed: equal ones give equal bits.
        evaluations: likelihood evaluations at most, the search for the start included.
        settings: of the sampler.
        archive: points (m, p) of an earlier run, in coordinates, to start from.
        stop: see `dream.sample`.
        enough: see `dream.sample`; asked of chains of coordinates.
        progress: see `dream.sample`.

    Raises:
        InputError: see `dream.sample`.
        NoPosteriorError: the run ended before it had draws of the posterior.
    """
    settings = settings or SamplerSettings()
    density, bounds, published = target.log_likelihood, target.bounds, settings.start == 'prior'
    transform = None if published else target.transform
    if transform is not None:
        if archive is None:
            settings, archive = _cold(target, transform, seed, settings)
        density = target.density()
        bounds = transform.lower, transform.upper
    elif target.prior is not None:
        density = _Informed(density, target.prior)
        if archive is None and not published:
            settings, archive = _cold(target, None, seed, settings)
    chains = dream.sample(
        np.random.default_rng(seed),
        density,
        *bounds,
        evaluations=evaluations,
        settings=settings,
        archive=archive,
        watch=dream.Watchers(stop, enough, progress),
    )
    if len(chains.kept) < _FEWEST:
        raise NoPosteriorError(
            f'the run ended after {len(chains.draws)} steps, of which {chains.burn} are burn-in: '
            'no posterior was reached; give it more time or evaluations'
        )
    return chains if transform is None else _physical(chains, transform)


def _cold(
    target: Target, transform: Transform | None, seed: Sequence[int], settings: SamplerSettings
) -> tuple[SamplerSettings, Array]:
    """Return what starts the sampler from the prior: settings, and an archive of points.

    The sampler's own start is uniform in the coordinates, where corners of the prior's box loom
    large: one start in four was lost to a hill 50 nats below.
    """
    low, high = target.bounds
    if target.prior is None:
        points = np.random.default_rng((*seed, 3)).uniform(low, high, (_PRIOR, len(low)))
    else:
        points = target.prior.points(target.bounds, _PRIOR, (*seed, 3))
    # From an archive the sampler takes a quarter of its population.
    population = 4 * settings.points(len(low))
    points = points if transform is None else transform.forward(points)
    return replace(settings, population=population), points


def _physical(chains: Chains, transform: Transform) -> Chains:
    """Return chains of coordinates as chains of physical parameters with log likelihoods."""
    shape = chains.draws.shape
    draws, log_jacobian = transform.inverse(chains.draws.reshape(-1, shape[2]))
    return replace(
        chains,
        draws=draws.reshape(shape),
        log_density=chains.log_density - log_jacobian.reshape(shape[:2]),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Density:
    """Log likelihood of the physical parameters plus ln |dx/dz|, and a prior that informs."""

    log_likelihood: LogDensity
    transform: Transform
    prior: InformativePrior | None = None

    def __call__(self, z: Array) -> Array:
        """Return the log posterior density (m,) of coordinates (m, p)."""
        x, values = self.transform.inverse(z)
        # Outside the prior's box the likelihood may be slow, and is not needed.
        inside = np.isfinite(values)
        if self.prior is not None and inside.any():
            values[inside] += self.prior.log_density(x[inside])
            inside = np.isfinite(values)
        if inside.all():
            values += self.log_likelihood(x)
        elif inside.any():
            values[inside] += self.log_likelihood(np.ascontiguousarray(x[inside]))
        return values

    def compiled(self) -> Compiled | None:
        """Return the same as plain arrays, where likelihood and coordinates have such a form."""
        form = compiled(self.log_likelihood)
        if form is None or not isinstance(self.transform, Ridge):
            return None
        form = self.transform.compiled(form)
        if form is None or self.prior is None:
            return form
        # The same coordinates: their Jacobians cancel.
        same = isinstance(self.prior.transform, Ridge)
        return form._replace(prior=self.prior.mixture) if same else None


@dataclass(frozen=True, slots=True, eq=False)
class _Informed:
    """Log likelihood plus log prior density of the physical parameters."""

    log_likelihood: LogDensity
    prior: InformativePrior

    def __call__(self, x: Array) -> Array:
        """Return the log posterior density (m,) of parameters (m, p)."""
        return self.prior.log_density(x) + self.log_likelihood(x)
