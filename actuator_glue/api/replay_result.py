"""The result of a replay: its windows, and how they compare with live, with files and pictures."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from actuator_glue.api.frame import frame
from actuator_glue.api.replay_data import ReplayData
from actuator_glue.api.result import Result
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.motion import METRES, speaking

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from actuator_glue.report import html


@dataclass(frozen=True, slots=True, repr=False)
class Replay(Result, ReplayData):
    """All windows of a stream, and whether they are what was published live.

    Its numbers are those of `ReplayData`: `windows`, `identical`, `compared`, ...

    Attributes:
        motion: what the samples are: 'm', or 'deg', 'counts' and so on, see `Record`.
    """

    schema: ClassVar[str] = 'actuator_glue.replay/1'
    motion: str = METRES

    @property
    def model_effects(self) -> tuple[str, ...]:
        """Effects of the last window's model."""
        return self.effects

    def to_json(self) -> dict[str, Any]:
        """Return the object of schema `actuator_glue.replay/1`."""
        return {
            'schema': self.schema,
            **asdict(self),
            **CATALOGUE.definitions(self.effects),
            'times_real_time': self.times_real_time,
        }

    def to_dataframe(self) -> DataFrame:
        """Return a table of the windows, a row for each by its number, in SI units.

        Columns: `run`, `end_s`, `samples`, `converged`, `evaluations`, `rms_m` and `nrmse` of the
        best draw, `coverage` of the last total band that ended in the window (widest level; NaN
        where none did), and of each parameter NAME `NAME_mean`, `NAME_stddev`, `NAME_rhat`,
        `NAME_ess`.

        Raises:
            InputError: pandas is not installed.
        """
        rows: list[dict[str, Any]] = []
        for w in self.windows:
            inside = [b.coverage[-1] for b in w.bands if b.kind == 'total' and b.coverage]
            row: dict[str, Any] = {
                'window': w.window,
                'run': w.run,
                'end_s': w.end_s,
                'samples': w.samples,
                'converged': w.converged,
                'evaluations': w.evaluations,
                'rms_m': w.error.rms_m,
                'nrmse': w.error.nrmse,
                'coverage': inside[-1] if inside else math.nan,
            }
            for name, p in w.parameters.items():
                row |= {f'{name}_{of}': getattr(p, of) for of in ('mean', 'stddev', 'rhat', 'ess')}
            rows.append(row)
        return frame(rows, 'window')

    def plot(self) -> Figure:
        """Return a figure of every parameter against time, with two standard deviations."""
        from actuator_glue.api.replay_report import parameters_figure

        with speaking(self.motion):
            return parameters_figure(self)

    def brief(self) -> list[html.Block]:
        """Return the summary, the windows, what differs and what limits the answer."""
        from actuator_glue.api.replay_report import brief

        return brief(self)

    def page(self) -> html.Page:
        """Return the report: the windows, and their parameters against time."""
        from actuator_glue.api.replay_report import page

        return page(self)
