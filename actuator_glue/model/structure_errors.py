"""Error sums of a model structure over records: what likelihoods of models with effects need."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actuator_glue.model.effects import run
from actuator_glue.model.exact import ExactErrors, Initial, settle_samples
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record


class StructureErrors:
    """Errors e = measured - simulated of a structure over records; as model.exact.ExactErrors.

    Args:
        structure: the model.
        records: tests fitted jointly, each with a known specimen stiffness.
        settle: samples at each record's beginning that are simulated but not counted.
        initial: state at the first sample: 'rest', or 'measured' from the first samples.
        origin: time of the first samples since the test began [s], as in Structure.simulate.

    Raises:
        InputError: no record, unknown stiffness or initial, settle too long.
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
        self._exact = ExactErrors(records, settle, initial)
        self.records = self._exact.records
        self.settle = settle_samples(self.records, settle)
        self.initial = initial
        self.origin = origin
        self._onsets = [structure.onsets(r, initial) for r in self.records]
        self._starts = tuple((float(x), float(v)) for x, v in self._exact.starts)

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Counted samples of every record, shape (R,)."""
        return self._exact.sizes

    def __call__(self, theta: ArrayLike) -> Array:
        """Return (sum of e, sum of e^2) per theta and record, (R, 2) or (m, R, 2) [m, m^2].

        Thetas whose response does not exist or diverges give NaN or infinity.

        Raises:
            InputError: theta has the wrong shape.
        """
        if not self.structure.effects:
            return self._exact(theta)
        table = self.structure.table(theta)
        out = np.zeros((len(table), len(self.records), 2))
        for r, record in enumerate(self.records):
            parts = self.structure.parts(
                table, record, self._starts[r], self._onsets[r], self.origin
            )
            for which, begin, y in parts:
                first = max(begin, self.settle[r])
                sums = np.zeros((2, len(which)))
                run.add_errors(y[first - begin :], record.measured[first : begin + len(y)], sums)
                out[which, r] += sums.T
        return out.reshape(*np.shape(theta)[:-1], len(self.records), 2)

    def residuals(self, theta: ArrayLike) -> list[Array]:
        """Return the counted errors of every record, shape (n_r,) or (m, n_r) each [m].

        Raises:
            InputError: theta has the wrong shape.
        """
        return [
            (
                record.measured
                - self.structure.simulate(theta, record, initial=self.initial, origin=self.origin)
            )[..., self.settle[r] :]
            for r, record in enumerate(self.records)
        ]
