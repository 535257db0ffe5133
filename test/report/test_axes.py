"""Every axis has a name and a unit, in every picture; what was measured lies on top."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import actuator_glue as ag
from actuator_glue.api.bode_figure import bode_figure
from actuator_glue.api.frequency_response import FrequencyResponse, Limits, MeasuredResponse
from actuator_glue.inference.bands import band
from actuator_glue.model.parameters import BASE
from actuator_glue.report import style
from actuator_glue.report.posterior_figure import posterior_figure
from actuator_glue.report.prediction_figure import prediction_figure
from actuator_glue.report.records import record_figure
from actuator_glue.report.residual_figure import Left, residual_figure
from actuator_glue.report.timeseries import (
    Bands,
    ParameterCourse,
    band_at_zooms,
    even_zooms,
    parameters_against_time,
)

T = np.arange(400) / 100.0
SINE = 2e-3 * np.sin(2 * np.pi * T)
RECORD = ag.Record(SINE, 0.9 * SINE, 0.01, 250e3)
DRAWS = np.random.default_rng(1).normal(1.0, 0.01, (50, 4))


def limits(of: np.ndarray) -> Limits:
    """Return a median with a band."""
    return Limits(of, 0.9 * of, 1.1 * of)


def bode_of() -> Figure:
    """Return a response with a measured one."""
    hertz = np.geomspace(0.1, 10.0, 30)
    seen = MeasuredResponse(hertz, 0.8 / hertz, -10.0 * hertz)
    curves = (limits(1 / hertz), limits(-9 * hertz), limits(0.02 / hertz))
    one = FrequencyResponse(hertz, *curves, 0.0, measured=seen)
    return bode_figure([('free', one), ('free', one)])


def course() -> Figure:
    """Return parameters against time."""
    values = np.ones((5, 4))
    return parameters_against_time(
        ParameterCourse(np.arange(5.0), values, 0.9 * values, 1.1 * values), BASE
    )


def zooms() -> Figure:
    """Return bands over a record."""
    drawn = DRAWS[:, :1] * RECORD.measured
    return band_at_zooms(RECORD, Bands(band(drawn), band(1.01 * drawn)), even_zooms(RECORD))


PICTURES: dict[str, Callable[[], Figure]] = {
    'bode': bode_of,
    'prediction': lambda: prediction_figure(
        T, SINE, 0.9 * SINE, (0.8 * SINE, SINE), (0.85 * SINE, SINE), 0.9 * SINE
    ),
    'residual': lambda: residual_figure([Left('a', T, SINE, 1e-3), Left('b', T, SINE, None)]),
    'posterior': lambda: posterior_figure(DRAWS, [p.name for p in BASE], [p.unit for p in BASE]),
    'record': lambda: record_figure(RECORD),
    'parameters': course,
    'bands': zooms,
}


EDGE = {'x': 'bottom', 'y': 'left'}


def nameless(figure: Figure) -> list[str]:
    """Return the axes of a figure that have numbers and no name with a unit."""
    found = []
    for axes in figure.axes:
        if not axes.get_visible() or not axes.axison:
            continue
        for side in ('x', 'y'):
            axis: Any = getattr(axes, f'{side}axis')
            shown = axis.get_tick_params().get(f'label{EDGE[side]}', True)
            ticks = [t for t in axis.get_ticklabels() if shown and t.get_text()]
            if not ticks:
                continue
            texts = [axis.get_label_text(), axes.get_title('left'), *aligned(figure, axes, side)]
            if not any('[' in text and ']' in text for text in texts):
                found.append(f'{side} of {figure.axes.index(axes)}: {texts}')
    return found


def aligned(figure: Figure, axes: Axes, side: str) -> list[str]:
    """Return the labels of axes in the same column or row, which are named once."""
    edge = 'x0' if side == 'x' else 'y0'
    at = getattr(axes.get_position(), edge)
    near = [a for a in figure.axes if abs(getattr(a.get_position(), edge) - at) < 0.02]
    return [getattr(one, f'get_{side}label')() for one in near]


@pytest.mark.parametrize('name', PICTURES)
def test_axes_have_names_and_units(name: str) -> None:
    """Whoever sees a number knows what it is a number of."""
    figure = PICTURES[name]()
    figure.canvas.draw()
    assert nameless(figure) == []


def test_frequencies_are_numbered_as_people_read_them() -> None:
    """1, 2, 5, 10 Hz: no powers of ten, and two numbers at least."""
    figure = PICTURES['bode']()
    figure.canvas.draw()
    low, high = figure.axes[-1].get_xlim()
    texts = [tick.get_text() for tick in figure.axes[-1].get_xticklabels()]
    inside = [text for text in texts if low <= float(text) <= high]
    assert len(inside) >= 2
    leading = {f'{float(text):e}'[0] for text in texts}
    assert leading <= {'1', '2', '5'}


@pytest.mark.parametrize('name', ['bode', 'prediction', 'bands'])
def test_what_was_measured_is_seen(name: str) -> None:
    """Black, and above every band."""
    for axes in PICTURES[name]().axes:
        black = [line for line in axes.lines if line.get_color() == style.MEASURED]
        others = [a.get_zorder() for a in (*axes.collections, *axes.lines) if a not in black]
        assert black and min(line.get_zorder() for line in black) >= max(others)


def test_colours_are_told_apart_by_the_colour_blind() -> None:
    """Roles that meet in a figure differ in lightness, or are of Okabe and Ito's eight."""
    known = {'#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9', '#000000'}
    roles = ('MEASURED', 'DETERMINISTIC', 'BAND', 'LIGHT_BAND', 'TOTAL', 'WARNING', 'PUBLISHED')
    assert {getattr(style, role) for role in roles} <= known
    assert style.COMMAND == '#777777'
