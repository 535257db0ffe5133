"""A jittered clock made even on request: values, what it costs, what its stamps are worth."""

import re
from pathlib import Path

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.even_times import uniform_period
from actuator_glue.io.load import load_records
from actuator_glue.io.resample import resample_evenly

RNG = np.random.default_rng(11)
COUNT = 4000
TIME = np.cumsum(RNG.uniform(20e-3, 55e-3, COUNT))
TIME -= TIME[0]


def command(time: np.ndarray) -> np.ndarray:
    """Return a slow sweep [m]."""
    return 5e-3 * np.sin(2.0 * np.pi * (0.1 + 0.002 * time) * time)


def table(path: Path, time: np.ndarray = TIME) -> Path:
    """Write the sweep, and what follows it 120 ms later."""
    rows = np.column_stack([time, 1e3 * command(time), 1e3 * command(time - 0.12)])
    names = 'time_s,command_mm,measured_mm'
    np.savetxt(path, rows, fmt='%.9f', delimiter=',', header=names, comments='')
    return path


def channels(stamps: np.ndarray, true: np.ndarray, noise: float = 0.0) -> dict[str, np.ndarray]:
    """Return channels of samples that were taken at true times and stamped otherwise."""
    measured = command(true - 0.12) + noise * np.random.default_rng(5).standard_normal(len(true))
    return {'time': stamps, 'command': command(true), 'measured': measured}


@pytest.mark.parametrize('by', ['lines', 'band-limited'])
def test_values_are_those_at_even_times(tmp_path: Path, by: str) -> None:
    """Within the error of the method, on the time of the first sample; the source tells it."""
    lines: list[str] = []
    path = table(tmp_path / 'a.csv', TIME + 100.0)
    (record,) = load_records(path, resample=(27, by), warn=lines.append)
    assert record.source == f'{tmp_path}/a.csv (resampled to 27 Hz)'
    assert (record.rate, record.hold, record.start_ns) == (27.0, 'linear', 100 * 10**9)
    assert len(record) == int(TIME[-1] * 27) + 1
    off = np.sqrt(np.mean((record.measured - command(100.0 + record.time - 0.12)) ** 2))
    made = resample_evenly(channels(TIME, TIME + 100.0), 27, by, where='x')
    if by == 'lines':
        assert off == pytest.approx(made.error['measured'], rel=0.35)
    else:
        assert (
            off
            < 0.02 * resample_evenly(channels(TIME, TIME), 27, 'lines', where='x').error['command']
        )
    assert '20 to 55 ms apart' in lines[0]
    with pytest.raises(InputError, match='jittered'):
        ag.load(tmp_path / 'a.csv')
    with pytest.warns(UserWarning, match='variance of noise'):
        assert ag.load(path, resample=(27, by), hold='zoh').hold == 'zoh'


@pytest.mark.parametrize(
    ('by', 'rate'), [('lines', 27), ('band-limited', 27), ('band-limited', 9)]
)
def test_the_lost_band_and_the_noise_are_what_is_told(by: str, rate: float) -> None:
    """A sine at the edge of the band keeps 95 % of itself; white noise the share that is told."""
    noise = RNG.standard_normal(COUNT)
    made = resample_evenly({**channels(TIME, TIME), 'force': noise}, rate, by, where='x')
    assert np.var(made.values['force']) == pytest.approx(made.noise, rel=0.1)
    wave = 2.0 * np.pi * made.band
    even = np.arange(len(made.values['measured'])) / rate
    kept = resample_evenly(
        {**channels(TIME, TIME), 'force': np.sin(wave * TIME)}, rate, by, where='x'
    )
    basis = np.column_stack([np.sin(wave * even), np.cos(wave * even)])
    amplitude = np.linalg.lstsq(basis, kept.values['force'], rcond=None)[0]
    assert np.hypot(*amplitude) == pytest.approx(0.95, abs=0.01)
    if by == 'lines':
        assert made.noise == pytest.approx(2.0 / 3.0, abs=0.02)
        spacing = np.sqrt(np.sum(np.diff(TIME) ** 3) / TIME[-1])
        assert made.band == pytest.approx(np.sqrt(0.15) / np.pi / spacing, rel=0.05)
    else:
        other = resample_evenly(channels(TIME, TIME), 27, 'lines', where='x')
        assert made.band > min(1.3 * other.band, 0.4 * rate)


