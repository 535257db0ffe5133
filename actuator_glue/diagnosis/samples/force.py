"""The force channel as a record of its own that the model simulates beside the displacement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.hygiene.checks import pull, where
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.decimate import decimated
from actuator_glue.inference.least_squares.free_run import Model, ObservedChannel
from actuator_glue.model.exact import Initial
from actuator_glue.model.force_errors import recorded_force, shown
from actuator_glue.records import Array, Record

# m: largest value of a scaled force; it limits the scale where the force's error is tiny.
_LARGEST = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class ForceRecord(ObservedChannel, Record):
    """A record whose measured channel is its force, in units of `newtons` per metre.

    Attributes:
        base: the record with its displacement, which gives the initial state.
        newtons: force that counts as much as a metre of displacement [N/m].
    """

    base: Record | None = None
    newtons: float = 1.0

    @classmethod
    def of(cls, record: Record, newtons: float) -> ForceRecord:
        """Return the force of a record.

        Raises:
            InputError: it has none.
        """
        force = recorded_force(record)
        newtons = max(newtons, float(np.abs(force).max()) / _LARGEST)
        values = {f.name: getattr(record, f.name) for f in fields(Record)}
        return cls(**{**values, 'measured': force / newtons}, base=record, newtons=newtons)

    def slice(self, start: int, stop: int) -> ForceRecord:
        """Return samples start:stop, as `Record.slice`."""
        assert self.base is not None
        part = Record.slice(self, start, stop)
        assert isinstance(part, ForceRecord)
        return replace(part, base=self.base.slice(start, stop))

    def simulate(self, model: Model, theta: Array, initial: Initial, origin: float) -> Array:
        """Return what the transducer shows of the simulated force, (m, n) [m]."""
        assert self.base is not None
        force = model.simulate(theta, self.base, initial=initial, origin=origin, force=True)
        return shown(force, self.newtons * self.measured) / self.newtons


def check_forces(records: Sequence[Record]) -> None:
    """Refuse records whose force cannot be evidence.

    Raises:
        InputError: no force, one that does not move, or one of opposite sign.
    """
    for i, record in enumerate(records):
        name = where(record, i + 1)
        force = recorded_force(replace(record, source=name))
        if float(np.ptp(force)) == 0.0:
            raise InputError(f'{name}: the force is constant; check that its channel is connected')
        found = pull(record)
        if found is not None and record.known_stiffness() > 0.0 and found < 0.0:
            raise InputError(
                f'{name}: the force moves against the displacement ({found:.3g} N/m); an actuator '
                'that pushes its specimen has both positive: change the sign of the force '
                '(`scale: -1` in a channel map)'
            )


def _forces(data: Data, newtons: float) -> list[ForceRecord]:
    """Return the records' forces, decimated like their displacements."""
    out = []
    for record, whole, count in zip(data.records, data.recorded, data.factors, strict=True):
        force = decimated(ForceRecord.of(whole, newtons), count)
        assert isinstance(force, ForceRecord)
        out.append(replace(force, base=record))
    return out


def newtons_per_metre(data: Data) -> float:
    """Return the force that `with_forces` counts as much as a metre [N/m]."""
    return next(r.newtons for r in data.records if isinstance(r, ForceRecord))


def with_forces(data: Data, model: Model, theta: Array) -> Data:
    """Return data with the records' forces appended, scaled to equal errors of a fit.

    Args:
        data: displacements of records that have forces.
        model: the structure that was fitted.
        theta: its parameters, (p,).
    """
    count, error = 0, 0.0
    rows = zip(_forces(data, 1.0), data.initials, data.origins, data.masks, strict=True)
    for force, initial, origin, mask in rows:
        off = force.measured - force.simulate(model, theta[None], initial, origin)[0]
        error += force.newtons**2 * float((off[mask] ** 2).sum())
        count += int(mask.sum())
    size = data.target - data.simulate(model, theta)[0]
    newtons = float(np.sqrt(error / count / np.mean(size**2)))
    return replace(
        data,
        records=(*data.records, *_forces(data, newtons)),
        masks=2 * data.masks,
        initials=2 * data.initials,
        recorded=2 * data.recorded,
        origins=2 * data.origins,
        steps=2 * data.steps,
    )
