"""The third generator: machines as they come, of one to four effects, under spiky channels.

The plant is the second generator's. Here a machine has one to four effects at a time, half of
them with one outside the catalogue; channels have spikes, on the displacement or on both; an
effect may appear in the middle of the first record; commands, stiffnesses, strokes and the part
that is held out are drawn anew for every case.
"""

from __future__ import annotations

import numpy as np
import variant_plant as plant
from case import Case, group
from equivalents import values
from scipy import signal
from sizing import NOISE, Array, base_residual, sized
from variant import draw_plant, noise, shaking, sweep
from variant_effects import SIZES as KNOWN
from variant_effects import UNKNOWN as OTHERS
from variant_effects import Forms, respond

# Effects with a mean response; the others have cases of their own in the other generators.
SIZES = {n: s for n, s in KNOWN.items() if n not in ('quantisation', 'timing-jitter', 'hum')}
UNKNOWN = {n: s for n, s in OTHERS.items() if n != 'sensor-spikes'} | {
    'command-lag': (0.5e-3, 15e-3),
    'command-rate': (0.3, 3.0),
    'loop-lag': (0.5e-3, 8e-3),
    'turbulent-leak': (0.05, 20.0),
}
SENSOR = ('backlash', 'sensor-lag', 'bias', 'drift', 'clock-skew')
STIFFNESSES = ((0.0, 250e3, 250e3), (0.0, 0.0, 0.0), (250e3,) * 3, (100e3, 400e3, 100e3))


def random_motion(rng: np.random.Generator, amplitude: float, last: float) -> Array:
    """A stationary random command from rest, limited to a band [m]."""
    n = int(40.0 * plant.RATE)
    band = [0.1, last * rng.uniform(0.5, 0.9)]
    sos = signal.butter(3, band, 'bandpass', fs=plant.RATE, output='sos')
    u = signal.sosfilt(sos, rng.standard_normal(n)) * np.minimum(1.0, np.arange(n) / 512.0)
    return np.asarray(amplitude * u / np.abs(u).max())


def sine_steps(rng: np.random.Generator, amplitude: float, last: float) -> Array:
    """Eight sines of rising frequency, whole periods of each, about 40 s [m]."""
    parts = []
    for hertz in np.geomspace(0.3, last * rng.uniform(0.7, 1.0), 8):
        count = int(round(hertz * 5.0) / hertz * plant.RATE)
        parts.append(np.sin(2.0 * np.pi * hertz * np.arange(count) / plant.RATE))
    return np.asarray(amplitude * np.concatenate(parts))


def command(rng: np.random.Generator, amplitude: float, last: float) -> Array:
    """Return one command of a laboratory's habit [m]."""
    match int(rng.integers(5)):
        case 0:
            return shaking(rng, amplitude)
        case 1:
            return random_motion(rng, amplitude, last)
        case 2:
            return sine_steps(rng, amplitude, last)
        case _:
            return sweep(rng, amplitude, last, float(rng.choice([30.0, 45.0])))


def spikes(rng: np.random.Generator, n: int, one_sided: bool) -> Array:
    """Impulsive noise: one sample in a hundred is off by up to ten times the noise [m]."""
    size = np.clip(rng.exponential(4.0 * NOISE, n), 0.0, 10.0 * NOISE)
    sign = 1.0 if one_sided else rng.choice([-1.0, 1.0], n)
    return np.where(rng.random(n) < 0.01, sign * size, 0.0)


def effects_of(seed: int) -> tuple[str, tuple[str, ...]]:
    """Return kind and effects of a seed: any ten in a row hold all kinds."""
    rng = np.random.default_rng([seed, 13])
    place = seed % 10
    if place < 2:
        return 'none', ()
    outside = place in (3, 6, 9)
    count = (1, 1, 2, 3)[rng.integers(4)] if outside else (1, 2, 2, 3, 4)[rng.integers(5)]
    names: list[str] = [str(rng.choice(list(UNKNOWN)))] if outside else []
    while len(names) < count:
        name = str(rng.choice(list(SIZES)))
        if all(name not in group(other) for other in names):
            names.append(name)
    kind = 'unknown' if outside else 'single' if count == 1 else 'pair'
    return kind, tuple(names)


def build(seed: int) -> Case:
    """Build one case from its seed alone."""
    rng = np.random.default_rng([seed, 17])
    kind, names = effects_of(seed)
    theta, forms = draw_plant(rng), Forms.draw(rng)
    stiffness = STIFFNESSES[rng.integers(len(STIFFNESSES))]
    amplitude = float(np.exp(rng.uniform(np.log(1e-3), np.log(6e-3))))
    last = float(rng.choice([8.0, 10.0, 12.0])) * min(1.0, (3e-3 / amplitude) ** 0.5)
    inputs = [command(rng, amplitude * scale, last) for scale in (1.0, rng.uniform(0.4, 1.0), 0.9)]
    onset = ('', 0.0)
    if names and names[0] not in SENSOR and rng.random() < 0.15:
        onset = (names[0], float(rng.uniform(0.3, 0.7) * len(inputs[0]) / plant.RATE))

    def left(outputs: list[Array]) -> float:
        return base_residual(theta, inputs, outputs, stiffness, plant.RATE) / NOISE

    def ratio_of(tried: dict[str, float]) -> float:
        outputs = respond(theta, tried, inputs[:2], stiffness, forms, seed, onset)
        return left(outputs) if all(np.isfinite(y).all() for y in outputs) else np.inf

    sizes: dict[str, float] = {}
    shares: dict[str, float] = {}
    if kind == 'none' and rng.random() < 0.5:
        sizes = {'coulomb-friction': min(20.0 / theta[2], 2e-6), 'backlash': 3e-6}
    for name in names:
        target = float(np.exp(rng.uniform(np.log(0.7), np.log(8.0))))
        size, shares[name] = sized((name,), SIZES | UNKNOWN, ratio_of, target)
        sizes |= size
    clean = respond(theta, sizes, inputs, stiffness, forms, seed, onset)
    if 'payload-inertia' in sizes:
        theta = forms.heavy(theta)
    colour, spiky = int(rng.integers(4)), int(rng.integers(4))
    measured, commands = [], []
    for u, y in zip(inputs, clean, strict=True):
        common = spikes(rng, len(u), one_sided=spiky == 3) if spiky > 1 else np.zeros(len(u))
        measured.append(y + noise(rng, len(y), colour) + common)
        commands.append(u + common if spiky == 3 else u)
    return Case(
        seed,
        kind,
        names,
        theta,
        plant.RATE,
        stiffness,
        commands,
        measured,
        clean,
        left(clean),
        float(colour),
        sizes | ({'onset': onset[1]} if onset[0] else {}),
        shares,
        values(sizes, theta, float(np.abs(inputs[0]).max()), forms.sign, forms.form, dry=False),
    )
