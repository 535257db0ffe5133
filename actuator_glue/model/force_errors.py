"""Errors of the measured force, with gain and offset of each transducer unknown.

The gain would pass for specimen stiffness and the offset for a preload, so both are fitted in each
record to whatever is simulated: only the force's course is evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from actuator_glue.errors import InputError
from actuator_glue.model.exact import Initial, settle_samples
from actuator_glue.records import Array, Record

if TYPE_CHECKING:
    from actuator_glue.model.structure import Structure

# Numbers that are simulated at a time.
_BLOCK = 1 << 20


def transducer(simulated: Array, measured: Array) -> tuple[Array, Array]:
    """Return the gain, not below 0, and the offset that take simulated forces to the measured.

    Args:
        simulated: actuator forces, (m, n) [N].
        measured: the force, (n,) [N].

    Returns:
        Gains (m,) and offsets (m,) [N]; no gain where nothing is simulated to act.
    """
    mean = simulated.mean(axis=1)
    off = simulated - mean[:, None]
    power = np.einsum('mn,mn->m', off, off)
    with np.errstate(divide='ignore', invalid='ignore'):
        gain = np.where(power > 0.0, off @ (measured - measured.mean()) / power, 0.0)
    # Not a number stays one: such a response does not exist.
    gain = np.where(gain < 0.0, 0.0, gain) + 0.0 * power
    return gain, measured.mean() - gain * mean


def shown(simulated: Array, measured: Array) -> Array:
    """Return simulated forces (m, n) as shown by the transducer that measured (n,) [N]."""
    gain, offset = transducer(simulated, measured)
    return np.asarray(gain[:, None] * simulated + offset[:, None])


class ForceErrors:
    """Sums of squares of measured less shown force of a structure over records.

    Args:
        structure: the model.
        records: tests with a force, each with a known specimen stiffness.
        settle: samples at each record's beginning that are simulated but not counted.
        initial: state at the first sample: 'rest', or 'measured' from the first samples.
        origin: time of the first samples since the test began [s].

    Raises:
        InputError: a record without force, settle too long.
    """

    def __init__(
        self,
        structure: Structure,
        records: Sequence[Record],
        settle: Sequence[int] | int = 0,
        initial: Initial = 'rest',
        origin: float = 0.0,
    ) -> None:
        self.structure = structure
        self.records = tuple(records)
        self.settle = settle_samples(self.records, settle)
        self.initial = initial
        self.origin = origin
        pairs = zip(self.records, self.settle, strict=True)
        self.measured = tuple(recorded_force(r)[count:] for r, count in pairs)

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Counted samples of every record, shape (R,)."""
        return np.array([len(f) for f in self.measured], dtype=np.int64)

    def simulated(self, theta: Array, r: int) -> Array:
        """Return the counted actuator forces of thetas (m, p) in record r, (m, n_r) [N]."""
        force = self.structure.simulate(
            theta, self.records[r], initial=self.initial, origin=self.origin, force=True
        )
        return force[:, self.settle[r] :]

    def __call__(self, theta: Array) -> Array:
        """Return the sum of squares of every theta (m, p) and record, (m, R) [N^2]."""
        out = np.empty((len(theta), len(self.records)))
        for r, measured in enumerate(self.measured):
            size = max(1, _BLOCK // len(self.records[r]))
            for begin in range(0, len(theta), size):
                some = slice(begin, begin + size)
                error = measured - shown(self.simulated(theta[some], r), measured)
                out[some, r] = np.einsum('mn,mn->m', error, error)
        return out


def recorded_force(record: Record) -> Array:
    """Return the force of a record, (n,) [N].

    Raises:
        InputError: there is none.
    """
    if record.force is None:
        where = f'{record.source}: ' if record.source else ''
        raise InputError(
            f'{where}no force is recorded, so that none can be used; give its channel (a column '
            'force_N, or `force` in a channel map), or leave --use-force out'
        )
    return record.force
