"""A jittered clock made even on request: values, what it costs, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
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


def test_values_are_those_at_even_times(tmp_path: Path) -> None:
    """Within the error that is told, on the time of the first sample; the source tells it."""
    lines: list[str] = []
    (record,) = load_records(
        table(tmp_path / 'a.csv', TIME + 100.0), resample=27, warn=lines.append
    )
    assert record.source == f'{tmp_path}/a.csv (resampled to 27 Hz)'
    assert (record.rate, record.hold, record.start_ns) == (27.0, 'linear', 100 * 10**9)
    assert len(record) == int(TIME[-1] * 27) + 1
    made = resample_evenly({'time': TIME, 'measured': command(TIME + 99.88)}, 27, 'x')
    off = record.measured - command(100.0 + record.time - 0.12)
    assert np.sqrt(np.mean(off**2)) == pytest.approx(made.error['measured'], rel=0.35)
    assert 'steps' not in lines[0]
    assert '20 to 55 ms apart' in lines[0]
    with pytest.raises(InputError, match='jittered'):
        ag.load(tmp_path / 'a.csv')
    with pytest.warns(UserWarning, match='variance of noise'):
        assert ag.load(tmp_path / 'a.csv', resample=27, hold='zoh').hold == 'zoh'


def test_the_lost_band_and_the_noise_are_what_is_told() -> None:
    """A sine at the edge of the band keeps 95 % of itself; white noise the share that is told."""
    noise = RNG.standard_normal(COUNT)
    made = resample_evenly({'time': TIME, 'measured': noise}, 27, 'x')
    assert np.var(made.values['measured']) == pytest.approx(made.noise, rel=0.1)
    assert made.noise == pytest.approx(2.0 / 3.0, abs=0.02)
    wave = 2.0 * np.pi * made.band
    even = np.arange(len(made.values['measured'])) / 27
    kept = resample_evenly({'time': TIME, 'measured': np.sin(wave * TIME)}, 27, 'x')
    basis = np.column_stack([np.sin(wave * even), np.cos(wave * even)])
    amplitude = np.linalg.lstsq(basis, kept.values['measured'], rcond=None)[0]
    assert np.hypot(*amplitude) == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize(
    ('time', 'rate', 'words'),
    [
        (TIME, 10, r'26\.\d+ samples per second; resample to between 21.* and 53'),
        (TIME, 100, 'not 100'),
        (TIME, -1, 'not -1'),
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
    even = ag.load(tmp_path / 'b.csv', resample=30)
    assert (even.rate, even.source) == (27.0, str(tmp_path / 'b.csv'))
