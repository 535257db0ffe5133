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
_LOOK = 1000  # values that are looked at before all of a channel are


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
        if any(_same(record.measured, known[n], at) for n, at in _places(record.measured, known)):
            raise InputError(
                f'{where(record, i + 1)} holds the same samples as a record of which the prior '
                f'from {prior} was made, and would count twice; give other records, or no prior'
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
    parts = list(_parts(other))
    places = _places(one, [other[part] for part in parts])
    return any(_same(one, other, at - parts[n].start) for n, at in places)


def _parts(values: Array) -> Iterator[slice]:
    """Yield stretches of a channel, spread over it."""
    length = min(_LENGTH, len(values))
    starts = np.linspace(0, len(values) - length, _PIECES).round().astype(int)
    for start in np.unique(starts).tolist():
        yield slice(start, start + length)


def _places(values: Array, stretches: Sequence[Array]) -> Iterator[tuple[int, int]]:
    """Yield where each of some stretches is nearest to a channel, with the stretch's number.

    None of those that are longer than the channel, or rest.
    """
    zero = float(values.mean())  # less of the sums cancels
    values = values - zero
    sums = np.cumsum(np.append(0.0, values**2))
    for n, stretch in enumerate(stretches):
        size = len(stretch)
        if size <= len(values) and _changes(stretch) >= _FEWEST:
            # Overlap-add: a transform of the whole channel would take ten times as long.
            products = scipy.signal.oaconvolve(values, (stretch - zero)[::-1], 'valid')
            yield n, int(np.argmin(sums[size:] - sums[:-size] - 2.0 * products))


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


def _place(told: Array, digits: int) -> Array:
    """Return what one in the last of so many digits of each value is, (n,)."""
    first = np.floor(np.log10(told * (1.0 + _TIES)))
    return np.asarray(10.0 ** (first - digits + 1))


def _whole(counts: Array) -> bool:
    return float(np.abs(counts - np.rint(counts)).max()) < 1e-3
