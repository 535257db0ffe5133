"""Samples that are given twice: the noise of a channel is never the same in two tests.

Two tests of one command differ by noise. Where two measured channels agree sample for sample
within what they are written with, one is a copy of the other or a part of it: with fewer digits,
in another unit, cut out, or with every second sample.
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
    for i, record in enumerate(records):
        for stretch in (one for many in sketches for one in many):
            if any(
                _same(record.measured, stretch, at) for at in _places(record.measured, stretch)
            ):
                raise InputError(
                    f'{where(record, i + 1)} holds the same samples as a record of which the '
                    f'prior from {prior} was made, and would count twice; give other records, or '
                    'no prior'
                )


def _repeated(one: Record, other: Record) -> bool:
    """Whether two records hold the same samples, at their rates or thinned to the lower one."""
    fine, coarse = (one, other) if one.period <= other.period else (other, one)
    every = round(coarse.period / fine.period)
    thinned = range(every) if 1 < every <= _MOST_EVERY else ()
    return _agree(fine.measured, coarse.measured) or any(
        _agree(fine.measured[first::every], coarse.measured) for first in thinned
    )


def _agree(one: Array, other: Array) -> bool:
    """Whether two channels are the same wherever both have samples, at some shift."""
    return any(
        _same(one, other, at - part.start)
        for part in _parts(other)
        for at in _places(one, other[part])
    )


def _parts(values: Array) -> Iterator[slice]:
    """Yield stretches of a channel, spread over it."""
    length = min(_LENGTH, len(values))
    starts = np.linspace(0, len(values) - length, _PIECES).round().astype(int)
    for start in np.unique(starts).tolist():
        yield slice(start, start + length)


def _places(values: Array, stretch: Array) -> Iterator[int]:
    """Yield where a stretch is nearest to a channel; nothing where it is longer."""
    if len(stretch) > len(values) or not _changes(stretch) >= _FEWEST:
        return
    zero = float(stretch.mean())  # less of the sums cancels
    values, stretch = values - zero, stretch - zero
    sums = np.cumsum(np.append(0.0, values**2))
    squares = sums[len(stretch) :] - sums[: -len(stretch)]
    yield int(
        np.argmin(squares - 2.0 * scipy.signal.correlate(values, stretch, 'valid', method='fft'))
    )


def _same(one: Array, other: Array, shift: int) -> bool:
    """Whether all samples that both have, `other` after `shift` of `one`, are the same.

    That is within half of the coarser step to which they are written.
    """
    begin, end = max(shift, 0), min(len(one), shift + len(other))
    a, b = one[begin:end], other[begin - shift : end - shift]
    if min(_changes(a), _changes(b)) < _FEWEST:
        return False
    apart = np.abs(a - b)
    if not apart.any():
        return True
    if float(np.median(apart)) > _NEAR * float(b.std()):
        return False
    return any(
        bool((apart <= (0.5 + _TIES) * _step(written) + _SINGLE * np.abs(written)).all())
        for written in (a, b)
    )


def _changes(values: Array) -> int:
    return int(np.count_nonzero(np.diff(values)))


def _step(values: Array) -> Array:
    """Return the step to which each value is written, (n,): of the channel, or of its digits [m].

    Zero where neither shows.
    """
    least = float(np.diff(np.unique(values)).min())
    counts = (values - values[0]) / least
    even = float(np.abs(counts - np.rint(counts)).max()) < 1e-3
    steps = [np.full(len(values), least if even else 0.0)]
    for unit in _UNITS:
        told = np.maximum(np.abs(values) / unit, 1e-300)
        place = np.floor(np.log10(told * (1.0 + _TIES)))
        for digits in _DIGITS:
            step = 10.0 ** (place - digits + 1)
            if float(np.abs(told / step - np.rint(told / step)).max()) < 1e-3:
                steps.append(unit * step)
                break
    return np.asarray(np.max(steps, axis=0))
