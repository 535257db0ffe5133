"""Two files of one test, the command in one and the response in the other, as one record."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np
import scipy
from numpy.typing import NDArray

from actuator_glue.errors import InputError
from actuator_glue.given import one_of
from actuator_glue.io.channel_map import ChannelMap, channel_map_given
from actuator_glue.io.laboratory import Channels, channels_of
from actuator_glue.io.remarks import Note, warn_caller
from actuator_glue.io.resample import Resample, at_times, evenly, rate_and_way
from actuator_glue.records import Array, Hold, Record

By: TypeAlias = Literal['time', 'correlation']
Spectrum: TypeAlias = NDArray[np.complex128]

_ABSOLUTE = 10**17  # ns: times that count from 1970 are beyond it, those of a test never
_SHORTEST = 64  # samples that both files must have in common
_ALIKE = 0.5  # correlation below which two files are not of one test
_AS_ALIKE = 0.98  # of the highest peak: another one as high fits as well
_COARSE = 200.0  # Hz at which files are laid beside each other first
_EXPLAINED = 0.9  # share of a response that must follow from the command to tell its time
_LATEST = 0.25  # s; no actuator follows later
_LEAD = 5e-3  # s by which a response may lead, as of a compensated command
_MOST = 1 << 18  # samples by which the fine time is told
_POWER = 1e-4  # of the strongest line of the command: weaker ones tell nothing
_WIDE = 0.15  # spread of the command's frequencies over their mean: a sine tells no dead time
_LINES = 1500  # of the spectrum, the strongest, that are fitted
_ENDS = 3  # terms of what moves at both ends
# Poles of the second order from which its fit begins [rad/s]: of slow actuators and of quick ones.
_STARTS = ((10.0, 30.0), (30.0, 30.0), (10.0, 100.0), (30.0, 100.0))
# What beta_1 of servo-valves is [1/s], and the standard deviation of its logarithm.
_VALVE, _VALVE_SPREAD = 100.0, 0.9
_ROUNDS = 5  # most rounds of aligning the two channels
_SAME = 2e-3  # s: a shift below this ends the rounds


@dataclass(frozen=True, slots=True)
class _Late:
    """By how much one channel is later than another.

    Attributes:
        seconds: [s].
        deviation: standard deviation of it [s]; infinite where only one frequency is excited.
        explained: share of the second channel that the first explains with this delay [1].
    """

    seconds: float
    deviation: float
    explained: float


class _Spectra(NamedTuple):
    """Spectra of two channels at some angular frequencies [rad/s], each of shape (n,)."""

    first: Spectrum
    second: Spectrum
    omega: Array


def join(
    command_file: Path | str,
    response_file: Path | str,
    *,
    by: By = 'time',
    channels: ChannelMap | Path | str | None = None,
    stiffness: float | None = None,
    hold: Hold | None = None,
    resample: Resample | None = None,
    warn: Note = warn_caller,
) -> Record:
    """Return the record of a test whose command is in one file and whose response in another.

    The record has the samples of the response; the command is taken at their times: straight
    between its samples, or held where `hold` is 'zoh'.

    Where the clocks differ, `by='correlation'` lays one file beside the other: by a channel that
    both have, or else by the dynamics that Eq. (2) allows between command and response - a second
    order without dead time, so that dead time in the loop is taken for a difference of the clocks.

    Args:
        command_file: with times and the command.
        response_file: with times, the measured displacement and perhaps the force.
        by: 'time' where both files have the same clock, else 'correlation'.
        channels: channel map that names the columns of both files; None where the names of the
            columns say what they are.
        stiffness: specimen stiffness [N/m]; None for what the map or the response says.
        hold: how the command runs between its samples; None for straight between them.
        resample: samples per second [Hz] to which a jittered clock of the response is made even;
            `(27.0, 'lines')` for straight lines between samples.
        warn: called with a line that tells how the files were joined and how sure that is.

    Raises:
        InputError: a file or channel that cannot be used, no times in common, clocks that cannot
            be the same, or files that are not alike.

    Example:
        >>> join('cmd.csv', 'daq.csv', by='correlation', stiffness=0.0)  # doctest: +SKIP
    """
    one_of(by, 'joining by', get_args(By))
    way = None if resample is None else rate_and_way(resample)
    channels = channel_map_given(channels)
    command = _part(command_file, channels, 'command')
    response = _part(response_file, channels, 'measured')
    times = command.values['time'], response.values['time']
    where = f'{command_file} and {response_file}'
    if by == 'time':
        between, told = _by_time(command, response, where)
    else:
        between, told = _by_correlation(command, response, where)
    at = times[1] - times[1][0] + between  # on the clock of the command
    passed = times[0] - times[0][0]
    inside = (at >= passed[0]) & (at <= passed[-1])
    if np.count_nonzero(inside) < _SHORTEST:
        raise InputError(
            f'{where}: {np.count_nonzero(inside)} samples of the response lie in the times of the '
            'command; where the clocks differ, join by correlation'
        )
    values = {r: v[inside] for r, v in response.values.items() if r in ('measured', 'force')}
    held = hold == 'zoh'
    values['command'] = at_times(passed, command.values['command'], at[inside], held=held)
    source = f'{response_file} (command of {Path(command_file).name})'
    values['time'] = times[1][inside]
    first = round((float(values['time'][0]) - float(times[1][0])) * 1e9)
    values, period, made = evenly(values, way, str(response_file))
    if made is not None:
        warn(f'{response_file}: {made.told()}')
        source = f'{source} ({made.name()})'
    how = 'held' if held else 'straight between its samples'
    warn(f'{where}: {told}; the command is taken {how} at the times of the response')
    if command.motion != response.motion:
        raise InputError(
            f'{where}: the command is in {command.motion} and the response in {response.motion}; '
            'give a `scale` in a channel map'
        )
    said = response.stiffness if response.stiffness is not None else command.stiffness
    return Record(
        command=values['command'],
        measured=values['measured'],
        force=values.get('force'),
        period=period,
        stiffness=said if stiffness is None else stiffness,
        start_ns=max(_first_ns(response) + first, 0),
        hold=hold or 'linear',
        actuator=response.actuator,
        source=source,
        motion=response.motion,
    )


def _part(path: Path | str, channels: ChannelMap | None, role: str) -> Channels:
    """Return the channels of one of both files, with times.

    Raises:
        InputError: as `channels_of`, or times that are no numbers, or do not go up.
    """
    found = channels_of(path, channels, needed=('time', role))
    if found.period is not None and 'time' not in found.values:
        count = len(found.values[role])
        found.values['time'] = np.arange(count, dtype=np.float64) * found.period
    for name, values in found.values.items():
        if not np.isfinite(values).all():
            at = int((~np.isfinite(values)).argmax())
            raise InputError(f'{path}: {name} is NaN or infinite at sample {at}')
    if len(found.values['time']) < _SHORTEST:
        raise InputError(f'{path}: {len(found.values["time"])} samples; too few to be joined')
    steps = np.diff(found.values['time'])
    # Stamps of a response may stand still where an even clock gives them.
    if steps.sum() <= 0.0 or (role == 'command' and steps.min() <= 0.0):
        raise InputError(f'{path}: time does not go up; sort the file, or cut it there')
    return found


def _first_ns(part: Channels) -> int:
    return part.start_ns + round(float(part.values['time'][0]) * 1e9)


def _by_time(command: Channels, response: Channels, where: str) -> tuple[float, str]:
    """Return when the response begins on the command's clock [s after its first], and words.

    Raises:
        InputError: one clock counts from 1970 and the other does not, or the response leads.
    """
    firsts = _first_ns(command), _first_ns(response)
    if (firsts[0] > _ABSOLUTE) != (firsts[1] > _ABSOLUTE):
        raise InputError(
            f'{where}: one counts its times from a date and the other does not; join by '
            'correlation'
        )
    between = (firsts[1] - firsts[0]) * 1e-9
    try:
        apart = between - _coarse(command, response, 'command', 'measured', where)
    except InputError:  # a test that repeats, or is cut: its times are believed
        return between, 'joined by their times'
    if not -_LEAD - _LATEST <= apart <= 2.0 * _LATEST:
        raise InputError(
            f'{where}: by their times the response is {apart:.2f} s behind the command, as no '
            'actuator is: their clocks differ; join by correlation'
        )
    late = _late(command, response, 'command', 'measured', between)
    if late is None or not np.isfinite(late.deviation) or late.explained < _EXPLAINED:
        return between, 'joined by their times'
    return between, (
        f'joined by their times, by which {1e3 * late.seconds:.3g} +- {_milli(late.deviation)} ms '
        'of the response are dead time (standard deviation)'
    )


def _by_correlation(command: Channels, response: Channels, where: str) -> tuple[float, str]:
    """Return when the response begins on the command's clock [s after its first], and words.

    Raises:
        InputError: not alike, or alike at several places.
    """
    both = command.values.keys() & response.values.keys()
    shared = next((r for r in ('command', 'measured') if r in both), None)
    roles = (shared, shared) if shared else ('command', 'measured')
    coarse = _coarse(command, response, *roles, where)
    late = _late(command, response, *roles, coarse, same=shared is not None)
    if late is None or not np.isfinite(late.deviation):
        raise InputError(f'{where}: too few samples or frequencies in common; join by time')
    seconds = coarse - late.seconds
    by = f'{shared}, which both hold' if shared else 'correlation'
    told = (
        f'joined by {by}: the response begins {seconds:.4f} s after the command, '
        f'+- {_milli(late.deviation)} ms (standard deviation)'
    )
    if not shared:
        told += (
            ' if nothing in the loop is dead time: a delay would be taken for a difference of the '
            'clocks, and is not known from these files'
        )
    return seconds, told


def _milli(seconds: float) -> str:
    return f'{1e3 * seconds:.2g}'


def _on(part: Channels, role: str, rate: float) -> Array:
    """Return a channel at `rate` samples per second, from its first sample on, less its mean."""
    time = part.values['time'] - part.values['time'][0]
    grid = np.arange(0.0, float(time[-1]), 1.0 / rate)
    values = np.interp(grid, time, part.values[role])
    return np.asarray(values - values.mean())


def _rate(part: Channels) -> float:
    time = part.values['time']
    return (len(time) - 1) / float(time[-1] - time[0])


def _coarse(command: Channels, response: Channels, one: str, other: str, where: str) -> float:
    """Return by how much the second file begins after the first, by correlation [s].

    At least half of the shorter one lies within the other.

    Raises:
        InputError: not alike, or alike at several places.
    """
    rate = min(_COARSE, _rate(command), _rate(response))
    a, b = _on(command, one, rate), _on(response, other, rate)
    cross = scipy.signal.correlate(a, b, method='fft')  # of a later than b by so many samples
    ones = [np.ones(len(v)) for v in (a, b)]
    power = scipy.signal.correlate(a**2, ones[1], method='fft') * scipy.signal.correlate(
        ones[0], b**2, method='fft'
    )
    lags = np.arange(-(len(b) - 1), len(a))
    common = np.minimum(lags + len(b), len(a)) - np.maximum(lags, 0)
    likeness = np.abs(cross) / np.sqrt(np.maximum(power, 1e-9 * float(power.max())))
    likeness[common < 0.5 * min(len(a), len(b))] = 0.0
    at = int(likeness.argmax())
    if likeness[at] < _ALIKE:
        raise InputError(
            f'{where}: {one} and {other} are not alike anywhere (correlation {likeness[at]:.2f}): '
            'they are not of one test, or not what they are called'
        )
    peaks, _ = scipy.signal.find_peaks(likeness, height=_AS_ALIKE * likeness[at])
    others = peaks[np.abs(peaks - at) > 0.05 * rate]
    if len(others):
        apart = np.abs(lags[others] - lags[at]) / rate
        raise InputError(
            f'{where}: the test repeats itself: {one} and {other} are as alike '
            f'{apart.min():.3g} s apart; join by time, or by a test that does not repeat'
        )
    return float(lags[at]) / rate


def _late(
    command: Channels,
    response: Channels,
    one: str,
    other: str,
    between: float,
    *,
    same: bool = False,
) -> _Late | None:
    """Return by how much the second channel is late where its file begins `between` s later.

    Args:
        command: file of the first channel.
        response: file of the second channel.
        one: role of the first channel.
        other: role of the second channel.
        between: when the second file begins on the clock of the first [s after its first].
        same: the channels are of one quantity; else a second order and a time lead from the first
            to the second.
    """
    rate = min(_rate(command), _rate(response))
    a, b = _on(command, one, rate), _on(response, other, rate)
    late = noise = deviation = cost = 0.0
    spectra: _Spectra | None = None
    # Aligned by likeness alone, a response begins before the command that moves it.
    for turn in range(_ROUNDS):
        shift = round((between - late) * rate)
        left = between - late - shift / rate  # remainder beyond whole samples
        first, second = a[max(shift, 0) :], b[max(-shift, 0) :]
        count = min(len(first), len(second), _MOST)
        spectra = None if count < _SHORTEST else _spectra(first[:count], second[:count], rate)
        if spectra is None:
            return None
        starts = (None,) if same else _STARTS
        fits = [_fitted(spectra, start, noise) for start in starts]
        seconds, deviation, cost, noise = min(fits, key=lambda f: f[2])
        late += seconds + left
        if turn and abs(seconds + left) < _SAME:
            break
    if spectra and not same:
        power = np.abs(spectra.first) ** 2
        mean = float(np.average(spectra.omega, weights=power))
        spread = float(np.sqrt(np.average((spectra.omega - mean) ** 2, weights=power)))
        # Whether the command is held or runs straight is half a sample.
        deviation = float(np.hypot(deviation, 0.5 / _rate(command)))
        deviation = deviation if spread > _WIDE * mean else np.inf
    return _Late(late, deviation, 1.0 - 2.0 * cost)


def _spectra(first: Array, second: Array, rate: float) -> _Spectra | None:
    """Return the spectra of two channels where the first is strong; None where one is at rest."""
    u, y = (np.asarray(np.fft.rfft(v - v.mean())) for v in (first, second))
    size = np.abs(u)
    size[0] = 0.0
    if not size.max() > 0.0 or not np.abs(y[1:]).max() > 0.0:
        return None
    strong = np.argsort(-size)[:_LINES]
    strong = strong[size[strong] ** 2 > _POWER * size.max() ** 2]
    omega = 2.0 * np.pi * np.fft.rfftfreq(len(first), 1.0 / rate)
    return _Spectra(u[strong], y[strong], np.asarray(omega[strong]))


def _fitted(
    spectra: _Spectra, poles: tuple[float, float] | None, noise: float
) -> tuple[float, float, float, float]:
    """Return the time between two spectra [s], its deviation, the sum of squares, and the noise.

    The denominator's first coefficient is the valve's beta_1 (Eq. (2a) with little leakage), about
    which a slow test says nothing: then it has the usual value and spread of servo-valves.

    Transients at both ends of the spectra are a polynomial over the same poles, estimated too
    (Pintelon and Schoukens, *System Identification: A Frequency Domain Approach*, 2.6.3).

    Args:
        spectra: spectra of both channels.
        poles: of a second order, where the search begins [rad/s]; None for a factor alone.
        noise: of the second as an earlier fit left it, over its norm; 0 where it is not known.
    """
    u, y, omega = spectra
    s = 1j * omega
    ends = (s / omega.max())[:, None] ** np.arange(_ENDS)
    aim = np.concatenate([y.real, y.imag]) / float(np.linalg.norm(y))

    def residual(p: Array) -> Array:
        first, zeroth = np.exp(p[1:]) if poles else (0.0, 1.0)
        below = s * s + first * s + zeroth if poles else np.ones_like(s)
        columns = np.column_stack([u * np.exp(-s * p[0]), ends]) / below[:, None]
        terms = np.concatenate([columns.real, columns.imag])
        terms /= np.linalg.norm(terms, axis=0)
        left = aim - terms @ np.linalg.lstsq(terms, aim, rcond=None)[0]
        known = noise * (p[1:2] - np.log(_VALVE)) / _VALVE_SPREAD
        return np.concatenate([left, known])

    guess = [0.0]
    if poles:
        one, other = poles
        guess = [-1.0 / one - 1.0 / other, np.log(one + other), np.log(one * other)]
    scales = [1e-2, 1.0, 1.0][: len(guess)]
    close = 1e-10
    fit = scipy.optimize.least_squares(
        residual, guess, x_scale=scales, ftol=close, xtol=close, gtol=close
    )
    freedom = max(len(aim) - len(guess) - 1 - _ENDS, 1)
    jacobian = np.asarray(fit.jac, dtype=np.float64)
    variance = 2.0 * float(fit.cost) / freedom
    spread = np.linalg.pinv(jacobian.T @ jacobian) * variance
    return float(fit.x[0]), float(np.sqrt(spread[0, 0])), float(fit.cost), float(np.sqrt(variance))
