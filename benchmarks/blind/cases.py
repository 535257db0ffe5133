"""Blind cases: random plants, effects of random size, noise; the truth kept apart."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import plant
from numpy.typing import NDArray
from scipy import optimize, signal

Array = NDArray[np.float64]
NOISE = 1e-5  # m
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
GROUPS = (
    ('delay', 'sensor-lag', 'valve-lag'),
    ('coulomb-friction', 'stribeck-friction'),
    ('backlash', 'valve-deadband'),
    ('bias', 'valve-null', 'flow-asymmetry'),
    ('gain-drift', 'supply-droop'),
    ('drift',),
    ('pressure-flow', 'specimen-yield'),
    ('specimen-hardening', 'specimen-gap'),
    ('gain', 'viscous-damping'),
)


def group(name: str) -> tuple[str, ...]:
    """Return the names that count as the same group."""
    return next((g for g in GROUPS if name in g), (name,))


@dataclass
class Case:
    """One case: what the diagnosis sees and (apart) the truth."""

    seed: int
    kind: str
    effects: tuple[str, ...]
    theta: Array
    commands: list[Array]
    measured: list[Array]
    clean: list[Array]
    ratio: float  # post-refit noise-free residual over noise, fitting records
    colour: float
    sizes: dict[str, float] = field(default_factory=dict)
    # Post-refit residual over noise of each effect of a pair on its own.
    shares: dict[str, float] = field(default_factory=dict)


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
    """Apply one sensor effect to the displacement."""
    t = np.arange(len(y)) / plant.RATE
    match name:
        case 'backlash':
            return np.asarray(plant.play(y, size))
        case 'sensor-lag':
            fine = np.repeat(y, 1)
            pole = np.exp(-1.0 / (plant.RATE * size))
            # Exact for a displacement linear between samples.
            a = plant.RATE * size * (1.0 - pole)
            return np.asarray(signal.lfilter([1.0 - a, a - pole], [1.0, -pole], fine))
        case 'bias':
            return y + size
        case 'drift':
            return y + size * t / 60.0
        case 'hum':
            return y + np.sqrt(2) * size * np.sin(2 * np.pi * 50.0 * t + rng.uniform(0, 6.28))
        case 'clock-skew':
            return np.interp(t * (1.0 + size), t, y)
        case 'timing-jitter':
            return np.interp(t + size * rng.standard_normal(len(t)), t, y)
        case 'frame-antiresonance':
            w = 2 * np.pi * 6.5
            num = [1.0, 2 * 0.05 * w, w * w]
            den = [1.0, 2 * (0.05 + 0.2 * size) * w * (1 + size), (w * (1 + 0.3 * size)) ** 2]
            num = [c * den[2] / num[2] for c in num]
            b, a, _ = signal.cont2discrete((num, den), 1 / plant.RATE, 'bilinear')
            return np.asarray(signal.lfilter(b.ravel(), a, y))
        case 'sensor-saturation':
            limit = 2e-3 * (1.0 - size)
            return np.asarray(np.clip(y, -limit, limit))
        case 'sensor-dropout':
            out = y.copy()
            for at in rng.integers(0, len(y), rng.poisson(size * 60.0)):
                out[at : at + 16] = out[at]
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
    dry = e[plant.COULOMB] > 0 or e[plant.STRIBECK] > 0
    out = []
    for r, (command, k) in enumerate(zip(commands, STIFFNESS, strict=True)):
        rng = np.random.default_rng([seed, r, 7])
        sticks = np.zeros(len(command), dtype=np.bool_)
        if e[plant.STICK_RATE] > 0:
            width = int(e[plant.STICK_TIME] * plant.RATE)
            for at in rng.integers(0, len(command), rng.poisson(60 * e[plant.STICK_RATE])):
                sticks[at : at + width] = True
        y = plant.respond(command, theta, k, e, 64 if dry else 16, sticks)
        for name, size in effects.items():
            y = _sense(name, size, y, rng)
        out.append(y)
    return out


def base_response(theta: Array, command: Array, k: float) -> Array:
    """Eq. (2a) with its command held, exact [m]."""
    b1, n0, a2, a3 = theta
    den = [k + a2, a3 * k + b1 * (k + a2), b1 * a3 * k + n0]
    num, den_z, _ = signal.cont2discrete(([n0], den), 1 / plant.RATE, 'zoh')
    return np.asarray(signal.lfilter(num.ravel(), den_z, command))


def base_residual(theta: Array, commands: list[Array], measured: list[Array]) -> float:
    """Rms that remains after Eq. (2) is refitted to the first two records [m]."""

    def errors(log_theta: Array) -> Array:
        p = np.exp(np.clip(log_theta, -20, 40))
        return np.concatenate(
            [
                1e5 * (y[::2] - base_response(p, u, k)[::2])
                for u, y, k in zip(commands[:2], measured[:2], STIFFNESS[:2], strict=True)
            ]
        )

    start = np.log(np.maximum(theta, 1e-3))
    fit = optimize.least_squares(errors, start, x_scale=0.1, max_nfev=60)
    return float(1e-5 * np.sqrt(np.mean(fit.fun**2)))


def _sized(
    names: tuple[str, ...], theta: Array, commands: list[Array], target: float, seed: int
) -> tuple[dict[str, float], float]:
    """Find sizes whose post-refit residual is about `target` times the noise (log bisection)."""
    table = SIZES | UNKNOWN
    low, high, best = 0.0, 1.0, (np.inf, {}, 0.0)
    share = 0.5
    for _ in range(7):
        sizes = {n: float(table[n][0] * (table[n][1] / table[n][0]) ** share) for n in names}
        clean = respond(theta, sizes, commands, seed)
        ok = all(np.isfinite(y).all() for y in clean)
        ratio = base_residual(theta, commands, clean) / NOISE if ok else np.inf
        if ok and abs(np.log(ratio / target)) < best[0]:
            best = (abs(float(np.log(ratio / target))), sizes, ratio)
        if best[0] < 0.15:
            break
        low, high = (share, high) if ratio < target else (low, share)
        share = 0.5 * (low + high)
    return best[1], best[2]


def _noise(rng: np.random.Generator, colour: float, corner: float) -> Array:
    """White plus first-order coloured noise, sd `NOISE` in all [m]."""
    white = rng.standard_normal(SAMPLES)
    pole = np.exp(-2 * np.pi * corner / plant.RATE)
    slow = signal.lfilter([np.sqrt(1 - pole**2)], [1, -pole], rng.standard_normal(SAMPLES))
    return np.asarray(NOISE * (np.sqrt(1 - colour) * white + np.sqrt(colour) * slow))


def kinds(seed: int) -> tuple[str, tuple[str, ...]]:
    """Return kind and effects of a seed: stratified, so that any 20 in a row hold all kinds."""
    rng = np.random.default_rng([seed, 1])
    place = seed % 20
    known, unknown = tuple(SIZES), tuple(UNKNOWN)
    if place < 4:
        return 'none', ()
    if place < 7:
        return 'unknown', (unknown[(seed // 20 * 3 + place - 4) % len(unknown)],)
    if place < 9:
        while True:
            a, b = rng.choice(len(known), 2, replace=False)
            pair = (known[a], known[b])
            if pair[1] not in group(pair[0]):
                return 'pair', pair
    return 'single', (known[(seed // 20 * 11 + place - 9) % len(known)],)


def build(seed: int) -> Case:
    """Build one case from its seed alone."""
    rng = np.random.default_rng([seed, 2])
    kind, names = kinds(seed)
    theta = draw_plant(rng)
    commands = [sweep(), sweep(), earthquake(rng)]
    sizes: dict[str, float] = {}
    shares: dict[str, float] = {}
    ratio = 0.0
    if kind == 'none' and rng.random() < 0.4:
        # Background clutter that a healthy machine has: it must not become a finding.
        sizes = {'coulomb-friction': 20.0 / theta[2] if theta[2] > 1e6 else 1e-6, 'backlash': 3e-6}
    elif names:
        target = float(np.exp(rng.uniform(np.log(0.7), np.log(8.0))))
        for name in names:
            # Each effect of a pair is made visible on its own.
            own = max(target, 2.0) if kind == 'pair' else target
            size, shares[name] = _sized((name,), theta, commands, own, seed)
            sizes |= size
        ratio = shares[names[0]] if len(names) == 1 else 0.0
    clean = respond(theta, sizes, commands, seed)
    colour = float(rng.choice([0.0, 0.3, 0.6]))
    corner = float(np.exp(rng.uniform(np.log(0.5), np.log(20.0))))
    measured = [y + _noise(rng, colour, corner) for y in clean]
    if 'quantisation' in sizes:
        step = sizes['quantisation']
        measured = [step * np.round(y / step) for y in measured]
    if not ratio:
        ratio = base_residual(theta, commands, clean) / NOISE
    if 'quantisation' in sizes or 'timing-jitter' in sizes:
        ratio = base_residual(theta, commands, measured) / NOISE
    return Case(seed, kind, names, theta, commands, measured, clean, ratio, colour, sizes, shares)
