"""Two files of one test, one with the command and one with the response, become one record."""

import re
from pathlib import Path

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.records import Record

RATE = 250.0
SWEEP = ag.simulate(ag.Command('sweep', rate=RATE, duration=20.0), stiffness=0.0, seed=3)
LATE = 175  # samples after which the response is recorded


def table(path: Path, time: np.ndarray, **columns: np.ndarray) -> Path:
    """Write times and columns [mm]."""
    names = ','.join(['time_s', *(f'{name}_mm' for name in columns)])
    rows = np.column_stack([time, *(1e3 * c for c in columns.values())])
    np.savetxt(path, rows, fmt='%.9f', delimiter=',', header=names, comments='')
    return path


def files(folder: Path, test: Record = SWEEP, *, offset: float = 0.0, **more) -> tuple[Path, Path]:
    """Write command and response; the clock of the second is ahead by `offset` seconds."""
    command = table(folder / 'c.csv', test.time, command=test.command)
    kept = slice(LATE, None)
    columns = {'measured': test.measured[kept], **{k: v[kept] for k, v in more.items()}}
    return command, table(folder / 'r.csv', test.time[kept] + offset, **columns)


def begins(told: list[str]) -> tuple[float, float]:
    """Return when the response begins by what is told, and its standard deviation [s]."""
    found = re.search(r'begins (\S+) s after the command, \+- (\S+) ms', told[-1])
    assert found is not None
    return float(found[1]), 1e-3 * float(found[2])


@pytest.mark.parametrize('hold', [None, 'zoh'])
def test_by_time_it_is_the_record_of_one_file(tmp_path: Path, hold) -> None:
    """Sample for sample; the source names both, stiffness and hold are those that are given."""
    told: list[str] = []
    record = ag.join(*files(tmp_path), stiffness=0.0, hold=hold, warn=told.append)
    np.testing.assert_allclose(record.command, SWEEP.command[LATE:], atol=1e-11)
    np.testing.assert_allclose(record.measured, SWEEP.measured[LATE:], atol=1e-11)
    assert (record.stiffness, record.hold, record.rate) == (0.0, hold or 'linear', RATE)
    assert record.source == f'{tmp_path}/r.csv (command of c.csv)'
    late = re.search(r'which (\S+) \+- (\S+) ms of the response are dead time', told[-1])
    assert late is not None
    assert abs(float(late[1])) < 3.0 * float(late[2])


@pytest.mark.parametrize('rate', [100.0, 1000.0])
def test_the_command_may_have_another_rate(tmp_path: Path, rate: float) -> None:
    """Straight between its samples, or held from each to the next."""
    time = np.arange(int(20.0 * rate)) / rate
    smooth = 2e-3 * np.sin(2.0 * np.pi * 0.5 * time)
    command = table(tmp_path / 'c.csv', time, command=smooth)
    _, response = files(tmp_path)
    command = table(tmp_path / 'd.csv', time, command=smooth)
    record = ag.join(command, response, warn=lambda _: None)
    at = SWEEP.time[LATE:][: len(record)]
    exact = 2e-3 * np.sin(2.0 * np.pi * 0.5 * at)
    np.testing.assert_allclose(record.command, exact, atol=2e-3 * (np.pi * 0.5 / rate) ** 2)
    held = ag.join(command, response, hold='zoh', warn=lambda _: None)
    index = np.floor(at * rate + 1e-6).astype(int)
    np.testing.assert_allclose(held.command, smooth[index], atol=1e-11)


@pytest.mark.parametrize('stiffness', [0.0, 250e3])
@pytest.mark.parametrize('offset', [-40.0, 3.2174])
def test_by_correlation_the_clocks_need_not_agree(
    tmp_path: Path, stiffness: float, offset: float
) -> None:
    """The actuator's own lag is not taken for a difference of the clocks."""
    test = ag.simulate(ag.Command('sweep', rate=RATE, duration=20.0), stiffness=stiffness, seed=5)
    told: list[str] = []
    record = ag.join(*files(tmp_path, test, offset=offset), by='correlation', warn=told.append)
    found, deviation = begins(told)
    assert abs(found - LATE / RATE) < 3.0 * deviation
    assert deviation < 4e-3
    assert 'a delay would be taken for a difference of the clocks' in told[-1]
    lost = 2e-3 * 2.0 * np.pi * 10.0 * 3.0 * deviation
    shared = slice(LATE, LATE + len(record))
    assert np.abs(record.command - test.command[shared]).max() < lost


@pytest.mark.parametrize(
    ('kind', 'rates', 'stiffness'),
    [
        ('sweep', (100.0, 256.0), 0.0),
        ('sweep', (500.0, 100.0), 100e3),
        ('sweep', (256.0, 1000.0), 250e3),
        ('earthquake', (100.0, 256.0), 250e3),
        ('earthquake', (500.0, 100.0), 0.0),
        ('earthquake', (256.0, 1000.0), 100e3),
    ],
)
def test_a_slow_test_tells_its_clocks_no_closer_than_it_says(
    tmp_path: Path, kind: str, rates: tuple[float, float], stiffness: float
) -> None:
    """Up to 3 Hz the valve's pole is hardly seen: it was taken for 9 ms of the clocks."""
    shape = ag.Command(kind, rate=1000.0, duration=20.0, high=3.0)
    test = ag.simulate(shape, stiffness=stiffness, seed=6)
    command_at = np.arange(0.0, 19.9, 1.0 / rates[0])
    response_at = np.arange(1.3, 19.0, 1.0 / rates[1])
    command = np.interp(command_at, test.time, test.command)
    measured = np.interp(response_at, test.time, test.measured)
    told: list[str] = []
    paths = (
        table(tmp_path / 'c.csv', command_at, command=command),
        table(tmp_path / 'r.csv', response_at + 31.7, measured=measured),
    )
    ag.join(*paths, by='correlation', warn=told.append)
    found, deviation = begins(told)
    assert abs(found - 1.3) < 2.5 * deviation
    assert deviation < (6e-3 if kind == 'sweep' else 10e-3)


