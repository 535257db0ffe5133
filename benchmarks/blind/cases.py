"""Blind cases: random plants, effects of random size, noise; the truth kept apart."""

from __future__ import annotations

import numpy as np
import plant
from case import Case, kinds
from equivalents import values
from scipy import signal
from sizing import FINE, NOISE, Array, base_residual, between, sized

STIFFNESS = (0.0, 250e3, 250e3)
SAMPLES = int(60 * plant.RATE)

# name -> (smallest, largest size, base share): sizes are relative to the scale in `_install`.
SIZES: dict[str, tuple[float, float]] = {
    'delay': (1e-3, 15e-3),
    'gain': (3e-3, 0.1),
    'valve-lag': (0.5e-3, 8e-3),
    'valve-deadband': (3e-6, 200e-6),
    'valve-null': (3e-6, 200e-6),
    'flow-saturation': (0.03, 0.6),
    'pressure-flow': (0.01, 0.95),
    'flow-asymmetry': (2e-3, 0.3),
    'supply-droop': (0.01, 0.5),
    'gain-drift': (0.01, 0.4),
    'coulomb-friction': (5e-6, 300e-6),
    'stribeck-friction': (5e-6, 300e-6),
    'backlash': (3e-6, 200e-6),
    'viscous-damping': (0.003, 0.5),
    'payload-inertia': (0.05, 0.6),
    'specimen-gap': (5e-6, 500e-6),
    'specimen-hardening': (0.02, 2.0),
    'specimen-yield': (0.05, 0.9),
    'sensor-lag': (0.5e-3, 8e-3),
    'bias': (3e-6, 300e-6),
    'drift': (5e-6, 400e-6),
    'hum': (5e-6, 100e-6),
    'quantisation': (10e-6, 300e-6),
    'clock-skew': (5e-6, 300e-6),
    'timing-jitter': (0.1e-3, 3e-3),
}
# Kinds the catalogue does not hold; the second line acts in the sensor, after the plant.
UNKNOWN: dict[str, tuple[float, float]] = {
    'turbulent-leak': (0.05, 3.0),
    'rate-gain': (0.01, 3.0),
    'position-gain': (0.02, 0.6),
    'delay-wobble': (0.3e-3, 10e-3),
    'random-stick': (0.1, 3.0),
    'flow-ripple': (0.02, 0.5),
    'frame-antiresonance': (0.01, 0.6),
    'sensor-saturation': (0.02, 0.5),
    'sensor-dropout': (0.1, 4.0),
    'sensor-switch': (5e-6, 200e-6),
}


def sweep() -> Array:
    """Problem R's sweep at this rate [m]."""
    t = np.arange(SAMPLES) / plant.RATE
    return np.asarray(2e-3 * np.sin(np.pi * (10.0 / 60.0) * t**2))


def earthquake(rng: np.random.Generator) -> Array:
    """Band-limited shaking with a build-up and decay, peak 2 mm [m]."""
    t = np.arange(SAMPLES) / plant.RATE
    sos = signal.butter(2, [0.3, 7.0], 'bandpass', fs=plant.RATE, output='sos')
    envelope = np.minimum(1.0, (t / 6.0) ** 2) * np.exp(-0.03 * np.maximum(0.0, t - 20.0))
    u = signal.sosfilt(sos, rng.standard_normal(SAMPLES)) * envelope
    return np.asarray(2e-3 * u / np.abs(u).max())


def draw_plant(rng: np.random.Generator) -> Array:
    """Parameters around the paper's plant or the reduced RTHS benchmark plant."""
    if rng.random() < 0.5:
        centre, spread = np.array([128.0, 1.01e9, 2.42e5, 0.3]), [0.15, 0.2, 0.15, 1.0]
    else:
        centre, spread = np.array([235.0, 5.0e10, 4.23e6, 3.3]), [0.1, 0.15, 0.1, 0.4]
    return np.asarray(centre * np.exp(np.array(spread) * rng.standard_normal(4)))


