"""The second generator: other machines, other tests, other ways to write every effect.

What the diagnosis has learnt of the first generator does not help here: the plant's equations,
its integrator, sweeps, noises, signs and forms of the effects, and what lies outside the
catalogue differ (variant_plant.py, variant_effects.py).
"""

from __future__ import annotations

import numpy as np
import variant_plant as plant
from case import Case, kinds
from equivalents import values
from scipy import signal
from sizing import NOISE, Array, base_residual, sized
from variant_effects import ASKED, SIZES, UNKNOWN, Forms, respond

STIFFNESS = (0.0, 250e3, 250e3)


def draw_plant(rng: np.random.Generator) -> Array:
    """Machines from slow to fast, soft to stiff: beta_1, alpha_1 beta_0, alpha_2, alpha_3."""
    centres = (
        (128.0, 64.0, 2.4e5, 0.06),  # the paper's
        (225.0, 94.0, 6e5, 0.3),  # a testing machine of 15 Hz
        (235.0, 109.0, 4.2e6, 3.3),  # RTHS benchmark
        (200.0, 60.0, 5e6, 20.0),  # the middle of Table 3, made fit to follow a sweep
        (380.0, 170.0, 1.5e6, 1.0),  # fast
    )
    beta, omega, stiff, leak = centres[rng.integers(len(centres))]
    z = rng.standard_normal(4)
    beta, omega = beta * np.exp(0.15 * z[0]), omega * np.exp(0.12 * z[1])
    stiff, leak = stiff * np.exp(0.3 * z[2]), leak * np.exp(0.7 * z[3])
    return np.array([beta, omega**2 * stiff, stiff, leak])


def sweep(rng: np.random.Generator, amplitude: float, last: float, duration: float) -> Array:
    """One sweep: linear or exponential, up or down, tapered or not, its end at rest [m]."""
    t = np.arange(int(duration * plant.RATE)) / plant.RATE
    first = float(rng.choice([0.0, 0.05, 0.3]))
    if rng.random() < 0.3 and first > 0.0:
        rise = (last / first) ** (t / duration)
        phase = 2.0 * np.pi * first * duration / np.log(last / first) * (rise - 1.0)
    else:
        phase = 2.0 * np.pi * (first * t + 0.5 * (last - first) / duration * t**2)
    u = amplitude * np.sin(phase)
    if rng.random() < 0.3:
        u *= np.exp(-0.5 * t / duration)  # smaller where it is faster
    if rng.random() < 0.25:
        u = u[::-1] * np.minimum(1.0, t / 1.0)  # a down-sweep begins at rest too
    return np.asarray(u)


def shaking(rng: np.random.Generator, amplitude: float) -> Array:
    """Kanai-Tajimi ground motion under an Amin-Ang envelope, as displacement [m]."""
    n = int(50.0 * plant.RATE)
    t = np.arange(n) / plant.RATE
    w, damping = 2.0 * np.pi * rng.uniform(1.0, 3.0), 0.5
    b, a = signal.bilinear([2 * damping * w, w**2], [1, 2 * damping * w, w**2], plant.RATE)
    u = signal.lfilter(b, a, rng.standard_normal(n))
    u = signal.sosfilt(signal.butter(2, 0.2, 'highpass', fs=plant.RATE, output='sos'), u)
    u = signal.sosfilt(signal.butter(2, 9.0, fs=plant.RATE, output='sos'), u)
    u *= np.minimum(1.0, (t / 4.0) ** 2) * np.exp(-0.08 * np.maximum(0.0, t - 15.0))
    return np.asarray(amplitude * u / np.abs(u).max())


def commands(rng: np.random.Generator) -> list[Array]:
    """Two sweeps of a laboratory's habit and an earthquake of about their size [m]."""
    amplitude = float(rng.choice([1.5e-3, 2e-3, 2e-3, 3e-3]))
    last, duration = float(rng.choice([8.0, 10.0, 12.0])), float(rng.choice([45.0, 60.0]))
    held = shaking(rng, amplitude * rng.uniform(0.8, 1.1))
    return [sweep(rng, amplitude, last, duration), sweep(rng, amplitude, last, duration), held]


