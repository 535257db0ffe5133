"""Simulated actuators: their pre-tests, and the hybrid test that each one truly runs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import actuator_glue as ag
from studies.hybrid import library

STATIC_GAIN = 1.0261  # of the benchmark's plant
EFFECTS = ('gain', 'valve-lag', 'payload-inertia')  # with these Eq. (2) is that plant
DAMPING = (0.067, 0.087)  # of the structures: from mostly unstable to mostly stable
RATE, DURATION = 128.0, 8.0  # of a pre-test [Hz, s]
NOISE = 16e-6  # of the displacement sensor, standard deviation [m]
RECORD = 10.0  # s, of the ground motion
SPECIMENS = 32  # that each actuator is run with; its own is the first
NONE = library.Compensator('none', np.array([1.0, 0.0, 0.0]))


@dataclass(frozen=True, eq=False)
class Actuator:
    """What a study knows and a laboratory does not.

    Attributes:
        seed: of all its noise and its ground motion.
        theta: parameters, (p,), SI units.
        effects: beyond Eq. (2).
        specimen: mass, damping, stiffness, (m,) each: its own first, then others of the same
            spread that it is run with, too.
        test: the hybrid test as the laboratory knows it.
    """

    seed: int
    theta: np.ndarray
    effects: tuple[str, ...]
    specimen: dict[str, np.ndarray]
    test: ag.Partition

    def records(self, rate: float = RATE, duration: float = DURATION) -> list[ag.Record]:
        """Return two noisy tests to 10 Hz [Hz, s]: piston free, and against a known spring."""
        structure = library.Structure(self.effects)
        effects = {
            e.name: {p.name: self.theta[structure.names.index(p.name)] for p in e.parameters}
            for e in structure.entries
        }
        command = ag.Command('noise', rate=rate, duration=duration, high=10.0, seed=self.seed)
        return [
            ag.simulate(
                command,
                stiffness=k,
                theta=self.theta[:4],
                effects=effects,
                sensors=library.Sensors(noise=NOISE),
                seed=(self.seed, i),
            )
            for i, k in enumerate((0.0, self.test.specimen.stiffness))
        ]

    @property
    def motion(self) -> library.GroundMotion:
        """Its ground motion."""
        return library.artificial(self.seed, RECORD)

    def grows(self) -> bool:
        """Whether its own loop has a growing root; its linear effects only."""
        names = library.Structure(self.effects).names
        first = {name: values[:1] for name, values in self.specimen.items()}
        own = library.Loop.of(self.test, self.theta[None], names, self.effects, first)
        root = library.growth(own.numerical, own.plants, NONE.coefficients, self.test.period)
        return bool(root[0] > 0.0)

    def run(self) -> library.Responses:
        """Return what its hybrid test does with each specimen, uncompensated."""
        return library.VirtualTest(
            self.test,
            np.repeat(self.theta[None], len(self.specimen['mass']), axis=0),
            library.Structure(self.effects).names,
            self.effects,
            self.specimen,
            NONE,
            self.motion.at(self.test.period),
            library.stream(self.seed, 'sensors'),
        ).run(0)


def drawn(seed: int) -> Actuator:
    """Return an actuator of the benchmark's spread in a structure with a damping of its own."""
    p = library.BenchmarkParameters().drawn(
        np.random.default_rng(library.stream(seed, 'actuator'))
    )
    ratio = np.random.default_rng(library.stream(seed, 'structure')).uniform(*DAMPING)
    test = damped(ratio)
    rng = np.random.default_rng(library.stream(seed, 'specimens'))
    specimen = test.specimen.drawn(rng, SPECIMENS)
    for name in specimen:
        specimen[name][0] = getattr(p, name)
    return Actuator(seed, plant(p), EFFECTS, specimen, test)


def plant(p: library.BenchmarkParameters) -> np.ndarray:
    """Return the benchmark's transfer system as parameters of Eq. (2) with EFFECTS."""
    structure = library.Structure(EFFECTS)
    theta = structure.neutral(np.array([p.beta2 / p.beta1, p.a1_beta0 / p.beta1, p.a2, p.a3]))
    values = {'gain': STATIC_GAIN, 'valve_lag': 1.0 / p.beta1, 'mass': p.mass}
    values['mass_damping'] = p.damping / p.mass
    for name, value in values.items():
        theta[structure.names.index(name)] = value
    return theta


def damped(ratio: float) -> ag.Partition:
    """Return the benchmark's first case with another damping ratio in every mode."""
    base = library.read_partition('benchmark_case_1')
    M, _, K = base.whole
    C = library.modal_damping(M, K, ratio)
    C[base.interface, base.interface] -= base.specimen.damping
    return replace(base, damping=C)
