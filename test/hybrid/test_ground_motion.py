"""Ground motions: artificial ones, files of both kinds, what is refused."""

from pathlib import Path

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.hybrid.ground_motion import GroundMotion, artificial
from actuator_glue.io.ground_motion import GRAVITY, read_ground_motion


def test_an_artificial_motion() -> None:
    """Peak, length, no drift, seeds; most of its power about the ground's 2.5 Hz."""
    one, two = artificial(1), artificial(2)
    assert np.abs(one.acceleration).max() == pytest.approx(1.37)
    assert one.duration == pytest.approx(40.0)
    assert not np.array_equal(one.acceleration, two.acceleration)
    np.testing.assert_array_equal(one.acceleration, artificial(1).acceleration)
    velocity = np.cumsum(one.acceleration) * one.period
    assert abs(velocity[-1]) < 0.02 * np.abs(velocity).max()
    power = np.abs(np.fft.rfft(one.acceleration)) ** 2
    frequency = np.fft.rfftfreq(len(one.acceleration), one.period)
    middle = float(power @ frequency / power.sum())
    assert 1.5 < middle < 8.0


def test_another_rate() -> None:
    """Linear between the samples; the samples themselves stay."""
    motion = GroundMotion(np.array([0.0, 1.0, -1.0]), 0.1, 'small')
    np.testing.assert_allclose(motion.at(0.05), [0.0, 0.5, 1.0, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(motion.scaled(2.0).acceleration, [0.0, 2.0, -2.0])


def test_files(tmp_path: Path) -> None:
    """PEER's format in g, and a table with a heading."""
    at2 = tmp_path / 'RSN6_IMPVALL.AT2'
    at2.write_text(
        'PEER NGA STRONG MOTION DATABASE RECORD\nImperial Valley-02, 5/19/1940, El Centro, 180\n'
        'ACCELERATION TIME SERIES IN UNITS OF G\nNPTS=      7, DT=   .0100 SEC,\n'
        ' -.1000000E-02  .2000000E-02  .1000000E+00 -.3000000E+00  .1000000E-01\n'
        '  .0000000E+00  .5000000E-02\n'
    )
    found = read_ground_motion(at2)
    assert found.period == 0.01 and len(found.acceleration) == 7
    assert found.acceleration[3] == pytest.approx(-0.3 * GRAVITY)
    table = tmp_path / 'record.csv'
    table.write_text('time [s], acceleration [m/s^2]\n0, 0.0\n0.02, 1.5\n0.04, -2.0\n')
    found = read_ground_motion(table)
    assert found.period == pytest.approx(0.02)
    np.testing.assert_allclose(found.acceleration, [0.0, 1.5, -2.0])
    assert read_ground_motion('artificial:3').name.endswith('seed 3)')


@pytest.mark.parametrize(
    ('heading', 'factor'),
    [
        ('time_s,acceleration_g', GRAVITY),
        ('time_s,acceleration_m/s2', 1.0),
        ('time_s,acceleration_m_per_s2', 1.0),
        ('time,Acceleration [cm/s^2]', 1e-2),
        ('"Time (sec)","Ground acceleration (ft/sec/sec)"', 0.3048),
        ('Time [s] Ground acceleration [cm/s^2]', 1e-2),
        ('# time acc/gal', 1e-2),
        ('n.s.,acceleration_g', GRAVITY),
        ('% t, a in mm/s²', 1e-3),
        ('El Centro 1940 NS\n# units: in/s**2', 0.0254),
        ('Time;Acceleration NS\n(s);(Gal)', 1e-2),
        ('El Centro, peak velocity 33 cm/s\ntime,acc [g] (NS)', GRAVITY),
        ('# DT = 0.02\n# time_s,acceleration_g', GRAVITY),
        ('time [s],acc [cm/s2] (filtered)', 1e-2),
        ('# Units: s, cm/s^2', 1e-2),
        ('# Units: SI', 1.0),
        ('# acceleration in cm/s2, baseline corrected in velocity', 1e-2),
        ('# shake table speed 0.01\n# acceleration in cm/s2', 1e-2),
        ('# used for displacement control\ntime_s,acceleration_cm/s2', 1e-2),
        ('time [s],acc [cm.s-2]', 1e-2),
        ('time,acc_cm_s_2', 1e-2),
        ('time,acc_cms2', 1e-2),
        ('time,acc_g_filtered', GRAVITY),
        ('time,acceleration [g] (velocity corrected)', GRAVITY),
    ],
)
def test_the_unit_is_the_one_that_the_heading_says(
    heading: str, factor: float, tmp_path: Path
) -> None:
    """The same motion, whatever it is written in; nothing is said where nothing was taken."""
    path = tmp_path / 'record.csv'
    rows = '\n'.join(f'{0.02 * i:g},{v / factor!r}' for i, v in enumerate((0.0, 1.5, -2.0)))
    path.write_text(f'{heading}\n{rows}\n')
    lines: list[str] = []
    found = read_ground_motion(path, lines.append)
    np.testing.assert_allclose(found.acceleration, [0.0, 1.5, -2.0], rtol=1e-12)
    assert found.period == pytest.approx(0.02) and not lines


def test_what_says_no_unit_is_metres_and_is_told(tmp_path: Path) -> None:
    """With a heading or without one; times in their unit."""
    path = tmp_path / 'record.csv'
    for heading in ('', 'time_ms,acceleration_x\n'):
        lines: list[str] = []
        path.write_text(f'{heading}0,0\n0.5,1\n1,-1\n')
        found = read_ground_motion(path, lines.append)
        assert np.abs(found.acceleration).max() == 1.0
        assert found.period == (0.5e-3 if heading else 0.5)
        assert len(lines) == 1 and 'm/s^2 was taken' in lines[0]


@pytest.mark.parametrize(
    'heading',
    [
        'time,acc (filtered)',
        'time_s,acceleration_filtered',
        'time,acceleration_raw',
        'time,acc_scaled',
        'time,ug_ddot',
        'time_elapsed,acc',
        '# corrected for velocity\ntime,acc',
        'time,acc (NS/EW)',
    ],
)
def test_words_that_are_no_unit_say_none(heading: str, tmp_path: Path) -> None:
    """Read as m/s^2, and told."""
    lines: list[str] = []
    path = tmp_path / 'record.csv'
    path.write_text(f'{heading}\n0,0\n0.5,1\n1,-1\n')
    found = read_ground_motion(path, lines.append)
    assert (np.abs(found.acceleration).max(), found.period) == (1.0, 0.5)
    assert len(lines) == 1 and 'm/s^2 was taken' in lines[0]


def test_times_in_a_list_of_units(tmp_path: Path) -> None:
    """Milliseconds are not seconds there either."""
    path = tmp_path / 'record.csv'
    path.write_text('# Units: ms, g\ntime,acc\n0,0\n5,0.1\n10,-0.1\n')
    found = read_ground_motion(path)
    assert found.period == pytest.approx(5e-3)
    assert found.acceleration[1] == pytest.approx(0.1 * GRAVITY)


@pytest.mark.parametrize('heading', ['El Centro acceleration in g', 'Record of El Centro, g'])
def test_headings_of_at2_that_say_their_unit_otherwise(heading: str, tmp_path: Path) -> None:
    """In a sentence, or at its end."""
    path = tmp_path / 'record.at2'
    path.write_text(f'{heading}\nNPTS= 2, DT= .01\n0.1 0.2\n')
    assert read_ground_motion(path).acceleration[0] == pytest.approx(0.1 * GRAVITY)


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('time_s,velocity_m/s\n0,1\n0.1,2\n', 'is no acceleration'),
        ('time [s], v\nVelocity [m/s]\n0,1\n0.1,2\n', 'speaks of Velocity'),
        ('time_s,acceleration_furlong/s2\n0,1\n0.1,2\n', "'furlong/s2' is no unit of acc"),
        ('time_s,acceleration_mm\n0,1\n0.1,2\n', "'mm' is no unit of acceleration"),
        ('time_s,acceleration (Volts)\n0,1\n0.1,2\n', "'Volts' is no unit of acceleration"),
        ('time_s,acc_cm_s\n0,1\n0.1,2\n', 'is no unit of acceleration'),
        ('time_s,acc [g] (m/s2)\n0,1\n0.1,2\n', 'two units'),
        ('# Units: ms, g\ntime_s,acc\n0,1\n0.1,2\n', 'two units of time'),
        ('time_s,displacement_mm\n0,1\n0.1,2\n', 'is no acceleration'),
        ('time_s,acceleration [m/s]\n0,1\n0.1,2\n', "'m/s' is no unit of acceleration"),
        ('# units: g\ntime_s,acceleration_m/s2\n0,1\n0.1,2\n', 'two units'),
        ('time_min,acceleration_g\n0,1\n0.1,2\n', 'unit of time'),
        ('time,a_g\n0,1\n0.1,2\n', "'a_g' is no unit"),
        (
            'VELOCITY TIME SERIES IN UNITS OF CM/S, STATION G\nNPTS= 2, DT= .01\n1 2\n',
            'holds velocity',
        ),
        ('STATION G\nNPTS= 2, DT= .01\n1 2\n', 'UNITS OF G'),
        ('nothing here\n', 'no rows'),
        ('0 1\n0.1 2\n0.5 3\n', 'evenly'),
        ('0 1 2\n0.1 2 3\n', 'has 3 numbers'),
        ('0 1\n0.1 2\nnoise\n', 'line 3'),
        ('0 0\n0.1 0\n', 'largest acceleration'),
        ('0 1\n0.1 1e6\n', 'm/s'),
        ('0 1\n0.1 nan\n', 'finite'),
        ('IN UNITS OF G\nNPTS= 3, DT= .01\n1 2\n', 'NPTS is 3'),
        ('IN UNITS OF CM/S\nNPTS= 2, DT= .01\n1 2\n', "'CM/S' is no unit of acceleration"),
        ('IN UNITS OF G\nNPTS= 2, DT= .01\n1 x\n', 'no number'),
    ],
)
def test_what_is_no_ground_motion(text: str, said: str, tmp_path: Path) -> None:
    """One error that says what is wrong."""
    path = tmp_path / 'record.txt'
    path.write_text(text)
    with pytest.raises(ag.InputError, match=said):
        read_ground_motion(path)


def test_names_that_are_none(tmp_path: Path) -> None:
    """No file, no seed, a scale that is none."""
    for given in (tmp_path / 'none.at2', 'artificial:x'):
        with pytest.raises(ag.InputError):
            read_ground_motion(given)
    with pytest.raises(ag.InputError, match='scale'):
        artificial(1).scaled(0.0)
    with pytest.raises(ag.InputError, match='seed'):
        artificial(-1)
