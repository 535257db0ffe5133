"""Simulation: what the sensors of a servo-hydraulic actuator show under a command."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.api.given import seed_given
from actuator_glue.errors import InputError
from actuator_glue.given import names, number, of_kind, one_of, take_numbers, vector
from actuator_glue.model import benchmark_plant, commands
from actuator_glue.model.effects import scale
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.plant import MeasuredPlant, Plant
from actuator_glue.model.sensor import SensorSpec
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Hold, Record, check_stiffness

BLOCK = 4096  # samples simulated at a time
STIFFNESS = 250e3  # N/m, of the specimen of the paper
NOISE = 1e-5  # m, of the displacement sensor where nothing else is asked for
EFFECTS_FORM = 'effects are written NAME, or NAME:PARAMETER=VALUE,PARAMETER=VALUE, joined by +'
SHAPES = ('sweep', 'sine', 'noise', 'earthquake')

Effects = Mapping[str, Mapping[str, float]] | Sequence[str]


@dataclass(frozen=True, slots=True)
class Command:
    """A commanded displacement by its shape.

    Attributes:
        shape: 'sweep', 'sine', 'noise' or 'earthquake'.
        rate: sample rate [Hz].
        duration: length [s].
        amplitude: peak [m].
        low: lowest frequency of sweep and noise [Hz]; None for 0 and 0.1.
        high: highest frequency of sweep and noise, frequency of a sine [Hz].
        seed: seed of noise and earthquake.
    """

    shape: Literal['sweep', 'sine', 'noise', 'earthquake'] = 'sweep'
    rate: float = 1000.0
    duration: float = 60.0
    amplitude: float = 2e-3
    low: float | None = None
    high: float = 10.0
    seed: int = 0

    def __post_init__(self) -> None:
        take_numbers(self)

    def samples(self) -> Array:
        """Return the samples, shape (n,) [m].

        Raises:
            InputError: a value that cannot be used.
        """
        if self.seed < 0:
            raise InputError(f'seed {self.seed} is negative')
        one_of(self.shape, 'command', SHAPES)
        rate, duration, peak = self.rate, self.duration, self.amplitude
        if self.shape == 'sweep':
            return commands.sweep(rate, duration, self.low or 0.0, self.high, peak)
        if self.shape == 'sine':
            return commands.sine(rate, duration, self.high, peak)
        if self.shape == 'noise':
            low = 0.1 if self.low is None else self.low
            return commands.noise(rate, duration, low, self.high, peak, self.seed)
        return commands.earthquake(rate, duration, peak, self.seed)


@dataclass(frozen=True, slots=True)
class Sensors:
    """Noise and resolution of the channels.

    Attributes:
        noise: of the displacement, standard deviation [m]; None for the plant's own (0.01 mm).
        force_noise: of the force, standard deviation [N].
        bits: resolution of both converters over twice the command; None for none.
    """

    noise: float | None = None
    force_noise: float = 2.0
    bits: int | None = None

    def __post_init__(self) -> None:
        take_numbers(self)


def simulate(
    command: Command | Record | None = None,
    *,
    stiffness: float = 0.0,
    theta: ArrayLike | None = None,
    effects: Effects = (),
    sensors: Sensors | None = None,
    plant: Literal['paper', 'benchmark'] = 'paper',
    hold: Hold = 'zoh',
    seed: int | tuple[int, int] | None = 1,
) -> Record:
    """Simulate one test.

    Args:
        command: a shape, or a record whose command is used; None for a sweep to 10 Hz in 60 s.
        stiffness: specimen stiffness k [N/m].
        theta: beta_1, alpha_1_beta_0, alpha_2, alpha_3, shape (4,), SI units; None for Table 2.
        effects: effects of the catalogue that the plant has: names, or parameters by name; those
            not given have typical sizes.
        sensors: noise and resolution of the channels.
        plant: 'paper' is Eq. (2); 'benchmark' the transfer system of the RTHS benchmark (Silva
            et al. 2020), which has its own specimen.
        hold: how the command runs between its samples.
        seed: seed of the noise; a pair (seed, number of the test) for one of several tests; None
            for a fresh one, which the record's source says.

    Returns:
        Command, measured displacement and force.

    Raises:
        InputError: an argument that cannot be used.

    Example:
        >>> record = simulate(stiffness=250e3, effects=['backlash'])  # doctest: +SKIP
    """
    shape = Command() if command is None else command
    samples = samples_of(shape)
    rate = shape.rate
    sensors = Sensors() if sensors is None else sensors
    of_kind(sensors, 'sensors', Sensors, 'Sensors of a simulation')
    one_of(plant, 'plant', ('paper', 'benchmark'))
    one_of(hold, 'hold', ('zoh', 'linear'))
    words = seed if isinstance(seed, tuple) else (seed_given(seed), 0)
    sequence = np.random.SeedSequence(tuple(seed_given(word) for word in words))
    draw = int(sequence.generate_state(1)[0])
    known, sent = check_stiffness(stiffness), samples
    if plant == 'benchmark':
        if effects or theta is not None or known:
            raise InputError(
                'the benchmark plant has its own specimen and parameters: it takes no theta, no '
                'effects and no stiffness'
            )
        known = benchmark_plant.BenchmarkParameters().stiffness
        moved = _benchmark(rate, hold, draw, sensors)
    else:
        structure, values, sent = _early(*sizes(effects, theta), samples, 1.0 / rate)
        moving = Stream(
            structure,
            values,
            stiffness=known,
            period=1.0 / rate,
            hold=hold,
            rng=np.random.default_rng((draw, 1)),
        )
        span = 2.0 * float(np.abs(samples).max()) or 1e-3
        noise = NOISE if sensors.noise is None else sensors.noise
        moved = MeasuredPlant(
            moving,
            SensorSpec(noise, sensors.bits, span),
            SensorSpec(sensors.force_noise, sensors.bits, max(2.0 * known * span, 1e3)),
            draw,
        )
    measured, force = np.empty(len(samples)), np.empty(len(samples))
    for start in range(0, len(samples), BLOCK):
        part = slice(start, min(start + BLOCK, len(samples)))
        measured[part], force[part] = moved.step(sent[part])
    return Record(
        samples,
        measured,
        1.0 / rate,
        known,
        force,
        hold=hold,
        actuator='simulated',
        source='simulated' if seed is not None else f'simulated with seed {words[0]}',
    )


def _early(
    structure: Structure, values: Array, samples: Array, period: float
) -> tuple[Structure, Array, Array]:
    """Return a plant that leads its command as one that is late for a command sent before.

    A stream cannot run ahead of its command; of a whole command each sample is known before.
    """
    known = dict(zip(structure.names, values.tolist(), strict=True))
    if 'lead' not in known:
        return structure, values, samples
    lead = known.pop('lead')
    count = math.ceil(lead / period)
    known['delay'] = known.get('delay', 0.0) + count * period - lead
    late = Structure({'delay', *structure.effects} - {'lead'})
    sent = np.concatenate([samples[count:], np.full(count, samples[-1])])[: len(samples)]
    return late, np.array([known[name] for name in late.names]), sent


def samples_of(command: Command | Record) -> Array:
    """Return the samples of a shape, or the command of a record, shape (n,) [m].

    Raises:
        InputError: a shape that cannot be made, or a record that moves in another unit.
    """
    of_kind(command, 'command', (Command, Record), 'a Command, or a record whose command is used')
    return commands.in_metres(command) if isinstance(command, Record) else command.samples()


def _benchmark(rate: float, hold: Hold, seed: int, sensors: Sensors) -> Plant:
    usual = Sensors()
    if (sensors.force_noise, sensors.bits) != (usual.force_noise, usual.bits):
        raise InputError(
            'the benchmark plant has its own force sensor and converters: of the sensors it takes '
            'the noise of the displacement alone'
        )
    spec = benchmark_plant.DISPLACEMENT_SENSOR
    if sensors.noise is not None:
        spec = replace(spec, noise=sensors.noise)
    return benchmark_plant.benchmark_plant(
        period=1.0 / rate, hold=hold, seed=seed, displacement=spec
    )


def named_effects(text: str) -> dict[str, dict[str, float]]:
    """Return the effects of a text in EFFECTS_FORM, and the parameters it gives of each.

    Raises:
        InputError: unknown effect or parameter, or a value that is no number.
    """
    found: dict[str, dict[str, float]] = {}
    for part in filter(None, (piece.strip() for piece in text.split('+'))):
        name, _, given = (piece.strip() for piece in part.partition(':'))
        (entry,) = Structure((name,)).entries
        known = [p.name for p in entry.parameters]
        values = found[name] = {}
        for pair in filter(None, given.split(',')):
            key, _, value = (piece.strip() for piece in pair.partition('='))
            try:
                values[key] = float(value)
            except ValueError:
                raise InputError(
                    f'effect {name}: {pair!r} is no PARAMETER=VALUE; {EFFECTS_FORM}'
                ) from None
            if key not in known:
                raise InputError(
                    f'effect {name} has no parameter {key!r}; it has {", ".join(known)}'
                )
    return found


def sizes(effects: Effects = (), theta: ArrayLike | None = None) -> tuple[Structure, Array]:
    """Return a plant's structure and its parameters (p,), typical sizes where none are given.

    Typical is what suits the test that is made where nothing else is asked for, with the specimen
    of the paper: an effect has one size, whatever the command and the specimen of a test are.

    Args:
        effects: names of the catalogue, or parameters by name.
        theta: parameters of Eq. (2), shape (4,); None for Table 2.

    Raises:
        InputError: unknown effect or parameter, or a value outside the catalogue's bounds.
    """
    asked: dict[str, Mapping[str, float]] = (
        dict(effects)
        if isinstance(effects, Mapping)
        else {name: {} for name in names(effects, 'effects')}
    )
    for name, given in asked.items():
        if not isinstance(given, Mapping):
            raise InputError(
                f'effect {name}: sizes are given by parameter, as in '
                f'effects={{{name!r}: {{PARAMETER: VALUE}}}}, not as {given!r:.60}'
            )
    structure = Structure(tuple(asked))
    base = TABLE_2 if theta is None else vector(theta, 'theta')
    if base.shape != (4,):
        raise InputError(f'theta has shape {base.shape}; Eq. (2) has four parameters')
    values = structure.neutral(base)
    usual = Command()
    command = usual.samples()
    test = scale([Record(command, command, 1.0 / usual.rate, STIFFNESS)], base)
    for entry in structure.entries:
        columns = structure.columns(entry.name)
        starts = list(entry.starts(test))
        values[columns] = starts[len(starts) // 2]
        known = {p.name: (i, p) for i, p in enumerate(entry.parameters)}
        for name, value in asked[entry.name].items():
            if name not in known:
                raise InputError(
                    f'effect {entry.name} has no parameter {name!r}; it has {", ".join(known)}'
                )
            at, parameter = known[name]
            value = number(value, f'effect {entry.name}: {name}')
            if not parameter.lower <= value <= parameter.upper:
                raise InputError(
                    f'effect {entry.name}: {name} = {value:g} {parameter.unit} is outside '
                    f'the bounds of the catalogue, [{parameter.lower:g}, {parameter.upper:g}] '
                    f'{parameter.unit}; give it in SI units'
                )
            values[columns.start + at] = value
    return structure, values
