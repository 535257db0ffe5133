"""Parameters of a replay against time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from actuator_glue.model.structure import Structure
from actuator_glue.report.timeseries import ParameterCourse, parameters_against_time

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from actuator_glue.api.replay_result import Replay


def parameters_figure(found: Replay) -> Figure:
    """Draw every parameter's mean and two standard deviations against time.

    Windows of another model than the last one's are left out: their parameters are others.
    """
    names = list(found.windows[-1].parameters)
    windows = [w for w in found.windows if list(w.parameters) == names]
    known = {p.name: p for p in Structure(found.effects).parameters}
    mean = np.array([[w.parameters[n].mean for n in names] for w in windows])
    spread = 2.0 * np.array([[w.parameters[n].stddev for n in names] for w in windows])
    time_s = np.array([w.end_s for w in windows])
    course = ParameterCourse(
        time_s, mean, mean - spread, mean + spread, 'mean and two standard deviations'
    )
    return parameters_against_time(course, [known[n] for n in names])
