"""The samples a diagnosis fits: records with a mask of counted samples, simulated in one go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array, Record

Mask = NDArray[np.bool_]


class Model(Protocol):
    """What a structure must offer here (see actuator_glue.model.structure.Structure)."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters in the order of theta's columns."""

    def simulate(self, theta: Array, record: Record) -> Array:
        """Free-run sensor output (m, n) [m] of theta (m, p)."""


@dataclass(frozen=True)
class Data:
    """Records and the samples of each that count.

    Attributes:
        records: the records, simulated whole.
        masks: per record, which samples count, (n,) bool.
    """

    records: tuple[Record, ...]
    masks: tuple[Mask, ...]

    @classmethod
    def whole(cls, records: Sequence[Record], settle: int = 0) -> Data:
        """Count all samples but the first `settle` of each record."""
        masks = []
        for record in records:
            mask = np.ones(len(record), dtype=np.bool_)
            mask[:settle] = False
            masks.append(mask)
        return cls(tuple(records), tuple(masks))

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
        for record, mask, part in zip(self.records, self.masks, self.parts, strict=True):
            out[:, part] = np.atleast_2d(model.simulate(table, record))[:, mask]
        return out

    def split(self, errors: Array) -> list[Array]:
        """Cut a joined vector (N,) back into records."""
        return [errors[part] for part in self.parts]