def test_what_fewer_samples_cannot_hold_is_not_folded() -> None:
    """A sine above half the wanted rate leaves next to nothing."""
    fast = channels(TIME, TIME) | {'force': np.sin(2.0 * np.pi * 7.0 * TIME)}
    made = resample_evenly(fast, 9, where='x')
    assert np.std(made.values['force'][20:-20]) < 0.02


@pytest.mark.parametrize('late', ['of a log', 'whole seconds', 'milliseconds'])
def test_stamps_beside_even_samples_give_way_to_an_even_clock(late: str) -> None:
    """Samples of a controller, stamped when they were logged, or in whole seconds."""
    rate = 2000.0 if late == 'milliseconds' else 27.0
    true = 0.3 + np.arange(COUNT) / rate
    stamps = {
        'of a log': np.sort(true + np.random.default_rng(6).uniform(0.0, 25e-3, COUNT)),
        'whole seconds': np.floor(true),
        'milliseconds': np.round(true, 3),
    }[late]
    made = resample_evenly(channels(stamps, true), rate, where='x')
    np.testing.assert_allclose(made.values['command'], command(true), atol=1e-9)
    assert made.late == pytest.approx(np.std(stamps - true), rel=0.1)
    assert 'an even clock was taken in place of them' in made.told()
    # What was taken at uneven times is no log of even samples.
    assert resample_evenly(channels(TIME, TIME, 1e-5), 27, where='x').late == 0.0


@pytest.mark.parametrize('lost', [1, 8])
@pytest.mark.parametrize(
    ('rate', 'late'), [(800.0, 0.0), (120.0, 0.0), (512.0, 0.0), (800.0, 1.5e-3)]
)
def test_no_even_clock_is_taken_where_samples_are_missing(
    rate: float, late: float, lost: int
) -> None:
    """Stamps in milliseconds, of a log perhaps: what is lost moves all later ones for good."""
    true = np.delete(0.3 + np.arange(COUNT + lost) / rate, slice(1500, 1500 + lost))
    stamps = true + np.random.default_rng(8).uniform(0.0, late, COUNT)
    stamps = np.sort(np.round(stamps, 3))
    with pytest.raises(InputError, match=r'missing|without samples after') as caught:
        resample_evenly(fast(stamps, true), rate, where='x')
    place = re.search(r'(?:after|near) sample (\d+)', str(caught.value))
    assert place is not None and abs(int(place[1]) - 1499) <= (20 if late else 1)


