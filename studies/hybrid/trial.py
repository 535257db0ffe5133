"""One simulated actuator: its pre-tests, what `rths` predicts, what its own hybrid test does."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import actuator_glue as ag
from studies.hybrid import library

STATIC_GAIN = 1.0261  # of the benchmark's plant
EFFECTS = ('gain', 'valve-lag', 'payload-inertia')  # with these Eq. (2) is that plant
# What is calibrated: a second-order model with a delay, as a laboratory would.
MODEL = ('gain', 'delay')
BOUNDS = {'alpha_1_beta_0': (0.0, 2e11), 'alpha_2': (0.0, 5e7), 'beta_1': (0.0, 2e3)}
DAMPING = (0.066, 0.088)  # of the structures: from mostly unstable to mostly stable
RATE, DURATION = 256.0, 10.0  # of a pre-test [Hz, s]
EVALUATIONS = 60_000
DRAWS = 200
RECORD = 12.0  # s, of the ground motion


@dataclass(frozen=True, slots=True)
class Outcome:
    """One actuator.

    Attributes:
        seed: of the actuator, its pre-tests and its hybrid test.
        predicted: P(unstable) over the posterior and the specimen's spread.
        unstable: whether its own loop has a growing root.
        inside: share of its own floors' response that lies in the predicted 95 % band.
        error: error of the best draw in the pre-tests, of the spread measured.
    """

    seed: int
    predicted: float
    unstable: bool
    inside: float
    error: float


def truth(seed: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return an actuator of the benchmark's spread, (1, p), and its specimen."""
    p = library.BenchmarkParameters().drawn(np.random.default_rng((seed, 0)))
    structure = library.Structure(EFFECTS)
    theta = structure.neutral(np.array([p.beta2 / p.beta1, p.a1_beta0 / p.beta1, p.a2, p.a3]))
    values = {'gain': STATIC_GAIN, 'valve_lag': 1.0 / p.beta1, 'mass': p.mass}
    values['mass_damping'] = p.damping / p.mass
    for name, value in values.items():
        theta[structure.names.index(name)] = value
    specimen = {'mass': p.mass, 'damping': p.damping, 'stiffness': p.stiffness}
    return theta[None], {name: np.array([value]) for name, value in specimen.items()}


def partition(seed: int) -> ag.Partition:
    """Return the benchmark's structure with a damping of its own."""
    base = library.read_partition('benchmark_case_1')
    M, _, K = base.whole
    ratio = np.random.default_rng((seed, 1)).uniform(*DAMPING)
    C = library.modal_damping(M, K, ratio)
    C[base.interface, base.interface] -= base.specimen.damping
    return replace(base, damping=C)


def pre_tests(theta: np.ndarray, stiffness: float, seed: int) -> list[ag.Record]:
    """Return two noisy tests to 10 Hz, the piston free and against a spring of known stiffness."""
    names = library.Structure(EFFECTS).names
    values = dict(zip(names, theta, strict=True))
    effects = {
        'gain': {'gain': values['gain']},
        'valve-lag': {'valve_lag': values['valve_lag']},
        'payload-inertia': {'mass': values['mass'], 'mass_damping': values['mass_damping']},
    }
    command = ag.Command('noise', rate=RATE, duration=DURATION, high=10.0, seed=seed)
    return [
        ag.simulate(
            command,
            stiffness=k,
            theta=theta[:4],
            effects=effects,
            sensors=library.Sensors(noise=16e-6),
            seed=(seed, i),
        )
        for i, k in enumerate((0.0, stiffness))
    ]


def trial(seed: int) -> Outcome:
    """Calibrate an actuator, predict its hybrid test, run it."""
    theta, specimen = truth(seed)
    test = partition(seed)
    records = pre_tests(theta[0], test.specimen.stiffness, seed)
    found = ag.calibrate(
        records,
        effects=MODEL,
        bounds=BOUNDS,
        likelihood='ar1',
        evaluations=EVALUATIONS,
        seed=seed,
    )
    motion = library.artificial(seed, RECORD)
    predicted = ag.rths(test, found, draws=DRAWS, ground_motion=motion, seed=seed)
    assert predicted.virtual is not None

    names = library.Structure(EFFECTS).names
    own = library.Loop.of(test, theta, names, EFFECTS, specimen)
    none = library.Compensator('none', np.array([1.0, 0.0, 0.0]))
    root = library.growth(own.numerical, own.plants, none.coefficients, test.period)
    ground = motion.at(test.period)
    run = library.VirtualTest(test, theta, names, EFFECTS, specimen, none, ground, seed).run(0)
    response, virtual = run.response[..., 0], predicted.virtual
    moves = np.abs(response).max(axis=1) > 0.0
    inside = (response >= virtual.lower) & (response <= virtual.upper)
    share = found.error.nrmse
    return Outcome(
        seed,
        predicted.p_unstable.value,
        bool(root[0] > 0.0),
        float(inside[moves].mean()),
        float('nan') if share is None else share,
    )
