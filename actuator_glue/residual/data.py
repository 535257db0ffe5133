"""The samples a diagnosis fits: records with a mask of counted samples, simulated in one go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from actuator_glue.model.exact import Initial
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array, Record

Mask = NDArray[np.bool_]


class Model(Protocol):
    """What a structure must offer here (see actuator_glue.model.structure.Structure)."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters in the order of theta's columns."""

    def simulate(self, theta: Array, record: Record, *, initial: Initial = 'rest') -> Array:
        """Free-run sensor output (m, n) [m] of theta (m, p)."""


@dataclass(frozen=True)
class Data:
    """Records and the samples of each that count.

    Attributes:
        records: the records, simulated whole.
        masks: per record, which samples count, (n,) bool.
        initials: per record, the state it starts from: 'rest' or 'measured'.
        strides: per record, how many samples lie between counted ones.
    """

    records: tuple[Record, ...]
    masks: tuple[Mask, ...]
    initials: tuple[Initial, ...]
    strides: tuple[int, ...]

    @classmethod
    def whole(cls, records: Sequence[Record]) -> Data:
        """Count all samples; every record starts from rest."""
        ones = tuple(np.ones(len(r), dtype=np.bool_) for r in records)
        initials: list[Initial] = ['rest' for _ in ones]
        return cls(tuple(records), ones, tuple(initials), (1,) * len(ones))

    @cached_property
    def periods(self) -> tuple[float, ...]:
        """Time between counted samples of each record [s]."""
        return tuple(r.period * s for r, s in zip(self.records, self.strides, strict=True))

    @cached_property
    def times(self) -> tuple[Array, ...]:
        """Times of the counted samples of each record [s]."""
        return tuple(r.time[m] for r, m in zip(self.records, self.masks, strict=True))

    @cached_property
    def target(self) -> Array:
        """Measured displacement of the counted samples, records joined, (N,) [m]."""
        pairs = zip(self.records, self.masks, strict=True)
        return np.concatenate([record.measured[mask] for record, mask in pairs])

    @cached_property
    def parts(self) -> tuple[slice, ...]:
        """Where each record's counted samples lie in the joined vectors."""
        ends = np.cumsum([int(mask.sum()) for mask in self.masks])
        return tuple(
            slice(int(e) - int(m.sum()), int(e)) for e, m in zip(ends, self.masks, strict=True)
        )

    def simulate(self, model: Model, theta: Array) -> Array:
        """Simulate all records free-run and return the counted samples (m, N) [m]."""
        table = np.atleast_2d(theta)
        out = np.empty((len(table), self.target.size))
        rows = zip(self.records, self.initials, self.masks, self.parts, strict=True)
        for record, initial, mask, part in rows:
            out[:, part] = model.simulate(table, record, initial=initial)[:, mask]
        return out

    def split(self, errors: Array) -> list[Array]:
        """Cut a joined vector (N,) back into records."""
        return [errors[part] for part in self.parts]