def noise(rng: np.random.Generator, n: int, kind: int) -> Array:
    """White, 1/f, coloured by a broad resonance, or slow and white in parts; sd `NOISE` [m]."""
    white = rng.standard_normal(n)
    if kind == 0:
        return np.asarray(NOISE * white)
    other = np.fft.rfft(rng.standard_normal(n))
    f = np.fft.rfftfreq(n, 1.0 / plant.RATE)
    if kind == 1:
        other /= np.sqrt(np.maximum(f, 0.1))
    elif kind == 2:
        other /= np.sqrt((1 - (f / 30.0) ** 2) ** 2 + (0.6 * f / 30.0) ** 2)
    else:
        other /= 1.0 + (f / 2.0) ** 2
    slow = np.fft.irfft(other, n)
    slow /= slow.std()
    return np.asarray(NOISE * (np.sqrt(0.5) * white + np.sqrt(0.5) * slow))


def build(
    seed: int, asked: tuple[str, ...] = (), stiffness: tuple[float, ...] = STIFFNESS
) -> Case:
    """Build one case from its seed, and with the effects that are asked for instead of its own."""
    rng = np.random.default_rng([seed, 11])
    kind, names = kinds(seed, tuple(SIZES), tuple(UNKNOWN))
    if asked:
        kind, names = 'single' if len(asked) == 1 else 'pair', asked
    theta = draw_plant(rng)
    inputs = commands(rng)
    forms = Forms.draw(rng)
    sizes: dict[str, float] = {}
    shares: dict[str, float] = {}
    ratio = 0.0

    def left(outputs: list[Array]) -> float:
        return base_residual(theta, inputs, outputs, stiffness, plant.RATE) / NOISE

    def outputs_of(tried: dict[str, float]) -> list[Array]:
        return respond(theta, tried, inputs[:2], stiffness, forms, seed)

    def ratio_of(tried: dict[str, float]) -> float:
        outputs = outputs_of(others | tried)
        if others:  # what it adds to theirs; without a payload a frame feels no force at k = 0
            rows = zip(outputs, outputs_of(others), outputs_of({}), strict=True)
            outputs = [y - without + base for y, without, base in rows]
        return left(outputs) if all(np.isfinite(y).all() for y in outputs) else np.inf

    others: dict[str, float] = {}
    if kind == 'none' and rng.random() < 0.5:
        sizes = {'coulomb-friction': min(20.0 / theta[2], 2e-6), 'backlash': 3e-6}
    target = float(np.exp(rng.uniform(np.log(0.7), np.log(8.0))))
    for name in names:
        others = sizes if asked else {}
        own = max(target, 2.0) if kind == 'pair' else target
        size, shares[name] = sized((name,), SIZES | UNKNOWN | ASKED, ratio_of, own)
        sizes |= size
        ratio = shares[name] if len(names) == 1 else 0.0
    clean = respond(theta, sizes, inputs, stiffness, forms, seed)
    if 'payload-inertia' in sizes:
        theta = forms.heavy(theta)
    colour = int(rng.integers(4))
    noises = [noise(rng, len(y), colour) for y in clean]
    measured = [y + e for y, e in zip(clean, noises, strict=True)]
    if 'quantisation' in sizes:
        step = sizes['quantisation']
        # The converter before or after the noise of the amplifier.
        rows = zip(clean, noises, strict=True)
        measured = [
            step * np.round(y / step) + e if forms.late else step * np.round((y + e) / step)
            for y, e in rows
        ]
    seen = 'quantisation' in sizes or 'timing-jitter' in sizes
    if seen or not ratio:
        ratio = left(measured if seen else clean)
    return Case(
        seed,
        kind,
        names,
        theta,
        plant.RATE,
        stiffness,
        inputs,
        measured,
        clean,
        ratio,
        float(colour),
        sizes,
        shares,
        values(
            sizes,
            theta,
            float(np.abs(inputs[0]).max()),
            forms.sign,
            forms.form,
            forms.frame,
            dry=False,
        ),
    )
