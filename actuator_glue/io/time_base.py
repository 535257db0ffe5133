"""From a column of times to one sample period, or a clear reason why not."""

from __future__ import annotations

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.records import Array

# A sample may lie this far off the uniform grid, in periods: rounded time stamps do.
_TOLERANCE = 0.25
_ROUNDED = 'where times are only rounded, give the rate in a channel map (--channels MAP.yaml)'


def uniform_period(time: Array, where: str) -> float:
    """Return the period of uniformly sampled times [s].

    Rates that differ from a whole number of Hz by less than a twentieth of a sample over the
    whole record are taken as that number: the difference is rounding of the printed times.

    Args:
        time: times of the samples, shape (n,) [s].
        where: file, for messages.

    Raises:
        InputError: one sample, NaN, times that go back or stand still, a gap, jitter of more
            than a quarter of a period.
    """
    if len(time) < 2:
        raise InputError(f'{where}: {len(time)} sample(s); at least two are needed')
    bad = ~np.isfinite(time)
    if bad.any():
        raise InputError(f'{where}: time is NaN or infinite at sample {int(bad.argmax())}')
    steps = np.diff(time)
    back = steps <= 0.0
    if back.any():
        at = int(back.argmax())
        how = 'goes back' if steps[at] < 0.0 else 'stands still'
        hint = '' if steps[at] < 0.0 else f'; {_ROUNDED}'
        raise InputError(
            f'{where}: time {how} at sample {at + 1} ({time[at]:.9g} s, then '
            f'{time[at + 1]:.9g} s); sort the record, or cut it there{hint}'
        )
    typical = float(np.median(steps))
    gap = steps > 1.5 * typical
    at = int(gap.argmax())
    # A step between 1.5 and 1.75 periods may be two rounded stamps; a longer one is a gap.
    if gap.any() and steps[at] > (1.5 + _TOLERANCE) * typical:
        raise InputError(
            f'{where}: {steps[at]:.4g} s without samples after sample {at} ({time[at]:.9g} s); '
            'cut the record there and give the parts as records of their own'
        )
    del steps, gap  # of a long record they are large
    period = float((time[-1] - time[0]) / (len(time) - 1))
    off = time - time[0]
    off -= period * np.arange(len(time))
    np.abs(off, out=off)
    if float(off.max()) > _TOLERANCE * period:
        at = int(off.argmax())
        raise InputError(
            f'{where}: samples are not uniform in time: sample {at} is {off[at] / period:.2g} '
            f'periods off; resample the record; {_ROUNDED}'
        )
    return near_whole_rate(period, len(time))


def near_whole_rate(period: float, samples: int) -> float:
    """Return the period of a whole number of Hz where so many samples do not tell it from it."""
    whole = round(1.0 / period)
    if whole and abs(1.0 / whole - period) * samples < 0.05 * period:
        return 1.0 / whole
    return period
