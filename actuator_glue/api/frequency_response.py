"""Frequency response of a calibrated actuator: gain, phase and delay with 95 % bands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from actuator_glue.api.drawn import Drawn
from actuator_glue.errors import InputError
from actuator_glue.given import vector
from actuator_glue.hybrid.actuator import actuator, table_of
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

DEFAULT = (0.1, 30.0, 200)  # Hz: from, to, how many
_BANDS = 120  # of equal ratio, from one line of the spectrum to the highest
_TAPER = 0.05  # share of a record that fades in and out
_COHERENT = 0.95  # what of the measured displacement the command must explain
_EXCITED = 1e-3  # share of the command's greatest density


class Limits(NamedTuple):
    """Median and 95 % band over the draws, shape (f,) each."""

    median: Array
    lower: Array
    upper: Array


class MeasuredResponse(NamedTuple):
    """What a record shows at the frequencies that it excited, shape (g,) each."""

    frequency: Array
    gain: Array
    phase: Array


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrequencyResponse:
    """Displacement over command, Eq. (2a) with the linear effects of the model.

    Attributes:
        frequency: shape (f,) [Hz].
        gain: displacement over command [1].
        phase: lead of the displacement with all its turns from 0 Hz on [degrees].
        delay: -phase over angular frequency [s].
        stiffness: of the specimen [N/m].
        left_out: effects of the model that no linear response has.
        measured: of the record, where one was given: cross spectrum over the command's spectrum
            in narrow bands that the command moved in, and explains 95 % of the displacement in.
    """

    frequency: Array
    gain: Limits
    phase: Limits
    delay: Limits
    stiffness: float
    left_out: tuple[str, ...] = ()
    measured: MeasuredResponse | None = None

    def __repr__(self) -> str:
        low, high = self.frequency[[0, -1]]
        rest = f', without {", ".join(self.left_out)}' if self.left_out else ''
        return (
            f'FrequencyResponse({low:.3g} to {high:.3g} Hz, {self.stiffness:g} N/m: gain '
            f'{self.gain.median[0]:.4g} to {self.gain.median[-1]:.4g}, delay '
            f'{1e3 * self.delay.median[0]:.3g} to {1e3 * self.delay.median[-1]:.3g} ms{rest})'
        )


def frequency_response(
    of: Drawn, stiffness: float, frequencies: ArrayLike | None = None
) -> FrequencyResponse:
    """Return the continuous response x/u of draws.

    Args:
        of: the draws.
        stiffness: of the specimen [N/m].
        frequencies: shape (f,) [Hz]; None for 0.1 to 30 Hz.

    Raises:
        InputError: frequencies that are not positive.
    """
    given = np.geomspace(*DEFAULT) if frequencies is None else frequencies
    hertz = np.atleast_1d(vector(given, 'frequencies'))
    if hertz.ndim != 1 or not hertz.size or not ((hertz > 0.0) & np.isfinite(hertz)).all():
        raise InputError('frequencies must be positive numbers [Hz]')
    hertz = np.sort(hertz)
    gain, phase = _response(of, stiffness, hertz)
    return _limits(gain, phase, hertz, of.structure, stiffness)


def recorded_response(of: Drawn, record: Record) -> FrequencyResponse:
    """Return the response that draws expect between the samples of a record, and the record's own.

    A command that is held from sample to sample lags by half a period more: that is in both.

    Args:
        of: the draws.
        record: the test; its stiffness must be known.

    Raises:
        InputError: a record that excites no frequency.
    """
    measured = measured_response(record)
    highest = min(1.5 * float(measured.frequency[-1]), 0.45 * record.rate)
    hertz = np.sort(np.geomspace(float(measured.frequency[0]), highest, DEFAULT[2]))
    stiffness = record.known_stiffness()

    def expected(at: Array) -> tuple[Array, Array]:
        held = np.sinc(at * record.period) ** (2 if record.hold == 'linear' else 1)
        if record.hold == 'zoh':
            held = held * np.exp(-1j * np.pi * at * record.period)
        gain, phase = _response(of, stiffness, at)
        # A hold turns by less than half a turn at every frequency: its angle is all of it.
        return gain * np.abs(held), phase + np.angle(held)

    # Turns below its lowest frequency are in no record: they are those of the model.
    lowest = float(np.median(np.degrees(expected(measured.frequency[:1])[1])))
    turns = np.rint((lowest - measured.phase[0]) / 360.0)
    measured = measured._replace(phase=measured.phase + 360.0 * turns)
    gain, phase = expected(hertz)
    return _limits(gain, phase, hertz, of.structure, stiffness, measured)


def _response(of: Drawn, stiffness: float, hertz: Array) -> tuple[Array, Array]:
    """Return gain and phase [rad] of what the recording transducer shows, (m, f) each."""
    table, model = table_of(of.draws, of.names, of.structure), of.structure
    k = np.full(len(table), float(stiffness))
    linear = actuator(table, model.names, model.entries, k)
    w = 2.0 * np.pi * hertz
    seen = np.broadcast_to(linear.shown, linear.system.C.shape)
    recorded = linear.system._replace(C=seen)
    answer = recorded.response(np.broadcast_to(1j * w, (len(table), len(w))))
    # A delay turns by what it is: its angle alone, of one frequency, would hide whole turns.
    return np.abs(answer), recorded.phase(w, answer) - w * linear.delay[:, None]


def _limits(
    gain: Array,
    phase: Array,
    hertz: Array,
    structure: Structure,
    stiffness: float,
    measured: MeasuredResponse | None = None,
) -> FrequencyResponse:
    return FrequencyResponse(
        frequency=hertz,
        gain=_over_draws(gain),
        phase=_over_draws(np.degrees(phase)),
        delay=_over_draws(-phase / (2.0 * np.pi * hertz)),
        stiffness=float(stiffness),
        left_out=tuple(e.name for e in structure.entries if not e.linear),
        measured=measured,
    )


def _over_draws(values: Array) -> Limits:
    lower, median, upper = np.quantile(values, (0.025, 0.5, 0.975), axis=0)
    return Limits(median, lower, upper)


def measured_response(record: Record) -> MeasuredResponse:
    """Return gain and phase [degrees] of a record at the frequencies that its command excited.

    The phase is within half a turn at the lowest of them, and goes on from there.

    Raises:
        InputError: the displacement follows the command at no frequency.
    """
    taper = scipy.signal.windows.tukey(len(record), _TAPER)
    hertz = np.fft.rfftfreq(len(record), record.period)[1:]
    u, x = (
        np.fft.rfft(taper * (channel - channel.mean()))[1:]
        for channel in (record.command, record.measured)
    )
    edges = np.geomspace(hertz[0], hertz[-1], 1 + _BANDS)
    lines = np.minimum(np.searchsorted(edges, hertz, side='right') - 1, _BANDS - 1)

    def within(values: Array) -> Array:
        return np.asarray(np.bincount(lines, values, _BANDS), dtype=np.float64)

    cross = u.conj() * x
    power, answer = within(np.abs(u) ** 2), within(np.abs(x) ** 2)
    count = np.bincount(lines, minlength=_BANDS)
    with np.errstate(all='ignore'):
        response = (within(cross.real) + 1j * within(cross.imag)) / power
        coherence = np.abs(response) ** 2 * power / answer
        middle = within(hertz * np.abs(u) ** 2) / power
        density = power / count
    # A single line is always coherent.
    used = (count >= 2) & (coherence >= _COHERENT) & (density >= _EXCITED * np.nanmax(density))
    if used.sum() < 2:
        raise InputError(
            f'{record.source or "the record"}: the displacement follows the command at no '
            'frequency; a response needs a command that moves over a band, as a sweep does'
        )
    turns = np.unwrap(np.angle(response[used]))
    turns -= 2.0 * np.pi * np.rint(turns[0] / (2.0 * np.pi))
    return MeasuredResponse(middle[used], np.abs(response[used]), np.degrees(turns))


def title(of: FrequencyResponse, name: str = '') -> str:
    """Return what a picture of a response is of."""
    told = f'{name}: ' if name else ''
    told += 'free' if of.stiffness == 0.0 else f'k = {of.stiffness / 1e3:g} kN/m'
    return f'{told}, linear part' if of.left_out else told