def test_late_stamps_are_no_lost_samples() -> None:
    """One in a hundred comes three periods late and holds up those behind it."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        true = 0.3 + np.arange(COUNT) / 100.0
        late = rng.exponential(1e-3, COUNT) + 0.03 * (rng.uniform(size=COUNT) < 0.01)
        stamps = np.maximum.accumulate(np.round(true + late, 6)) + 1e-9 * np.arange(COUNT)
        assert resample_evenly(fast(stamps, true), 100.0, where='x').clock == 'of 100 Hz'


def stamped(late: np.ndarray, lost: int | None = None, jitter: float = 0.03) -> None:
    """Resample even samples of 100 Hz with stamps that are late, in periods; one may be lost."""
    count = len(late)
    true = np.arange(count + 1) / 100.0
    true = true[:-1] if lost is None else np.delete(true, lost + 1)
    noise = jitter * np.random.default_rng(1).standard_normal(count)
    stamps = true + 0.01 * (late + noise)
    made = resample_evenly(fast(stamps - stamps[0], 0.1 * true), 100.0, where='x')
    assert made.late > 0.0  # an even clock was taken


def held_up(count: int, begin: int, stall: float, length: int) -> np.ndarray:
    """Return by how many periods stamps are late from a hold-up until the log has caught up."""
    behind = np.arange(count) - begin
    return np.where((behind >= 0) & (behind < length), stall * (1.0 - behind / length), 0.0)


@pytest.mark.parametrize('stall', [1.0, 2.0, 3.0, 4.5])
@pytest.mark.parametrize('length', [12, 20, 30, 60])
def test_a_log_that_catches_up_has_lost_nothing(stall: float, length: int) -> None:
    """Held up once, in the middle or near an end, it is as far off behind as before."""
    for begin in (3000, 60, 5880):
        stamped(held_up(6000, begin, stall, length))
    stamped(held_up(300, 150, stall, length))


def test_clocks_that_move_slowly_have_lost_nothing() -> None:
    """From the first samples on, or while a clock is set by a time server."""
    for count in (300, 2000, 12000):
        index = np.arange(count)
        stamped(3.0 * (1.0 - np.exp(-index / 20.0)))
        stamped(3.0 * np.exp(-index / 20.0))
        stamped(2.0 * np.clip((index / count - 0.4) * 4.0, 0.0, 1.0))


@pytest.mark.parametrize(('stall', 'length'), [(1.0, 10), (3.0, 20), (4.0, 60)])
@pytest.mark.parametrize('ahead', [-30, 0, 30, 100])
def test_a_lost_sample_beside_a_hold_up_is_found(stall: float, length: int, ahead: int) -> None:
    """Where it was lost, or where the log was held up while it was lost."""
    with pytest.raises(InputError, match=r'about 1 sample.s. are missing') as caught:
        stamped(held_up(6000, 3001 - ahead, stall, length), 3000)
    place = re.search(r'(?:after|near) sample (\d+)', str(caught.value))
    assert place is not None and abs(int(place[1]) - 3000) <= (40 if ahead == 30 else 5)


@pytest.mark.parametrize('lost', [1, 2, 8])
@pytest.mark.parametrize('rate', [512.0, 640.0, 800.0])
def test_the_place_of_a_loss_is_told_of_coarse_stamps(rate: float, lost: int) -> None:
    """Three decimals, of 8000 samples."""
    for place in (1000, 4000):
        true = np.delete(0.3 + np.arange(8000 + lost) / rate, slice(place + 1, place + 1 + lost))
        with pytest.raises(InputError, match=r'missing|without samples after') as caught:
            resample_evenly(fast(np.round(true, 3), true), rate, where='x')
        told = re.search(r'(?:after|near) sample (\d+)', str(caught.value))
        assert told is not None and abs(int(told[1]) - place) <= 1


@pytest.mark.parametrize('places', [[500, 900, 1300, 2500, 3100], [1000, 1060], [3500]])
def test_samples_lost_in_several_places_are_found(places: list[int]) -> None:
    """The message names one of them."""
    true = np.delete(np.arange(COUNT + len(places)), np.array(places) + 1) / 100.0
    stamps = true + 3e-4 * np.random.default_rng(1).standard_normal(COUNT)
    with pytest.raises(InputError, match='missing') as caught:
        resample_evenly(fast(stamps - stamps[0], 0.1 * true), 100.0, where='x')
    place = re.search(r'(?:after|near) sample (\d+)', str(caught.value))
    assert place is not None and min(abs(int(place[1]) - p) for p in places) <= len(places)


@pytest.mark.parametrize('rate', [997.0, 512.0, 640.0, 2000.0])
def test_a_clock_beside_that_of_its_stamps_lacks_nothing(rate: float) -> None:
    """Its stamps slip by a millisecond now and then; the rate that is proposed is the clock's."""
    true = 0.3 + np.arange(COUNT) / rate
    stamps = np.round(true, 3)
    made = resample_evenly(fast(stamps, true), rate, where='x')
    assert made.late < 0.5e-3 and f'of {rate:.6g} Hz' in made.clock
    if rate == 512.0:
        with pytest.raises(InputError, match='periods off an even clock; --resample 512 makes'):
            uniform_period(stamps, 'x')


def fast(stamps: np.ndarray, true: np.ndarray) -> dict[str, np.ndarray]:
    """Return a sweep that moves far within a millisecond."""
    moved = 5e-3 * np.sin(2.0 * np.pi * (0.1 + 0.2 * true) * true)
    return {'time': stamps, 'command': moved, 'measured': moved}


def test_a_clock_that_the_stamps_rule_out_is_not_taken() -> None:
    """Three whole seconds of 1 kHz are no 1.5 kHz: values stay where they were in time."""
    true = np.arange(3000) / 1000.0
    made = resample_evenly(channels(np.floor(true), true), 1500.0, where='x')
    even = np.arange(len(made.values['command'])) / 1500.0
    np.testing.assert_allclose(made.values['command'], command(even), atol=1e-9)
    assert 'an even clock was taken in place of them, of 1000 Hz (its times allow' in made.told()


def test_a_clock_that_the_stamps_leave_open_is_the_one_that_is_asked_for() -> None:
    """Within what they allow; anything else is no answer."""
    true = 0.3 + np.arange(1600) / 1000.0
    stamps = np.floor(true)
    made = resample_evenly(channels(stamps, true), 1000.0, where='x')
    np.testing.assert_allclose(made.values['command'], command(true), atol=1e-9)
    assert 'of 1000 Hz, as asked for (its times allow 899 Hz and more)' in made.told()
    with pytest.raises(InputError, match='allow a clock of 899 Hz and more, and 700 Hz is none'):
        resample_evenly(channels(stamps, true), 700.0, where='x')


