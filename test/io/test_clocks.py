"""Columns of times: jitter, rounding, gaps, other units, and rates that a map says beside them."""

import re
import time
from pathlib import Path

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.even_times import allowed_rates, told_rate, uniform_period
from actuator_glue.io.channel_map import parse_channel_map
from actuator_glue.io.load import load_records
from actuator_glue.io.look import look

COUNT = 6000
NUMBER = np.arange(COUNT)


def table(path: Path, clock: np.ndarray, names: str = 'time_s,command_mm,measured_mm') -> Path:
    """Write a command of 4 mm and what follows it 10 samples later."""
    command = 4 * np.sin(2e-6 * NUMBER**2)
    rows = np.column_stack([clock, command, np.roll(command, 10)])
    np.savetxt(path, rows, fmt='%.9g', delimiter=',', header=names, comments='')
    return path


@pytest.mark.parametrize(
    ('shortest', 'longest', 'told'),
    [(20, 55, '20 to 55 ms'), (1, 90, '1 to 90 ms'), (0.5, 1.6, '0.5 to 1.6 ms')],
)
def test_jitter_is_told_as_what_it_is(
    tmp_path: Path, shortest: float, longest: float, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """No gap to cut at, no rate to invent, not even where one step is as long as many."""
    steps = np.random.default_rng(5).uniform(shortest, longest, COUNT) * 1e-3
    steps[100], steps[200] = shortest * 1e-3, longest * 1e-3
    path = table(tmp_path / 'a.csv', np.cumsum(steps) - steps[0])
    with pytest.raises(InputError, match=f'jittered, its steps are {told}') as caught:
        load_records(path)
    named = table(tmp_path / 'b.csv', np.cumsum(steps), 'Zeit,Soll,Ist')
    assert main(['map', str(named)]) == 1
    shown = capsys.readouterr()
    assert 'jittered' in shown.err
    assert 'time: {column: "Zeit"' in shown.out
    for words in (str(caught.value), shown.err):
        assert 'cut' not in words
        assert '--rate' not in words
        assert '--resample' in words
    assert 'uneven steps' in shown.out


@pytest.mark.parametrize('rate', [300, 700, 640])
@pytest.mark.parametrize('start', [0.0, 1.7e9])
def test_times_that_are_rounded_to_milliseconds_are_even(rate: int, start: float) -> None:
    """Steps of 1 and 2 ms are 700 Hz, and exactly that."""
    assert uniform_period(start + np.round(NUMBER / rate, 3), 'x') == 1.0 / rate


def test_a_missing_sample_is_a_gap_and_no_rounding() -> None:
    """One step of two periods among even ones, rounded or not."""
    for even in (NUMBER * 1e-3, np.round(NUMBER * 1e-3, 3)):
        with pytest.raises(InputError, match='without samples after sample 2999'):
            uniform_period(np.delete(even, 3000), 'x')
    with pytest.raises(InputError, match='jittered'):
        uniform_period(np.delete(np.round(NUMBER / 700, 3), 3000), 'x')


@pytest.mark.parametrize(
    ('names', 'factor', 'words'),
    [
        ('time_s,command_mm,measured_mm', 1e3, r'rate is 1 Hz.*time_ms'),
        ('time_us,command_mm,measured_mm', 1.0, r'sample period 1e-09 s.*seconds'),
        ('time_s,command_m,measured_mm', 1.0, r'command moves over 8 m.*command_mm'),
        ('time_s,command_mm,measured_m', 1.0, r'measured moves over 8 m.*measured_mm'),
    ],
)
def test_a_wrong_unit_is_refused_at_once(
    tmp_path: Path, names: str, factor: float, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Milliseconds named seconds, millimetres named metres: every command, with what to do."""
    path = table(tmp_path / 'a.csv', NUMBER * 1e-3 * factor, names)
    with pytest.raises(InputError, match=words):
        ag.load(path)
    for command in (['info'], ['calibrate', '--stiffness', '0'], ['diagnose', '--stiffness', '0']):
        begin = time.process_time()
        assert main([command[0], str(path), *command[1:]]) == 2
        assert time.process_time() - begin < 5.0  # imports of a first command included
        assert re.search(words, capsys.readouterr().err)


def test_a_wrong_unit_in_arrays_is_refused_at_once() -> None:
    """Where a record is made of arrays, before anything is fitted to it."""
    command = 4e-3 * np.sin(2e-6 * NUMBER**2)
    measured = np.roll(command, 10)
    slow = ag.Record(command=command, measured=measured, period=1.0, stiffness=0.0)
    large = ag.Record(command=1e3 * command, measured=measured, period=1e-3, stiffness=0.0)
    for record, words in ((slow, 'sample rate is 1 Hz'), (large, 'command moves over 8 m')):
        for use in (ag.calibrate, ag.diagnose):
            begin = time.process_time()
            with pytest.raises(InputError, match=words):
                use([record])
            assert time.process_time() - begin < 5.0


@pytest.mark.parametrize(('rate', 'stroke'), [(5.0, 1.99), (10.0, 0.5), (100e3, 0.01)])
def test_what_real_tests_have_is_taken(rate: float, stroke: float) -> None:
    """The slowest log, the longest shake table, the fastest card."""
    command = 0.5 * stroke * np.sin(NUMBER / 50)
    ag.Record(command=command, measured=np.roll(command, 3), period=1.0 / rate).check_scale()


@pytest.mark.parametrize('column', [1, None])
def test_a_rate_that_the_clock_of_the_file_contradicts_is_refused(
    tmp_path: Path, column: int | None
) -> None:
    """A map that says 500 Hz of a file whose times say 1 kHz, used by the map or not."""
    path = table(tmp_path / 'a.csv', NUMBER * 1e-3)
    described = {
        'command': {'column': 2, 'unit': 'mm'},
        'measured': {'column': 3, 'unit': 'mm'},
        'rate': 500,
    }
    if column is not None:
        described['time'] = {'column': column, 'unit': 's'}
    with pytest.raises(
        InputError, match=r'said to be 500 Hz, but by its column of times.*1000 Hz'
    ):
        load_records(path, channels=parse_channel_map(described, 'map'))
    (record,) = load_records(path, channels=parse_channel_map({**described, 'rate': 1001}, 'map'))
    assert record.rate == pytest.approx(1001)


def test_map_guesses_a_unit_of_time_that_gives_a_rate_of_a_test(tmp_path: Path) -> None:
    """Steps of one are milliseconds, steps of 500 microseconds."""
    from actuator_glue.io.propose import propose

    for step, unit in ((2e-3, 's'), (1.0, 'ms'), (500.0, 'us'), (1e6, 'ns')):
        found = look(table(tmp_path / 'a.csv', NUMBER * step, 'Time,Command,Position'))
        assert propose(found).channels['time'].unit == unit


@pytest.mark.parametrize(
    ('rate', 'start', 'count', 'told'),
    [
        (1000.0, 0.0, 3000, 'resample 1000 .*: they allow 999.67 to 1001 Hz'),
        (1000.0, 0.3, 1600, 'resample HZ .*; they allow 899 Hz and more, .* of the controller'),
        (250.0, 0.123, 5001, 'resample 250 .*: they allow 249.947 to 250.053 Hz'),
        (997.3, 0.2, 9000, 'resample 997.3 '),
    ],
)
def test_whole_seconds_tell_the_rate_that_they_allow(
    rate: float, start: float, count: int, told: str
) -> None:
    """Runs that are whole tell it however short the record; two parts of a second tell none."""
    stamps = np.floor(1.7e9 + start + np.arange(count) / rate)
    with pytest.raises(InputError, match=told):
        uniform_period(stamps, 'x')


@pytest.mark.parametrize('resolution', [1.0, 60.0, 1e-2, 1.0 / 64.0])
def test_allowed_rates_hold_the_true_one(resolution: float) -> None:
    """Rounded down or to the nearest, in seconds, minutes, hundredths or ticks of Windows."""
    rng = np.random.default_rng(8)
    for _ in range(50):
        rate = float(rng.uniform(3.0, 40.0) / resolution)
        at = rng.uniform(0.0, resolution) + np.arange(int(rng.integers(60, 900))) / rate
        for rounded in (np.floor, np.round):
            allowed = allowed_rates(resolution * rounded(at / resolution))
            if allowed is not None:
                assert allowed[0] <= rate <= allowed[1]
                near = told_rate(*allowed)
                assert near is None or near == pytest.approx(rate, rel=0.01)


def test_stamps_of_no_even_clock_allow_no_rate() -> None:
    """A sample every second, then a thousand at once."""
    assert allowed_rates(np.append(np.arange(100.0), np.full(1000, 100.0))) is None
    assert allowed_rates(np.zeros(10)) is None


def test_times_that_are_all_the_same_have_too_few_digits() -> None:
    """Seconds since 1970 in single precision: nothing to cut, and no rate to read from them."""
    stamps = (1.7e9 + np.arange(60) / 1000.0).astype(np.float32).astype(np.float64)
    with pytest.raises(InputError, match=r'all 60 times are 1700000000 s, .* and the rate'):
        uniform_period(stamps, 'x')
