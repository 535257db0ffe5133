"""One simulated actuator: what `rths` predicts from its pre-tests, what its hybrid test does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Final

import actuator_glue as ag
from studies.hybrid import actuators, library
from studies.hybrid.actuators import EFFECTS, Actuator

# What a laboratory knows: how large its machine is, and what it mounts on the piston.
BOUNDS = {
    'beta_1': (0.0, 1e3),
    'alpha_1_beta_0': (0.0, 2e11),
    'alpha_2': (0.0, 2e7),
    'alpha_3': (0.0, 20.0),
    'gain': (0.9, 1.1),
    'valve_lag': (0.0, 0.01),
    'mass': (28.0, 30.0),
    'mass_damping': (3.0, 5.0),
}
LIKELIHOOD: Final = 'gaussian'
EVALUATIONS = 36_000
DRAWS = 200


@dataclass(frozen=True, slots=True)
class Outcome:
    """One actuator.

    Attributes:
        seed: of the actuator, its pre-tests and its hybrid test.
        predicted: P(unstable) over the posterior and the specimen's spread.
        effective: independent draws that it counts for.
        unstable: whether its own loop has a growing root.
        diverged: share of its tests whose floors left five times the reference's peak.
        inside: share of the floors' response in the predicted 95 % band, mean over its tests that
            did not diverge, as bands are those of such tests; None where there are none.
        error: error of the best draw in the pre-tests, of the spread measured.
        rhat: largest of a parameter.
    """

    seed: int
    predicted: float
    effective: float
    unstable: bool
    diverged: float
    inside: float | None
    error: float | None
    rhat: float

    def to_json(self) -> Mapping[str, object]:
        """Return the fields by name."""
        return asdict(self)


def design() -> dict[str, object]:
    """Return everything that outcomes depend on beside the seed, as JSON values."""
    return {
        'effects': list(EFFECTS),
        'bounds': {name: list(pair) for name, pair in BOUNDS.items()},
        'likelihood': LIKELIHOOD,
        'evaluations': EVALUATIONS,
        'draws': DRAWS,
        'damping': list(actuators.DAMPING),
        'pre_test': [actuators.RATE, actuators.DURATION, actuators.NOISE],
        'record_s': actuators.RECORD,
        'bands': 'order statistics',
        'specimens': actuators.SPECIMENS,
    }


def trial(seed: int) -> Outcome:
    """Calibrate an actuator, predict its hybrid test, run it."""
    actuator = actuators.drawn(seed)
    found = ag.calibrate(
        actuator.records(),
        effects=EFFECTS,
        bounds=BOUNDS,
        likelihood=LIKELIHOOD,
        evaluations=EVALUATIONS,
        seed=library.stream(seed, 'sampler'),
    )
    predicted = predict(actuator, found)
    run = actuator.run()
    return Outcome(
        seed,
        predicted.p_unstable.value,
        predicted.p_unstable.effective_draws,
        actuator.grows(),
        float(run.diverged.mean()),
        inside(run, predicted),
        found.error.nrmse,
        max(p.rhat for p in found.parameters.values()),
    )


def predict(actuator: Actuator, found: ag.Calibration) -> ag.StabilityResult:
    """Return what a calibration says of the actuator's hybrid test."""
    return ag.rths(
        actuator.test,
        found,
        draws=DRAWS,
        ground_motion=actuator.motion,
        seed=library.stream(actuator.seed, 'prediction'),
    )


def inside(run: library.Responses, predicted: ag.StabilityResult) -> float | None:
    """Return the share of the response in the predicted band, over tests that did not diverge.

    None where all of them did, or all that were predicted.
    """
    virtual = predicted.virtual
    assert virtual is not None
    if run.diverged.all() or not virtual.indicators:
        return None
    response = run.response[1:, :, ~run.diverged]  # nothing has moved at the first sample
    lower, upper = virtual.lower[1:, :, None], virtual.upper[1:, :, None]
    return float(((response >= lower) & (response <= upper)).mean())