def test_what_the_stamps_are_worth_is_told_in_micrometres() -> None:
    """Samples at uneven times, stamped 2 ms beside: noise where the piston moves."""
    stamps = TIME + np.random.default_rng(7).normal(0.0, 2e-3, COUNT)
    stamps -= stamps[0]
    made = resample_evenly(channels(stamps, TIME, 2e-6), 27, where='x')
    speed = np.sqrt(np.mean(np.gradient(command(TIME), TIME) ** 2))
    assert made.jitter == pytest.approx(2e-3, rel=0.15)
    assert made.moved == pytest.approx(2e-3 * speed, rel=0.15)
    assert f'which is {1e6 * made.moved:.2g} um of noise' in made.told()
    assert resample_evenly(channels(TIME, TIME, 5e-6), 27, where='x').jitter == 0.0


def test_a_command_that_lines_cut_is_told_with_a_rate_that_keeps_it() -> None:
    """A sine of 3 Hz at 27 Hz: what its chords miss; at the rate that is told next to nothing."""
    fast = 5e-3 * np.sin(2.0 * np.pi * 3.0 * TIME)
    values = {'time': TIME, 'command': fast, 'measured': fast}
    made = resample_evenly(values, 27, where='x')
    dense = np.arange(27 * 200) / (27.0 * 200.0)
    exact = 5e-3 * np.sin(2.0 * np.pi * 3.0 * dense)
    chords = np.interp(dense, dense[::200], exact[::200])
    assert made.cut == pytest.approx(np.sqrt(np.mean((exact - chords)[:-200] ** 2)), rel=0.05)
    assert f'the command misses {1e6 * made.cut:.2g} um' in made.told()
    assert made.told().endswith(f'--resample {made.finer:.0f} keeps it')
    better = resample_evenly(values, made.finer, where='x')
    assert better.cut == 0.0
    assert 'the command misses' not in better.told()
    assert resample_evenly(channels(TIME, TIME), 27, where='x').cut < made.cut


@pytest.mark.parametrize(
    ('time', 'rate', 'words'),
    [
        (TIME, 2, r'26\.\d+ samples per second; resample to between 2\.\d+ and 26\d'),
        (TIME, 300, 'not 300'),
        (TIME, -1, 'resample is -1'),
        (TIME + 3.0 * (TIME > 50.0), 27, r'3\.\d+ s without samples .*nobody knows'),
        (
            np.where(np.arange(COUNT) == 50, TIME[48], TIME),
            27,
            'time does not go up after sample 49',
        ),
    ],
)
def test_nothing_is_invented(tmp_path: Path, time: np.ndarray, rate: float, words: str) -> None:
    """Rates far from that of the samples, gaps, times that go back."""
    with pytest.raises(InputError, match=words):
        load_records(table(tmp_path / 'a.csv', time), resample=rate)


@pytest.mark.parametrize('count', [1, 2, 3, 4])
def test_few_samples_are_called_few(count: int) -> None:
    """They ascend: nothing else is wrong with them."""
    time = np.array([0.0, 0.011, 0.05, 0.06])[:count]
    with pytest.raises(InputError, match=f'{count} samples are too few .* at least 5'):
        resample_evenly(channels(time, time), 60.0, where='x')
    assert (
        len(resample_evenly(channels(TIME[:6], TIME[:6]), 5.0, where='x').values['command']) == 1
    )


def test_the_command_line_resamples_on_request_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Refused with what to say; told where it is done; an even record is left as it is."""
    path = table(tmp_path / 'a.csv')
    assert main(['info', str(path)]) == 2
    assert '--resample 27' in capsys.readouterr().err
    assert main(['convert', str(path), str(tmp_path / 'b.csv'), '--resample', '27']) == 0
    assert 'more than 5 % of an amplitude is lost' in capsys.readouterr().err
    assert len(ag.load(tmp_path / 'b.csv')) == int(TIME[-1] * 27) + 1
    with pytest.warns(UserWarning, match='its clock is even already, at 27 Hz, and stays so'):
        even = ag.load(tmp_path / 'b.csv', resample=30)
    assert (even.rate, even.source) == (27.0, str(tmp_path / 'b.csv'))
    again = ['convert', str(tmp_path / 'b.csv'), str(tmp_path / 'c.csv'), '--resample']
    assert main([*again, '30']) == 0
    assert '--resample makes jittered clocks even and changes no other' in capsys.readouterr().err
    assert main([*again, '27', '--force']) == 0  # what was asked for is so
    assert capsys.readouterr().err == ''
