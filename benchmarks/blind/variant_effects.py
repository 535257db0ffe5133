"""Effects of the second generator: sizes, forms, and what acts in the sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import variant_plant as plant
from scipy import signal
from sizing import FINE, Array, between

SIZES: dict[str, tuple[float, float]] = {
    'coulomb-friction': (5e-6, 300e-6),
    'specimen-gap': (5e-6, 500e-6),
    'delay': (1e-3, 15e-3),
    'quantisation': (10e-6, 300e-6),
    'flow-asymmetry': (2e-3, 0.3),
    'specimen-yield': (0.05, 0.95),
    'valve-deadband': (3e-6, 200e-6),
    'drift': (5e-6, 400e-6),
    'pressure-flow': (0.01, 0.95),
    'valve-lag': (0.5e-3, 8e-3),
    'gain-drift': (0.01, 0.4),
    'hum': (5e-6, 100e-6),
    'specimen-hardening': (0.02, 1.5),
    'backlash': (3e-6, 200e-6),
    'flow-saturation': (0.03, 0.6),
    'timing-jitter': (0.1e-3, 3e-3),
    'gain': (3e-3, 0.1),
    'payload-inertia': (0.05, 0.6),
    'bias': (3e-6, 300e-6),
    'supply-droop': (0.01, 0.5),
    'sensor-lag': (0.5e-3, 8e-3),
    'viscous-damping': (0.003, 0.5),
    'clock-skew': (5e-6, 300e-6),
    'stribeck-friction': (5e-6, 300e-6),
    'valve-null': (3e-6, 200e-6),
}
UNKNOWN: dict[str, tuple[float, float]] = {
    'command-play': (5e-6, 300e-6),
    'sensor-quadratic': (5e-6, 300e-6),
    'sensor-frame': (0.005, 0.5),
    'amplitude-delay': (0.3e-3, 15e-3),
    'loop-play': (3e-6, 300e-6),
    'sensor-cubic': (5e-6, 300e-6),
    'support-stick': (5e-6, 500e-6),
    'integral-action': (0.01, 3.0),
    'rate-gain': (0.01, 3.0),
    'return-damping': (0.003, 1.0),
    'loosening': (0.01, 0.5),
    'valve-hysteresis': (3e-6, 300e-6),
    'sensor-spikes': (20e-6, 2e-3),
    'position-gain': (0.02, 0.6),
}
# Built where they are asked for: to draw them would make every seed another machine.
# A frame is at least four times as stiff as the specimen: with a softer one the loop may ring on.
ASKED: dict[str, tuple[float, float]] = {'frame-mode': (0.002, 0.25)}


@dataclass(frozen=True)
class Forms:
    """How effects are written in one case.

    Attributes:
        sign: of effects that have two.
        form: which way an effect with several is written.
        late: the converter's noise comes after its grid.
        hertz: of the mains.
        frame: natural frequency [Hz] and damping ratio of the reaction frame.
    """

    sign: float
    form: int
    late: bool
    hertz: float
    frame: tuple[float, float]

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Forms:
        """Choose forms at random."""
        sign, form = float(rng.choice([-1.0, 1.0])), int(rng.integers(3))
        late, hertz = bool(rng.random() < 0.5), float(rng.choice([50.0, 60.0]))
        # A stream of its own leaves every other draw of a seed what it was.
        hz, damping = np.exp(rng.spawn(1)[0].uniform(np.log([8.0, 0.01]), np.log([40.0, 0.05])))
        return cls(sign, form, late, hertz, (float(hz), float(damping)))

    @staticmethod
    def heavy(theta: Array) -> Array:
        """An undamped oil column needs leakage to be stable with an inertia on it."""
        out = theta.copy()
        out[3] = max(out[3], 0.15 * theta[0])
        return out


def _install(name: str, size: float, e: Array, theta: Array, forms: Forms, stroke: float) -> None:
    """Set one effect in the plant; forces scale with the oil stiffness alpha_2."""
    stiff = theta[2]
    flow = stroke * 2 * np.pi * 8.0 * (stiff + 125e3)
    put = plant.INDEX
    sign, form = forms.sign, forms.form
    values: dict[str, float] = {}
    match name:
        case 'delay':
            values = {'delay': size}
        case 'gain':
            values = {'command_gain': 1.0 + sign * size}
        case 'valve-lag':
            values = {'valve_lag': size}
        case 'valve-deadband':
            values = {'deadband': size, 'deadband_form': form}
        case 'valve-null':
            values = {'null': sign * size}
        case 'flow-saturation':
            values = {'max_flow': flow * (1.05 - size), 'saturation_form': form}
        case 'pressure-flow':
            values = {'supply_force': 250e3 * stroke / size}
        case 'flow-asymmetry':
            values = {'asymmetry': sign * size}
        case 'supply-droop':
            values = {'droop': size, 'droop_form': form % 2, 'droop_flow': 0.5 * flow}
            values['droop_time'] = (1.0, 3.0)[form % 2]
        case 'gain-drift':
            values = {'gain_drift': sign * size, 'drift_form': form % 2}
        case 'coulomb-friction':
            values = {'coulomb': size * stiff, 'friction_form': form % 2}
        case 'stribeck-friction':
            values = {'coulomb': 0.6 * size * stiff, 'stribeck': 0.4 * size * stiff}
            values |= {'stribeck_speed': 6e-3, 'friction_form': form % 2}
        case 'viscous-damping':
            values = {'viscous': size * stiff / 50.0}
        case 'payload-inertia':
            theta[:] = Forms.heavy(theta)
            values = {'mass': size * theta[3] * stiff**2 / (theta[0] * theta[1])}
        case 'specimen-gap':
            values = {'gap': size}
        case 'specimen-hardening':
            values = {'hardening': (sign * 0.2 if sign < 0 else 1.0) * size / stroke**2}
        case 'specimen-yield':
            values = {'yield_ratio': 1.0 - size, 'yield_x': 0.4 * stroke}
            values |= {'yield_power': (1.0, 2.0, 5.0)[form], 'yield_gamma': (0.5, 0.4, 0.5)[form]}
        case 'frame-mode':
            hz, damping = forms.frame
            values = {'frame_compliance': size / 250e3, 'frame_speed': 2.0 * np.pi * hz}
            values |= {'frame_damping': damping, 'frame_seen': 0.5 * form}
        case 'command-play':
            values = {'command_play': size}
        case 'amplitude-delay':
            values = {'amplitude_delay': size}
        case 'loop-play':
            values = {'loop_play': size}
        case 'support-stick':
            values = {'support_stick': size * stiff}
        case 'integral-action':
            values = {'integral': size}
        case 'rate-gain':
            values = {'rate_gain': size}
        case 'return-damping':
            values = {'return_damping': size * stiff / 50.0}
        case 'loosening':
            values = {'loosening': size, 'loosening_at': 28.0}
        case 'valve-hysteresis':
            values = {'valve_play': size}
        case 'position-gain':
            values = {'position_gain': -size}
        case 'command-lag':
            values = {'command_lag': size}
        case 'command-rate':
            values = {'command_rate': size / (stroke * 2 * np.pi * 8.0)}
        case 'loop-lag':
            values = {'loop_lag': size}
        case 'turbulent-leak':
            values = {'turbulent_leak': size * 10.0 * np.sqrt(500.0)}
        case _:
            pass  # sensor effects: see `_sense`
    for key, value in values.items():
        e[put[key]] = value


def _sense(
    name: str, size: float, y: Array, forms: Forms, stroke: float, rng: np.random.Generator
) -> Array:
    """Apply one sensor effect to the displacement, `FINE` times in each sample."""
    rate, count = FINE * plant.RATE, len(y) // FINE
    t = np.arange(len(y)) / rate
    sign = forms.sign
    match name:
        case 'backlash':
            return np.asarray(plant.play(y, size))
        case 'sensor-lag':
            # A conditioner's pole, or an anti-alias filter of second order with its delay.
            order = 2 if forms.form == 2 else 1
            corner = order * 0.71 / (2.0 * np.pi * size) if order == 2 else 0.5 / np.pi / size
            sos = signal.butter(order, corner, fs=rate, output='sos')
            return np.asarray(signal.sosfilt(sos, y))
        case 'bias':
            return y + sign * size
        case 'drift':
            return y + sign * size * t / 60.0
        case 'hum':
            phase = rng.uniform(0, 6.28)
            return y + np.sqrt(2) * size * np.sin(2 * np.pi * forms.hertz * t + phase)
        case 'clock-skew':
            return between(y, rate * t * (1.0 + sign * size))
        case 'timing-jitter':
            late = (
                rng.standard_normal(count),
                np.sqrt(3.0) * rng.uniform(-1, 1, count),
                rng.exponential(1.0, count) - 1.0,
            )[forms.form]
            return between(y, rate * (t + np.repeat(size * late, FINE)))
        case 'sensor-quadratic':
            return y + sign * size * (y / stroke) ** 2
        case 'sensor-cubic':
            return y + sign * size * (y / stroke) ** 3
        case 'sensor-frame':
            # The transducer's frame moves with the actuator's reaction: a mode at 14 Hz.
            w = 2 * np.pi * 14.0
            num, den = [1.0, 0.0, 0.0], [1.0, 2 * 0.08 * w, w * w]
            b, a, _ = signal.cont2discrete((num, den), 1 / rate, 'bilinear')
            return y + size * np.asarray(signal.lfilter(b.ravel(), a, y))
        case 'sensor-spikes':
            out = y.copy()
            at = FINE * rng.integers(0, count, int(0.004 * count))
            out[at] += size * rng.standard_normal(len(at))
            return out
        case _:
            return y


def respond(
    theta: Array,
    effects: dict[str, float],
    commands: Sequence[Array],
    stiffness: Sequence[float],
    forms: Forms,
    seed: int,
    onset: tuple[str, float] = ('', 0.0),
) -> list[Array]:
    """Noise-free sensor output of every record [m].

    The effect named in `onset`, one of the plant's, appears in the first record at its time [s]
    and is there in all later ones.
    """
    theta = theta.copy()
    stroke = float(np.abs(commands[0]).max())
    e = np.array(list(plant.NEUTRAL.values()))
    for name, size in effects.items():
        if name != onset[0]:
            _install(name, size, e, theta, forms, stroke)
    later = e.copy()
    if onset[0] in effects:
        _install(onset[0], effects[onset[0]], later, theta, forms, stroke)
    out = []
    # Zipped loosely: sizes are sought on the first records only.
    for r, (command, k) in enumerate(zip(commands, stiffness, strict=False)):
        rng = np.random.default_rng([seed, r, 7])
        y = plant.respond(command, theta, k, e, later, 0.0 if r else onset[1])
        for name, size in effects.items():
            y = _sense(name, size, y, forms, stroke, rng)
        out.append(np.asarray(y[::FINE]))
    return out
