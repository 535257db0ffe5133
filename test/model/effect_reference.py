"""The loop with effects as differential equations for scipy: shares nothing with the kernel.

One right-hand side from the equations of docs/effects_catalogue.md. Dry friction on a massless
specimen is solved as what it is, a hybrid system: stick, slip forward, slip backward, with located
events.
"""

from __future__ import annotations

from math import copysign, cos, exp, pi, sin, sqrt

import numpy as np
from scipy.integrate import solve_ivp

from actuator_glue.model.effects import CATALOGUE

NEUTRAL = {p.name: p.neutral for e in CATALOGUE.values() for p in e.parameters}
Q, QD, F, X, V, Z, ENV, LEVEL, Y, W, WV, LOST = range(12)


def sign(value):
    """Sign of a number; 0 of zero."""
    return copysign(1.0, value) if value else 0.0


def soft(value, width):
    """Dead zone."""
    return sign(value) * max(abs(value) - width, 0.0)


class Reference:
    """Displacement under a command that runs linearly between its samples.

    Args:
        base: beta_1, alpha_1_beta_0, alpha_2, alpha_3.
        effects: parameters of effects by name.
        stiffness: specimen stiffness [N/m].
    """

    def __init__(self, base, effects, stiffness):
        self.b1, self.n0, self.a2, self.a3 = base
        self.k = stiffness
        self.p = NEUTRAL | effects
        self.massless = self.p['mass'] == 0.0 and self.p['damping'] == 0.0
        self.dry = self.p['coulomb_force'] + self.p['sliding_force']
        self.rise = self.p['sliding_force'] * (self.p['breakaway_ratio'] - 1.0)
        self.memory = max(
            2e-3, 1.72 * self.rise / ((self.k + self.a2) * self.p['stribeck_velocity'])
        )

    def command(self, t):
        """Command at the summing junction."""
        late = t * (1.0 - self.p['clock_skew']) - self.p['delay'] + self.p['lead']
        return self.p['gain'] * np.interp(late, self.time, self.u)

    def specimen(self, x, z):
        """Static specimen force, its slope at constant z, and its slope with z."""
        p, g = self.p, self.p['gap']
        d = soft(x, g)
        inside = 1.0 if abs(x) >= g else 0.0
        a = p['post_yield_ratio']
        force = self.k * (a * d + (1.0 - a) * z + p['hardening'] * d**3)
        slope = self.k * (a + 3.0 * p['hardening'] * d**2) * inside
        return force, slope, self.k * (1.0 - a) * inside

    def yielding(self, z, direction):
        """dz/dx of the Bouc-Wen model; integer sharpness only."""
        if z * direction <= 0.0:
            return 1.0
        return 1.0 - abs(z / self.p['yield_displacement']) ** (2.0 ** self.p['yield_sharpness'])

    def rhs(self, t, s, mode):
        """Time derivative; mode 0: no dry friction, 1 / -1: slipping, 2: sticking."""
        # Plain numbers: numpy's take several times as long.
        p, s, out = self.p, s.tolist(), [0.0] * 12
        own, share = s[X] + s[W], p['feedback_share']
        recorded = self.transducer(t, s[Y] if p['sensor_lag'] > 0.0 else self.seen(s))
        position = own + share * (recorded - own)
        error = soft(self.command(t) - position + p['null_offset'], p['deadband'])
        drive = self.n0 * error - self.b1 * s[Q]
        if p['valve_lag'] > 0.0:
            out[Q], out[QD] = s[QD], (drive - s[QD]) / p['valve_lag']
        else:
            out[Q] = drive
        way = sign(s[Q])
        flow = s[Q] * (1.0 + p['asymmetry'] * way)
        flow *= sqrt(max(1.0 - way * s[F] * p['inverse_stall_force'], 0.0))
        flow *= sqrt(max(1.0 - p['droop'] * s[ENV], 0.0))
        flow *= max(1.0 + p['gain_drift'] * t, 0.0)
        if p['saturation_velocity'] < NEUTRAL['saturation_velocity']:
            limit = self.a2 * p['saturation_velocity']
            flow = min(max(flow, -limit), limit)
        flow *= sqrt(min(max(1.0 - s[LOST], 0.0), 1.0))
        beyond = p['depletion'] * (abs(flow) / self.a2 - p['pump_velocity'])
        out[LOST] = beyond if s[LOST] > 0.0 else max(beyond, 0.0)
        out[ENV] = (abs(s[Q]) / self.a2 - s[ENV]) / p['droop_time']
        oil = flow - self.a3 * s[F] - self.a2 * s[WV]
        force, slope, with_z = self.specimen(s[X], s[Z])
        direction = sign(oil) if self.massless else sign(s[V])
        if p['damping'] > 0.0 and p['mass'] == 0.0:
            direction = sign(s[F] - force)
        dz = self.yielding(s[Z], direction) if p['post_yield_ratio'] < 1.0 else 0.0
        stiff = self.a2 + slope + with_z * dz
        if p['mass'] > 0.0:
            v = s[V]
            damping = p['damping'] + p['mass'] * p['mass_damping']
            out[V] = (s[F] - force - damping * v) / p['mass']
        elif p['damping'] > 0.0:
            v = (s[F] - force) / p['damping']
        elif mode == 2:
            v = 0.0
        else:
            v = oil / stiff
            for _ in range(30 if self.rise > 0.0 else 0):
                # The friction level falls while the piston speeds up: implicit in v.
                v = (oil - mode * self.relax(s[LEVEL], v)) / stiff
        out[LEVEL] = self.relax(s[LEVEL], v)
        inside = 1.0 if abs(s[X]) >= p['gap'] else 0.0
        out[Z] = v * dz * inside
        out[X] = v
        out[F] = oil - self.a2 * v
        if p['sensor_lag'] > 0.0:
            out[Y] = (self.seen(s) - s[Y]) / p['sensor_lag']
        turn = 2.0 * pi * p['frame_frequency']
        rest = p['frame_compliance'] * s[F] - s[W]
        out[W], out[WV] = s[WV], turn**2 * rest - 2.0 * p['frame_damping'] * turn * s[WV]
        return out

    def seen(self, s):
        """Position of the piston against what the recorded transducer is fixed to."""
        return s[X] + self.p['frame_seen'] * s[W]

    def transducer(self, t, y):
        """What a transducer without play and lag shows."""
        p, angle = self.p, 2.0 * pi * self.p['hum_frequency'] * t
        y = y + p['bias'] + p['drift'] * t
        y = y + p['hum_cosine'] * cos(angle) + p['hum_sine'] * sin(angle)
        return y + p['sensor_even'] * y**2 + p['sensor_odd'] * y**3

    def relax(self, level, v):
        """Derivative of the rise of dry friction."""
        wish = self.rise * exp(-((v / self.p['stribeck_velocity']) ** 2))
        return (wish - level) / self.memory

    def simulate(self, u, period, fine=1):
        """Return displacement at the samples, or `fine` times as often, from rest."""
        self.time, self.u = np.arange(len(u)) * period, np.asarray(u)
        at = np.arange((len(u) - 1) * fine + 1) * period / fine
        # A tenth of it, and other methods, change no case by more than 0.002 um.
        options = {'rtol': 1e-7, 'atol': self.tolerance(), 'max_step': period, 'method': 'LSODA'}
        state = np.zeros(12)
        if self.rise > 0.0:
            state[LEVEL] = 0.0
        if self.dry == 0.0:
            s = solve_ivp(self.rhs, (0.0, at[-1]), state, t_eval=at, args=(0,), **options)
            assert s.success, s.message
            return self.sensed(at, s.y, fine)
        return self.sensed(at, self.hybrid(at, state, options), fine)

    def tolerance(self):
        """Absolute tolerances: 1e-10 m, and forces and flows accordingly."""
        scale = np.full(12, 1e-10)
        scale[[Q, QD]] *= self.a2 * np.array([10.0, 1e3])
        scale[[F, LEVEL]] *= self.a2
        scale[[V, WV]] *= 100.0
        return scale

    def hybrid(self, at, state, options):
        """Stick and slip with located events."""
        out, t, mode = np.zeros((12, len(at))), 0.0, 2

        def margin(t, s, mode):
            force = s[F] - self.specimen(s[X], s[Z])[0]
            return self.dry + s[LEVEL] - abs(force)

        def speed(t, s, mode):
            return self.rhs(t, s, mode)[X]

        margin.terminal, margin.direction = True, -1
        speed.terminal = True
        done = 0
        while done < len(at):
            speed.direction = -mode if mode != 2 else 0
            event = margin if mode == 2 else speed
            s = solve_ivp(
                self.rhs,
                (t, at[-1] + 1e-9),
                state,
                dense_output=True,
                args=(mode,),
                events=event,
                **options,
            )
            assert s.success, s.message
            last = int(np.searchsorted(at, s.t[-1], side='right'))
            out[:, done:last] = s.sol(at[done:last])
            done, t, state = last, s.t[-1], s.y[:, -1].copy()
            if mode == 2:
                force = state[F] - self.specimen(state[X], state[Z])[0]
                mode = int(np.sign(force))
            else:
                mode = 2
                # Start just inside the cone: the event must not be found at once.
                state[F] -= 1e-9 * self.dry * np.sign(state[F] - self.specimen(*state[[X, Z]])[0])
        return out

    def sensed(self, at, states, fine):
        """What the record shows: play on a fine grid, lag, offsets."""
        x = states[Y] if self.p['sensor_lag'] > 0.0 else self.seen(states)
        half = self.p['backlash']
        if half > 0.0:
            y = np.empty_like(x)
            last = 0.0
            for i, position in enumerate(x):
                last = min(max(last, position - half), position + half)
                y[i] = last
            x = y
        return np.array(
            [self.transducer(*shown) for shown in zip(at[::fine], x[::fine], strict=True)]
        )
