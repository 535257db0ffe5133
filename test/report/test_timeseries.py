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
    Bands,
    ParameterCourse,
    band_at_zooms,
    even_zooms,
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


def test_band_at_zooms_shows_millimetres_and_its_zooms(
    sweep, limits, overlapping_texts, tmp_path: Path
) -> None:
    zooms = frequency_zooms(sweep)
    drawn = Bands(limits, total=limits, deterministic=sweep.measured)
    figure = band_at_zooms(sweep, drawn, zooms, title='A')
    upper, lower = figure.axes[:3], figure.axes[3:]
    np.testing.assert_allclose([p.get_xlim() for p in upper + lower], 2 * zooms)
    assert upper[0].get_ylim()[1] == pytest.approx(1.24 * 2.0, rel=0.01)  # and the margin
    assert 'mm' in upper[0].get_ylabel()
    assert not overlapping_texts(figure)
    with Image.open(style.save(figure, tmp_path / 'new' / 'figure.png')) as image:
        assert image.width == pytest.approx(style.WIDTH * 160, abs=2)


def test_a_record_that_hardly_moves_draws() -> None:
    flat = Record(np.linspace(0, 1e-3, 50), np.zeros(50), 0.01)
    figure = band_at_zooms(flat, Bands(band(np.zeros((3, 50)))), even_zooms(flat))
    assert len(figure.axes) == 6


def test_parameters_against_time(overlapping_texts) -> None:
    time = np.arange(5.0)
    mean = np.tile(TABLE_2, (5, 1))
    course = ParameterCourse(time, mean, 0.9 * mean, 1.1 * mean)
    figure = parameters_against_time(course, BASE, truth=TABLE_2)
    assert len([a for a in figure.axes if a.get_visible()]) == 4
    assert not overlapping_texts(figure)
    one = ParameterCourse(time, mean[:, :1], mean[:, :1], mean[:, :1])
    assert len(parameters_against_time(one, BASE[:1]).axes) == 1


def test_shapes_that_do_not_agree_are_refused(sweep, limits) -> None:
    with pytest.raises(InputError, match='samples'):
        band_at_zooms(sweep, Bands(limits.slice(0, 7)), even_zooms(sweep))
    with pytest.raises(InputError, match='shapes'):
        wrong = np.zeros((2, 4))
        parameters_against_time(ParameterCourse(np.arange(3.0), wrong, wrong, wrong), BASE)
    with pytest.raises(InputError, match=r'not 0\.5'):
        band_at_zooms(sweep, Bands(limits, level=0.5), even_zooms(sweep))


def test_drawing_leaves_global_style_alone(sweep, limits) -> None:
    before = dict(mpl.rcParams)
    style.data_uri(band_at_zooms(sweep, Bands(limits), even_zooms(sweep)))
    assert dict(mpl.rcParams) == before


def test_no_band_hides_what_was_measured(sweep) -> None:
    """However wide bands are, the measured line is whole in the picture, in both rows."""
    middle = np.tile(1.1 * sweep.measured, (3, 1))
    wide = band(middle + np.array([[-1e-4], [0.0], [1e-4]]))
    figure = band_at_zooms(sweep, Bands(wide, total=wide), even_zooms(sweep))
    for axes in figure.axes:
        black = [line for line in axes.lines if line.get_color() == style.MEASURED]
        others = [*axes.collections, *(line for line in axes.lines if line not in black)]
        assert len(black) == 1 and others
        assert black[0].get_zorder() > max(other.get_zorder() for other in others)
