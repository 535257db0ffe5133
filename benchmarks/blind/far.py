"""The fourth generator: machines and tests far from the usual ones, with the model's own effects.

Natural frequencies from 2.4 to 40 Hz, strokes from 0.02 to 50 mm, 100 to 2048 samples a second,
sweeps, stairs, steps, ramps, triangles, shaking and random commands, softer and stiffer specimens.
What the other generators test, other ways to write an effect, this one does not: plant and effects
are simulated by the package. It asks whether anything is tuned to one machine's scales.
"""

from __future__ import annotations

import numpy as np
from case import Case
from sizing import Array, base_residual

from actuator_glue.api.simulation import Command
from actuator_glue.model.effects import CATALOGUE, scale
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATES = (100.0, 200.0, 256.0, 500.0, 1000.0, 2048.0)  # Hz
DURATIONS = (12.0, 30.0, 60.0, 120.0)  # s
SHAPES = ('sweep', 'down', 'stairs', 'steps', 'random', 'triangle', 'shaking', 'ramps')
SHARES = (0.0, 0.1, 0.5)  # of the oil's stiffness, that of the specimen


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a size whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def command(rng: np.random.Generator, rate: float, duration: float, last: float) -> Array:
    """Draw a command to `last` Hz, (n,), its largest value 1."""
    n, seed = int(duration * rate), int(rng.integers(1_000_000))
    t = np.arange(n) / rate
    shape = str(rng.choice(SHAPES))
    sweep = np.sin(np.pi * last / duration * t**2)
    match shape:
        case 'sweep':
            u = sweep
        case 'down':
            u = sweep[::-1] * np.minimum(1.0, t)
        case 'stairs':  # of frequency
            steps = np.repeat(np.linspace(0.3, last, 8), n // 8 + 1)[:n]
            u = np.sin(2.0 * np.pi * np.cumsum(steps) / rate)
        case 'steps':
            level = np.repeat(rng.uniform(-1.0, 1.0, int(duration) + 1), int(rate))[:n]
            rise = max(1, int(0.05 * rate))
            u = np.convolve(level, np.ones(rise) / rise, 'same')
        case 'triangle':
            u = np.arcsin(np.sin(0.4 * np.pi * last * t)) * t
        case 'ramps':
            u = np.clip(1.5 * np.sin(0.3 * np.pi * last * t), -1.0, 1.0)
        case 'random':
            u = Command('noise', rate, duration, 1.0, high=last, seed=seed).samples()
        case _:
            u = Command('earthquake', rate, duration, 1.0, seed=seed).samples()
    return np.asarray(u / np.abs(u).max())


def build(seed: int, effect: str = '') -> Case:
    """Build one case from its seed: every third machine is healthy, the others have one effect.

    Its size is the typical one of the catalogue for the test; it may be below the noise.

    Args:
        seed: of all that is drawn.
        effect: in place of the one that is drawn, which depends on what the catalogue holds.
    """
    rng = np.random.default_rng([seed, 17])
    rate = float(rng.choice(RATES))
    omega, stiff = between(rng, 15.0, 250.0), between(rng, 5e4, 2e7)
    theta = np.array(
        [omega * rng.uniform(1.5, 3.5), omega**2 * stiff, stiff, between(rng, 0.02, 5)]
    )
    last = max(0.5, min(0.06 * rate, omega / 6.28 * rng.uniform(0.3, 1.2)))
    amplitude = between(rng, 2e-4, 5e-2) * min(1.0, 3.0 / last)
    noise = amplitude * between(rng, 1e-3, 1e-2)
    duration = min(200.0, float(rng.choice(DURATIONS)) * max(1.0, 2.0 / last))
    stiffness = tuple(stiff * float(k) for k in rng.choice(SHARES, 3))
    known = [n for n in CATALOGUE.searched() if CATALOGUE[n].variance is None and n != 'hum']
    drawn = str(rng.choice(known)) if seed % 3 else ''
    name = effect or drawn
    names = (name,) if name else ()
    inputs = [amplitude * command(rng, rate, duration, last) for _ in stiffness]
    still = [Record(u, u, 1.0 / rate, k) for u, k in zip(inputs, stiffness, strict=True)]

    model = Structure(names)
    values = model.neutral(theta)
    for entry in model.entries:
        sizes = list(entry.starts(scale(still, theta)))
        bounds = np.array([(p.lower, p.upper) for p in entry.parameters]).T
        values[model.columns(entry.name)] = np.clip(sizes[len(sizes) // 2], *bounds)
    clean = [model.simulate(values, r) for r in still]
    left = base_residual(theta, inputs, clean, stiffness, rate) if names else 0.0
    return Case(
        seed,
        'single' if names else 'none',
        names,
        theta,
        rate,
        stiffness,
        inputs,
        [y + noise * rng.standard_normal(len(y)) for y in clean],
        clean,
        left / noise,
        0.0,
        parameters={p.name: float(v) for p, v in zip(model.parameters, values, strict=True)},
    )
