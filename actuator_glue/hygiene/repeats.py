"""Samples that are given twice: the noise of a channel is never the same in two tests.

Two tests of one command differ by noise. Where two measured channels agree sample for sample
within what they are written with, one is a copy of the other or a part of it: with fewer digits,
in another unit, cut out, or with every second sample. Another zero, sign or gain makes no other
test either, as long as there is noise that both share: without any, a linear machine gives one
motion in all sizes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import scipy

from actuator_glue.errors import InputError
from actuator_glue.hygiene.checks import where
from actuator_glue.records import Array, Record

_PIECES, _LENGTH = 8, 500  # stretches by which a record is looked for, and samples of each
# New readings that must agree: with noise of a fifth of a step, of which less would be no channel
# of this world, each does so by chance in four of five cases, and so many once in 1e9 pairs.
_FEWEST = 100
_SINGLE = 2.0**-23  # relative step of single precision
_DIGITS = range(3, 8)  # significant digits of a table: fewer tell no motion, more are single
_MOST_EVERY = 10  # samples of which a thinner copy may have kept one
_UNITS = (1.0, 0.0254)  # m: digits are those of metres (and mm) or of inches
_NEAR = 0.05  # of the spread: no table is coarser, and most pairs of records end here
_TIES = 1e-6  # of a step: rounding errors of what is written and read
_LOOK = 1000  # values that are looked at before all of a channel are
_EXACT = 1e-9  # of the spread: rounding errors of another zero and gain
# Half steps that a value may be off besides, over the root of the number of values out of which
# zero and gain come: they are off by two thirds of one over that root.
_FITTED = 3.0
# Noise is what neither the samples before it nor the command foretell, of the spread of the
# motion: a machine without noise leaves less, a measurement more.
_NOISE = 2e-5
_SHARED = 0.5  # of the noise: what is left of it between copies; between two tests more than all
# Noise is seen in what is written if it is so much of a step: rounding alone leaves 0.29 of one.
_VISIBLE = 0.5
_BEFORE, _LAGS, _TAKEN = 8, 40, 4000  # samples of motion and command, and how many are foretold


def refuse_repeats(records: Sequence[Record], held: Sequence[Record] = ()) -> None:
    """Refuse records that hold the same samples: each would count twice, or judge itself.

    Raises:
        InputError: the samples measured of one record are in another, in fewer digits perhaps.
    """
    every = (*records, *held)
    for i, record in enumerate(every):
        for first in range(i):
            if not _repeated(every[first], record):
                continue
            names = where(every[first], first + 1), where(record, i + 1)
            if first < len(records) <= i:
                raise InputError(
                    f'{names[1]}, held out, holds the same samples as {names[0]}, which is '
                    'fitted: it would judge itself; hold out another record, or none'
                )
            raise InputError(
                f'{names[1]} holds the same samples as {names[0]} and would count twice; give '
                'each record once'
            )


def sketch(record: Record) -> Array:
    """Return stretches of what was measured, by which `refuse_known` finds a record (m, n) [m]."""
    return np.array([record.measured[part] for part in _parts(record.measured)])


def refuse_known(records: Sequence[Record], sketches: Sequence[Array], prior: str) -> None:
    """Refuse records of which a prior was made: what they tell would count twice.

    Args:
        records: as they were given.
        sketches: of the records of the prior, see `sketch`.
        prior: where it comes from, for messages.

    Raises:
        InputError: the samples of one of them are in a record.
    """
    known = [one for many in sketches for one in many]
    for i, record in enumerate(records):
        if any(
            _same(record.measured, known[n], at, record.command)
            for n, at in _places(record.measured, known)
        ):
            raise InputError(
                f'{where(record, i + 1)} holds the same samples as a record of which the prior '
                f'from {prior} was made, and would count twice; give other records, or no prior'
            )


def _repeated(one: Record, other: Record) -> bool:
    """Whether two records hold the same samples, at their rates or thinned to the lower one."""
    fine, coarse = (one, other) if one.period <= other.period else (other, one)
    every = round(coarse.period / fine.period)
    thinned = range(every) if 1 < every <= _MOST_EVERY else ()
    return _agree(fine.measured, coarse.measured, fine.command) or any(
        _agree(fine.measured[first::every], coarse.measured, fine.command[first::every])
        for first in thinned
    )


def _agree(one: Array, other: Array, command: Array) -> bool:
    """Whether two channels are the same wherever both have samples, at some shift.

    Args:
        one: measured, (n,) [m].
        other: measured, (m,) [m].
        command: what `one` followed, (n,) [m].
    """
    parts = list(_parts(other))
    places = _places(one, [other[part] for part in parts])
    seen: set[int] = set()
    for n, at in places:
        shift = at - parts[n].start
        if shift not in seen and _same(one, other, shift, command):
            return True
        seen.add(shift)
    return False


def _parts(values: Array) -> Iterator[slice]:
    """Yield stretches of a channel, spread over it."""
    length = min(_LENGTH, len(values))
    starts = np.linspace(0, len(values) - length, _PIECES).round().astype(int)
    for start in np.unique(starts).tolist():
        yield slice(start, start + length)


def _places(values: Array, stretches: Sequence[Array]) -> Iterator[tuple[int, int]]:
    """Yield where each of some stretches is most like a channel, with the stretch's number.

    In any size and about any zero. None of those that are longer than the channel, or rest.
    """
    values = values - float(values.mean())  # less of the sums cancels
    sums = np.cumsum(np.append(0.0, values))
    squares = np.cumsum(np.append(0.0, values**2))
    for n, stretch in enumerate(stretches):
        size = len(stretch)
        if size <= len(values) and _changes(stretch) >= _FEWEST:
            # Overlap-add: a transform of the whole channel would take ten times as long.
            like = scipy.signal.oaconvolve(values, (stretch - stretch.mean())[::-1], 'valid')
            spread = squares[size:] - squares[:-size] - (sums[size:] - sums[:-size]) ** 2 / size
            # What rests here is like anything, by its rounding errors.
            least = _EXACT * float(squares[-1]) / len(values) * size
            like *= like
            like /= np.maximum(spread, max(least, 1e-300))
            yield n, int(np.argmax(like))


def _same(one: Array, other: Array, shift: int, command: Array) -> bool:
    """Whether all samples that both have, `other` after `shift` of `one`, are the same.

    That is within half of the coarser step to which they are written; or as well about another
    zero and in another size, where they share their noise.
    """
    begin, end = max(shift, 0), min(len(one), shift + len(other))
    a, b = one[begin:end], other[begin - shift : end - shift]
    if min(_changes(a), _changes(b)) < _FEWEST:
        return False
    apart = np.abs(a - b)
    if not apart.any():
        return True
    if _near(apart, b) and any(_rounds(apart, written) for written in (a, b)):
        return True
    centred, other_centred = a - a.mean(), b - b.mean()
    gain = float(centred @ other_centred) / float(centred @ centred)
    apart = gain * centred - other_centred
    if gain == 0.0 or not _near(np.abs(apart), b):
        return False
    slack = _FITTED / np.sqrt(len(a))
    return (
        _rounds(np.abs(apart), b, slack) or _rounds(np.abs(apart) / abs(gain), a, slack)
    ) and _noise_is_shared(
        apart,
        other_centred,
        command[begin:end],
        step=float(np.median(np.maximum(_step(b), abs(gain) * _step(a)))),
    )


def _near(apart: Array, values: Array) -> bool:
    return float(np.median(apart)) <= _NEAR * float(values.std())


def _rounds(apart: Array, written: Array, slack: float = 0.0) -> bool:
    """Whether values are apart by no more than half of the step to which one of them is written.

    Args:
        apart: by how much, (n,) [m].
        written: that one of them, (n,) [m].
        slack: by how many half steps zero and gain may be off [1]; 0 where none were fitted.
    """

    def within(part: slice, step: Array) -> bool:
        rounded = (0.5 + _TIES) * step + _SINGLE * np.abs(written[part])
        if slack:  # of the largest values: their digits decide how well zero and gain are known
            rounded += slack * float(rounded.max()) + _EXACT * float(written.std())
        return bool((apart[part] <= rounded).all())

    # The step of a few values is no finer than that of all, and the largest is among these: most
    # pairs of tests end here.
    begin = max(0, int(np.abs(written).argmax()) - _LOOK // 2)
    first = slice(begin, begin + _LOOK)
    few = written[first]
    if np.ptp(few) > 0.0 and not within(first, np.maximum(_step(few), _least(few))):
        return False
    return within(slice(None), _step(written))


def _noise_is_shared(apart: Array, values: Array, command: Array, *, step: float) -> bool:
    """Whether two channels have one noise: it is far more than what is left between them.

    Noise is what neither earlier samples nor the command foretell; both are looked at through the
    filter that leaves the least of one. A coarse channel shows none: it is alike in two tests.

    Args:
        apart: one channel in the size of the other, less the other, (n,) [m].
        values: the other, about its mean, (n,) [m].
        command: what it followed, (n,) [m].
        step: to which the coarser one is written, in the size of the other [m].
    """
    begin = max(0, (len(values) - _TAKEN) // 2)
    part = slice(begin, begin + _TAKEN)
    y, r, u = values[part], apart[part], command[part] - command[part].mean()
    lags = min(_LAGS, len(y) // 10)
    ahead = len(y) - max(lags, _BEFORE)
    past = [y[len(y) - ahead - k : len(y) - k] for k in range(1, _BEFORE + 1)]
    driven = [u[len(u) - ahead - k : len(u) - k] for k in range(lags)]
    size = max(float(y.std()), 1e-300), max(float(u.std()), 1e-300)
    basis = np.column_stack([*(c / size[0] for c in past), *(c / size[1] for c in driven)])
    weights, *_ = np.linalg.lstsq(basis, y[-ahead:], rcond=None)
    noise = y[-ahead:] - basis @ weights
    own = [r[len(r) - ahead - k : len(r) - k] / size[0] for k in range(1, _BEFORE + 1)]
    left = r[-ahead:] - np.column_stack(own) @ weights[:_BEFORE]
    visible = max(_NOISE * size[0], _VISIBLE * step)
    return bool(noise.std() > visible and left.std() < _SHARED * noise.std())


def _changes(values: Array) -> int:
    return int(np.count_nonzero(np.diff(values)))


def _step(values: Array) -> Array:
    """Return the step to which each value is written, (n,): of the channel, or of its digits [m].

    Zero where neither shows.
    """
    least = _least(values)
    even = all(_whole((part - values[0]) / least) for part in (values[:_LOOK], values))
    steps = [np.full(len(values), least if even else 0.0)]
    for unit in _UNITS:
        told = np.maximum(np.abs(values) / unit, 1e-300)
        for digits in _DIGITS:
            # Most channels are in no such digits, as the first of their values show.
            if all(_whole(part / _place(part, digits)) for part in (told[:_LOOK], told)):
                steps.append(unit * _place(told, digits))
                break
    return np.asarray(np.max(steps, axis=0))


def _least(values: Array) -> float:
    """Return the least difference of two values."""
    return float(np.diff(np.unique(values)).min())


def _place(told: Array, digits: int) -> Array:
    """Return what one in the last of so many digits of each value is, (n,)."""
    first = np.floor(np.log10(told * (1.0 + _TIES)))
    return np.asarray(10.0 ** (first - digits + 1))


def _whole(counts: Array) -> bool:
    return float(np.abs(counts - np.rint(counts)).max()) < 1e-3
