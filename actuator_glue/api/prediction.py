"""Where the actuator will be under a command: the median of a posterior and its 95 % bands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuator_glue.api.frame import frame
from actuator_glue.inference.bands import band
from actuator_glue.inference.predictive import ResidualModel, total_band
from actuator_glue.motion import METRES, spoken
from actuator_glue.records import Array, Record

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

LEVEL = 0.95


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Prediction:
    """The displacement that a posterior expects under a command, sample by sample.

    Attributes:
        time: shape (n,) [s].
        command: shape (n,) [m].
        median: shape (n,) [m].
        lower, upper: 95 % band of what will be measured: parameters, and what the model left of
            the records it was fitted to; shape (n,) [m].
        parameter_lower, parameter_upper: 95 % band of the parameters alone (GLUE), shape (n,) [m].
        stiffness: of the specimen [N/m].
        measured: what was measured under the command, where that is known, shape (n,) [m].
        residual_known: whether the model's error is in the band; where it is not, as with files of
            earlier versions, both bands are those of the parameters.
        problems: why the posterior must not be used as it stands.
        motion: what is measured: 'm', or 'deg', 'counts' and so on, see `Record`.
    """

    time: Array
    command: Array
    median: Array
    lower: Array
    upper: Array
    parameter_lower: Array
    parameter_upper: Array
    stiffness: float
    measured: Array | None = None
    residual_known: bool = True
    problems: tuple[str, ...] = ()
    motion: str = METRES

    @property
    def inside(self) -> float | None:
        """Share of what was measured that lies in the band; None where nothing was."""
        if self.measured is None:
            return None
        return float(np.mean((self.measured >= self.lower) & (self.measured <= self.upper)))

    def __repr__(self) -> str:
        width = 1e6 * float(np.mean(self.upper - self.lower))
        parameters = 1e6 * float(np.mean(self.parameter_upper - self.parameter_lower))
        told = (
            f'Prediction({len(self.time)} samples, {self.time[-1]:.4g} s, '
            f'{self.stiffness:g} N/m: 95 % band {width:.3g} um wide, {parameters:.3g} um of it '
            'by the parameters'
        )
        told += '' if self.inside is None else f'; {100.0 * self.inside:.1f} % measured inside'
        return spoken('\n'.join([*self.problems, f'{told})']), self.motion)

    def to_dataframe(self) -> DataFrame:
        """Return a table with a row for each sample by its time, in SI units.

        Raises:
            InputError: pandas is not installed.
        """
        names = ('command', 'measured', 'median', 'lower', 'upper')
        columns = {n: getattr(self, n) for n in (*names, 'parameter_lower', 'parameter_upper')}
        known = {'time': self.time} | {n: c for n, c in columns.items() if c is not None}
        return frame(known, 'time')

    def plot(self) -> Figure:
        """Return a figure of command, median, band, and what was measured where that is known."""
        from actuator_glue.report.prediction_figure import prediction_figure

        return prediction_figure(
            self.time,
            self.command,
            self.median,
            (self.lower, self.upper),
            (self.parameter_lower, self.parameter_upper),
            self.measured,
            self.motion,
        )


def prediction(
    record: Record,
    simulated: Array,
    residual: ResidualModel | None,
    *,
    measured: bool,
    problems: tuple[str, ...] = (),
) -> Prediction:
    """Return the bands of simulated displacements.

    Args:
        record: the command and its clock.
        simulated: of each draw, shape (m, n) [m].
        residual: what the model left of the records it was fitted to; None where not known.
        measured: the record's displacement was measured.
        problems: of the posterior.
    """
    alone = band(simulated, (LEVEL,))
    total = alone
    if residual is not None:
        total = total_band(np.random.default_rng(0), simulated, residual, (LEVEL,))
    return Prediction(
        time=record.time,
        command=record.command,
        median=total.median,
        lower=total.lower[0],
        upper=total.upper[0],
        parameter_lower=alone.lower[0],
        parameter_upper=alone.upper[0],
        stiffness=record.known_stiffness(),
        measured=record.measured if measured else None,
        residual_known=residual is not None,
        problems=problems,
    )
