"""Sums of simulation errors over records, by stepping through every sample."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actuator_glue.errors import InputError
from actuator_glue.model import kernel, kernel_lanes, linear
from actuator_glue.records import Array, Record

Initial: TypeAlias = Literal['rest', 'measured']


def settle_samples(records: Sequence[Record], settle: Sequence[int] | int) -> tuple[int, ...]:
    """Return the number of uncounted samples of every record.

    Raises:
        InputError: negative, or fewer than two samples of a record would count.
    """
    counts = (settle,) * len(records) if isinstance(settle, int) else tuple(settle)
    if len(counts) != len(records):
        raise InputError(f'{len(counts)} settle counts given for {len(records)} record(s)')
    for record, count in zip(records, counts, strict=True):
        if not 0 <= count <= len(record) - 2:
            raise InputError(
                f'{record.source or "record"}: settle of {count} samples leaves fewer than two '
                f'of {len(record)} to be counted; use a longer window or a shorter settle'
            )
    return tuple(int(count) for count in counts)


class ExactErrors:
    """Errors e = measured - simulated of Eq. (2a) for many thetas over one or more records.

    Args:
        records: tests fitted jointly, each with a known specimen stiffness.
        settle: samples at each record's beginning that are simulated but not counted; one
            number, or one per record.
        initial: state at the first sample: 'rest', or 'measured' from the first samples.

    Raises:
        InputError: no record, unknown stiffness or initial, settle too long.
    """

    def __init__(
        self,
        records: Sequence[Record],
        settle: Sequence[int] | int = 0,
        initial: Initial = 'rest',
    ) -> None:
        if not records:
            raise InputError('no record given; at least one is needed')
        if initial not in ('rest', 'measured'):
            raise InputError(f"initial state {initial!r} is unknown; use 'rest' or 'measured'")
        self.records = tuple(records)
        self.settle = settle_samples(self.records, settle)
        self.stiffness = tuple(record.known_stiffness() for record in self.records)
        self.starts: tuple[Array, ...] = tuple(
            np.array(linear.initial_state(r) if initial == 'measured' else (0.0, 0.0))
            for r in self.records
        )
        self.padded = tuple(linear.padded(record.command) for record in self.records)

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Counted samples of every record, shape (R,)."""
        pairs = zip(self.records, self.settle, strict=True)
        return np.array([len(record) - count for record, count in pairs], dtype=np.int64)

    def __call__(self, theta: ArrayLike) -> Array:
        """Return (sum of e, sum of e^2) per theta and record, (R, 2) or (m, R, 2) [m, m^2].

        Thetas whose response does not exist or diverges give NaN or infinity.

        Raises:
            InputError: theta is not (4,) or (m, 4).
        """
        table = linear.thetas(theta)
        out = np.empty((len(table), len(self.records), 2))
        for r in range(len(self.records)):
            out[:, r] = self.of_record(r, linear.systems(table, self.stiffness[r]))
        return out.reshape(*np.shape(theta)[:-1], len(self.records), 2)

    def of_record(self, r: int, systems: Array) -> Array:
        """Return (sum of e, sum of e^2) of systems a1, a0, b0 (m, 3) over one record, (m, 2)."""
        record = self.records[r]
        foh = record.hold == 'linear'
        out = np.empty((len(systems), 2))

        rows = kernel.discretise(systems, record.period, foh)
        start, settle = self.starts[r], self.settle[r]
        kernel_lanes.error_sums(rows, start, record.measured, self.padded[r], settle, foh, out)
        return out

    def residuals(self, theta: ArrayLike) -> list[Array]:
        """Return the counted errors of every record, shape (n_r,) or (m, n_r) each [m].

        Raises:
            InputError: theta is not (4,) or (m, 4).
        """
        out = []
        for r, record in enumerate(self.records):
            x = linear.simulate(
                theta,
                record.command,
                stiffness=self.stiffness[r],
                period=record.period,
                hold=record.hold,
                initial=(self.starts[r][0], self.starts[r][1]),
            )
            out.append((record.measured - x)[..., self.settle[r] :])
        return out