def test_what_both_files_hold_tells_the_clocks_apart(tmp_path: Path) -> None:
    """By the same channel in both, and a delay in the loop stays what it is."""
    test = ag.simulate(
        ag.Command('sweep', rate=RATE, duration=20.0),
        effects={'delay': {'delay': 0.02}},
        seed=4,
    )
    told: list[str] = []
    noisy = test.command + 1e-5 * np.random.default_rng(1).standard_normal(len(test))
    paths = files(tmp_path, test, offset=7.1234, command=noisy)
    record = ag.join(*paths, by='correlation', warn=told.append)
    found, deviation = begins(told)
    assert abs(found - LATE / RATE) < max(4.0 * deviation, 5e-5)
    assert deviation < 1e-4
    assert 'joined by command, which both hold' in told[-1]
    np.testing.assert_allclose(
        record.command[:-1], test.command[LATE : LATE + len(record) - 1], atol=2e-5
    )


def test_a_map_names_the_columns_of_both(tmp_path: Path) -> None:
    """By name in whichever file they are, numbers and times in each."""
    table(tmp_path / 'c.csv', SWEEP.time, Soll=SWEEP.command)
    table(tmp_path / 'r.csv', SWEEP.time, Ist=SWEEP.measured)
    (tmp_path / 'map.yaml').write_text(
        'time: {column: 1, unit: s}\ncommand: {column: Soll_mm, unit: mm}\n'
        'measured: {column: 2, unit: mm}\nstiffness: 1e5\n'
    )
    paths = tmp_path / 'c.csv', tmp_path / 'r.csv'
    record = ag.join(*paths, channels=tmp_path / 'map.yaml', warn=lambda _: None)
    np.testing.assert_allclose(record.measured, SWEEP.measured, atol=1e-11)
    assert record.stiffness == 1e5


def test_what_cannot_be_joined_is_told(tmp_path: Path) -> None:
    """Other clocks, another test, a test that repeats, a file without its channel."""
    command, response = files(tmp_path, offset=1.0)
    with pytest.raises(InputError, match=r'1\.\d\d s behind the command.*join by correlation'):
        ag.join(command, response)
    _, response = files(tmp_path, offset=1.7e9)
    with pytest.raises(InputError, match='counts its times from a date'):
        ag.join(command, response)
    with pytest.raises(InputError, match='no column for measured'):
        ag.join(command, command)
    noise = np.random.default_rng(2).standard_normal(len(SWEEP)) * 1e-3
    other = table(tmp_path / 'o.csv', SWEEP.time + 50.0, measured=noise)
    with pytest.raises(InputError, match='0 samples of the response lie in the times'):
        ag.join(command, other)
    with pytest.raises(InputError, match='not alike anywhere'):
        ag.join(command, other, by='correlation')
    sine = ag.simulate(ag.Command('sine', rate=RATE, duration=20.0, high=2.0))
    with pytest.raises(InputError, match='repeats itself'):
        ag.join(*files(tmp_path, sine), by='correlation')


@pytest.mark.parametrize('by', ['time', 'correlation'])
def test_times_that_do_not_go_up_are_refused(tmp_path: Path, by) -> None:
    """They ended in a division by zero, or in an index of nothing."""
    command, response = files(tmp_path)
    still = np.zeros(len(SWEEP))
    for name, time in (('still', still), ('back', SWEEP.time[::-1])):
        odd = table(tmp_path / f'{name}.csv', time, command=SWEEP.command)
        with pytest.raises(InputError, match=rf'{name}\.csv: time does not go up'):
            ag.join(odd, response, by=by)
    odd = table(tmp_path / 'r2.csv', still, measured=SWEEP.measured)
    with pytest.raises(InputError, match=r'r2\.csv: time does not go up'):
        ag.join(command, odd, by=by)


def test_the_command_line_joins(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As the library does; one file alone is refused."""
    command, response = map(str, files(tmp_path))
    out = str(tmp_path / 'out.csv')
    assert main(['convert', command, response, out, '--join', 'time', '--stiffness', '0']) == 0
    assert 'joined by their times' in capsys.readouterr().err
    record = ag.load(out)
    np.testing.assert_allclose(record.command, SWEEP.command[LATE:], atol=1e-11)
    assert (record.stiffness, record.hold) == (0.0, 'linear')
    assert main(['convert', command, out, '--join', 'time', '--force']) == 2
    assert '--join takes two files' in capsys.readouterr().err


def test_one_file_of_two_is_told_how_it_can_be_joined(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By `map`, and by what reads it; a file without either channel is not."""
    for path in files(tmp_path):
        main(['map', str(path)])
        assert '`convert COMMAND_FILE RESPONSE_FILE OUT --join time`' in capsys.readouterr().err
        with pytest.raises(InputError, match='join it with the file that has it'):
            ag.load(path)
    with pytest.raises(InputError, match=r'proposes$'):
        ag.load(table(tmp_path / 'n.csv', SWEEP.time, other=SWEEP.command))
