"""A structure one of whose effects acts in some records only."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np

from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.exact import Initial
from actuator_glue.model.parameters import Parameter
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record, source_names


class OneRecord:
    """A structure one of whose effects acts in some records only.

    Args:
        structure: with all effects, learned terms among them.
        own: the effect that acts in `records` only.
        records: these records.
        among: all records, those held out as well, from which the names of these tell them.
    """

    def __init__(
        self,
        structure: Structure,
        own: str,
        records: tuple[Record, ...],
        among: Sequence[Record] = (),
    ) -> None:
        self._inner = structure
        self.own, self.records = own, records
        self._called = source_names(r.source for r in (*records, *among))
        self._off = [float(p.neutral or 0.0) for p in CATALOGUE[own].parameters]

    @property
    def scope(self) -> str:
        """Which effect acts in which record only."""
        return f'{self.own} in {self._called[self.records[0].source] or "one record"} only'

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those of the structure, in its order."""
        return self._inner.parameters

    def acting_in(self, records: Sequence[Record]) -> OneRecord:
        """Return the same structure, whose own effect acts in other records."""
        other = copy(self)
        other.records = tuple(records)
        return other

    def simulate(
        self,
        theta: Array,
        record: Record,
        *,
        initial: Initial = 'rest',
        origin: float = 0.0,
        force: bool = False,
    ) -> Array:
        """Free-run sensor output [m] or force [N], the effect neutral in other records."""
        table = np.array(np.atleast_2d(theta))
        if not any(record is r for r in self.records):
            table[:, self._inner.columns(self.own)] = self._off
        out = self._inner.simulate(table, record, initial=initial, origin=origin, force=force)
        return out.reshape(*np.shape(theta)[:-1], len(record))