def _install(name: str, size: float, e: Array, theta: Array) -> None:
    """Set one effect in the plant; forces scale with the oil stiffness alpha_2."""
    peak_speed, stiff = 2e-3 * 2 * np.pi * 8.0, theta[2]
    flow = peak_speed * (stiff + 125e3)
    put = plant.INDEX
    match name:
        case 'delay':
            e[put['delay']] = size
        case 'gain':
            e[put['command_gain']] = 1.0 + size
        case 'valve-lag':
            e[put['valve_lag']] = size
        case 'valve-deadband':
            e[put['deadband']] = size
        case 'valve-null':
            e[put['null']] = size
        case 'flow-saturation':
            e[put['max_flow']] = flow * (1.05 - size)
        case 'pressure-flow':
            e[put['supply_force']] = 250e3 * 2e-3 / size
        case 'flow-asymmetry':
            e[put['asymmetry']] = size
        case 'supply-droop':
            e[put['droop']] = size
            e[put['droop_flow']], e[put['droop_time']] = 0.5 * flow, 2.0
        case 'gain-drift':
            e[put['gain_drift']] = -size
        case 'coulomb-friction':
            e[put['coulomb']] = size * stiff
        case 'stribeck-friction':
            e[put['coulomb']] = 0.5 * size * stiff
            e[put['stribeck']], e[put['stribeck_speed']] = 0.7 * size * stiff, 8e-3
        case 'backlash':
            e[put['play']] = size
        case 'viscous-damping':
            e[put['viscous']] = size * stiff / 50.0
        case 'payload-inertia':
            # An undamped oil column needs leakage to be stable with an inertia on it.
            theta[3] = 40.0 if theta[2] < 1e6 else 12.0
            e[put['mass']] = size * theta[3] * theta[2] ** 2 / (theta[0] * theta[1])
        case 'specimen-gap':
            e[put['gap']] = size
        case 'specimen-hardening':
            e[put['hardening']] = size / (2e-3) ** 2
        case 'specimen-yield':
            e[put['yield_ratio']] = 1.0 - size
            e[put['yield_displacement']] = 0.8e-3
        case 'turbulent-leak':
            e[put['turbulent_leak']] = size * 10.0 / np.sqrt(500.0)
        case 'rate-gain':
            e[put['rate_gain']] = size
        case 'position-gain':
            e[put['position_gain']] = -size
        case 'delay-wobble':
            e[put['delay_wobble']], e[put['delay_wobble_hz']] = size, 0.37
        case 'flow-ripple':
            e[put['flow_ripple']], e[put['flow_ripple_hz']] = size, 0.29
        case 'random-stick':
            e[put['stick_rate']], e[put['stick_time']] = size, 0.04
        case _:
            pass  # sensor effects: see `_sense`


def _sense(name: str, size: float, y: Array, rng: np.random.Generator) -> Array:
    """Apply one sensor effect to the displacement, `FINE` times in each sample."""
    rate, count = FINE * plant.RATE, len(y) // FINE
    t = np.arange(len(y)) / rate
    match name:
        case 'backlash':
            return np.asarray(plant.play(y, size))
        case 'sensor-lag':
            lag = rate * size
            pole = np.exp(-1.0 / lag)
            # Exact for a displacement linear between samples.
            a = lag * (1.0 - pole)
            return np.asarray(signal.lfilter([1.0 - a, a - pole], [1.0, -pole], y))
        case 'bias':
            return y + size
        case 'drift':
            return y + size * t / 60.0
        case 'hum':
            return y + np.sqrt(2) * size * np.sin(2 * np.pi * 50.0 * t + rng.uniform(0, 6.28))
        case 'clock-skew':
            return between(y, rate * t * (1.0 + size))
        case 'timing-jitter':
            return between(y, rate * (t + np.repeat(size * rng.standard_normal(count), FINE)))
        case 'frame-antiresonance':
            w = 2 * np.pi * 6.5
            num = [1.0, 2 * 0.05 * w, w * w]
            den = [1.0, 2 * (0.05 + 0.2 * size) * w * (1 + size), (w * (1 + 0.3 * size)) ** 2]
            num = [c * den[2] / num[2] for c in num]
            b, a, _ = signal.cont2discrete((num, den), 1 / rate, 'bilinear')
            return np.asarray(signal.lfilter(b.ravel(), a, y))
        case 'sensor-saturation':
            limit = 2e-3 * (1.0 - size)
            return np.asarray(np.clip(y, -limit, limit))
        case 'sensor-dropout':
            out = y.copy()
            for at in FINE * rng.integers(0, count, rng.poisson(size * 60.0)):
                out[at : at + 16 * FINE] = out[at]
            return out
        case 'sensor-switch':
            # A scale joint: the reading jumps while the piston is beyond 0.7 mm.
            return y + size * (y > 0.7e-3)
        case _:
            return y


