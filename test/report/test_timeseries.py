"""Figures along time, drawn whole and looked at through their artists."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

from actuator_glue.errors import InputError
from actuator_glue.inference.bands import Band, band
from actuator_glue.model.parameters import BASE, TABLE_2
from actuator_glue.records import Record
from actuator_glue.report import style
from actuator_glue.report.timeseries import (
    band_at_zooms,
    band_over_measured,
    frequency_zooms,
    parameters_against_time,
)


@pytest.fixture
def sweep() -> Record:
    time = np.arange(0, 60, 0.01)
    command = 2e-3 * np.sin(np.pi * 10 / 60 * time**2)
    return Record(command, 0.9 * command, 0.01, stiffness=0.0)


@pytest.fixture
def limits(sweep: Record) -> Band:
    scale = np.random.default_rng(1).normal(0.9, 0.02, size=(60, 1))
    return band(scale * sweep.command)


def test_zooms_sit_where_the_command_has_that_frequency(sweep: Record) -> None:
    for wanted, (start, stop) in zip((1, 5, 10), frequency_zooms(sweep), strict=True):
        assert 0 <= start < stop <= sweep.duration
        assert (start + stop) / 2 / 6 == pytest.approx(wanted, abs=0.35)
        assert stop - start == pytest.approx(2 / wanted)


def test_band_over_measured_shows_millimetres_and_its_zooms(
    sweep, limits, overlapping_texts, tmp_path: Path
) -> None:
    zooms = frequency_zooms(sweep)
    figure = band_over_measured(sweep, limits, total=limits, zooms=zooms, title='A')
    whole, *panels = figure.axes
    np.testing.assert_allclose([p.get_xlim() for p in panels], zooms)
    assert whole.get_ylim()[1] == pytest.approx(2.0, rel=0.2)
    assert 'mm' in whole.get_ylabel()
    assert not overlapping_texts(figure)
    with Image.open(style.save(figure, tmp_path / 'new' / 'figure.png')) as image:
        assert image.width == pytest.approx(style.WIDTH * 160, abs=2)


def test_zoom_figure_and_default_zooms_draw(sweep, limits, overlapping_texts) -> None:
    figure = band_at_zooms(
        sweep, limits, frequency_zooms(sweep), deterministic=sweep.measured, title='B'
    )
    assert len(figure.axes) == 6
    assert not overlapping_texts(figure)
    flat = Record(np.linspace(0, 1e-3, 50), np.zeros(50), 0.01)
    figure = band_over_measured(flat, band(np.zeros((3, 50))))
    assert len(figure.axes) == 4


def test_parameters_against_time(overlapping_texts) -> None:
    time = np.arange(5.0)
    mean = np.tile(TABLE_2, (5, 1))
    figure = parameters_against_time(
        time, mean, 0.9 * mean, 1.1 * mean, BASE, truth=TABLE_2, reference=TABLE_2
    )
    assert len([a for a in figure.axes if a.get_visible()]) == 4
    assert not overlapping_texts(figure)
    figure = parameters_against_time(time, mean[:, :1], mean[:, :1], mean[:, :1], BASE[:1])
    assert len(figure.axes) == 1


def test_shapes_that_do_not_agree_are_refused(sweep, limits) -> None:
    with pytest.raises(InputError, match='samples'):
        band_over_measured(sweep, limits.slice(0, 7))
    with pytest.raises(InputError, match='shapes'):
        parameters_against_time(np.arange(3.0), np.zeros((2, 4)), np.zeros((2, 4)), 0, BASE)
    with pytest.raises(InputError, match=r'not 0\.5'):
        band_over_measured(sweep, limits, level=0.5)


def test_drawing_leaves_global_style_alone(sweep, limits) -> None:
    before = dict(mpl.rcParams)
    style.data_uri(band_over_measured(sweep, limits))
    assert dict(mpl.rcParams) == before