def respond(
    theta: Array, effects: dict[str, float], commands: list[Array], seed: int
) -> list[Array]:
    """Noise-free sensor output of every record [m]."""
    theta = theta.copy()
    e = np.array(list(plant.NEUTRAL.values()))
    for name, size in effects.items():
        _install(name, size, e, theta)
    # What has corners converges slowly.
    dry = e[plant.COULOMB] > 0 or e[plant.STRIBECK] > 0
    # Contact in the middle of a step leaves an error of first order.
    substeps = 256 if e[plant.GAP] > 0 else 64 if dry else 16
    out = []
    for r, (command, k) in enumerate(zip(commands, STIFFNESS, strict=True)):
        rng = np.random.default_rng([seed, r, 7])
        sticks = np.zeros(len(command), dtype=np.bool_)
        if e[plant.STICK_RATE] > 0:
            width = int(e[plant.STICK_TIME] * plant.RATE)
            for at in rng.integers(0, len(command), rng.poisson(60 * e[plant.STICK_RATE])):
                sticks[at : at + width] = True
        y = plant.respond(command, theta, k, e, substeps, sticks)
        for name, size in effects.items():
            y = _sense(name, size, y, rng)
        out.append(y[::FINE])
    return out


def _noise(rng: np.random.Generator, colour: float, corner: float) -> Array:
    """White plus first-order coloured noise, sd `NOISE` in all [m]."""
    white = rng.standard_normal(SAMPLES)
    pole = np.exp(-2 * np.pi * corner / plant.RATE)
    slow = signal.lfilter([np.sqrt(1 - pole**2)], [1, -pole], rng.standard_normal(SAMPLES))
    return np.asarray(NOISE * (np.sqrt(1 - colour) * white + np.sqrt(colour) * slow))


def build(seed: int) -> Case:
    """Build one case from its seed alone."""
    rng = np.random.default_rng([seed, 2])
    kind, names = kinds(seed, tuple(SIZES), tuple(UNKNOWN))
    theta = draw_plant(rng)
    commands = [sweep(), sweep(), earthquake(rng)]
    sizes: dict[str, float] = {}
    shares: dict[str, float] = {}
    ratio = 0.0

    def left(outputs: list[Array]) -> float:
        return base_residual(theta, commands, outputs, STIFFNESS, plant.RATE) / NOISE

    def ratio_of(tried: dict[str, float]) -> float:
        outputs = respond(theta, tried, commands, seed)
        return left(outputs) if all(np.isfinite(y).all() for y in outputs) else np.inf

    if kind == 'none' and rng.random() < 0.4:
        # Background clutter that a healthy machine has: it must not become a finding.
        sizes = {'coulomb-friction': 20.0 / theta[2] if theta[2] > 1e6 else 1e-6, 'backlash': 3e-6}
    elif names:
        target = float(np.exp(rng.uniform(np.log(0.7), np.log(8.0))))
        for name in names:
            # Each effect of a pair is made visible on its own.
            own = max(target, 2.0) if kind == 'pair' else target
            size, shares[name] = sized((name,), SIZES | UNKNOWN, ratio_of, own)
            sizes |= size
        ratio = shares[names[0]] if len(names) == 1 else 0.0
    clean = respond(theta, sizes, commands, seed)
    colour = float(rng.choice([0.0, 0.3, 0.6]))
    corner = float(np.exp(rng.uniform(np.log(0.5), np.log(20.0))))
    measured = [y + _noise(rng, colour, corner) for y in clean]
    if 'quantisation' in sizes:
        step = sizes['quantisation']
        measured = [step * np.round(y / step) for y in measured]
    seen = 'quantisation' in sizes or 'timing-jitter' in sizes
    if seen or not ratio:
        ratio = left(measured if seen else clean)
    return Case(
        seed,
        kind,
        names,
        theta,
        plant.RATE,
        STIFFNESS,
        commands,
        measured,
        clean,
        ratio,
        colour,
        sizes,
        shares,
        values(sizes, theta, 2e-3),
    )
