"""A file name of any bytes gives a report; a report that fails takes nothing from the answer."""

import json
import os
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from test_diagnosis_report import diagnosis

from actuator_glue.api.diagnosis import Diagnosis
from actuator_glue.api.posterior_model import PosteriorModel
from actuator_glue.cli import _output
from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.io.export import write
from actuator_glue.records import Record

NAMES = (os.fsdecode(b'test \xe9.csv'), '$\\frac$ a_b.csv', 'line\nfeed.csv')


@pytest.fixture(
    params=[
        pytest.param(NAMES[0], id='bytes', marks=pytest.mark.slow),
        pytest.param(NAMES[1], id='formula'),
        pytest.param(NAMES[2], id='line', marks=pytest.mark.slow),
    ]
)
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A record under a name that is no text, no formula and no line."""
    time = np.arange(2000) / 200.0
    moved = 1e-3 * np.sin(2 * np.pi * 0.2 * time**2)
    plain = tmp_path / 'plain.csv'
    write(plain, Record(moved, np.roll(moved, 3), 1 / 200, 250e3, hold='zoh'))
    return plain.rename(tmp_path / request.param)


@pytest.fixture
def answers(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`diagnose` answers at once, of this file."""
    made = diagnosis(6e-5, records=1)
    found = Diagnosis(**{f.name: getattr(made, f.name) for f in fields(made)})
    traces = tuple(replace(t, source=str(file)) for t in found.traces)
    error = replace(found.error, records=((str(file), 3e-5, 1e-5),))
    found = replace(found, traces=traces, error=error)
    monkeypatch.setattr('actuator_glue.api.diagnosis.diagnose', lambda *_, **__: found)


@pytest.fixture
def laid_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of the report are laid out, which reads every text, and not drawn."""

    def png(figure: Figure) -> bytes:
        figure.draw_without_rendering()
        return b'a picture'

    monkeypatch.setattr('actuator_glue.report.style.png', png)


def outputs(folder: Path, name: str) -> list[str]:
    """Return the options that ask for everything a command can write."""
    return ['--json', str(folder / f'{name}.json'), '--report', str(folder / f'{name}.html')]


@pytest.mark.usefixtures('answers', 'laid_out')
def test_a_report_of_any_file_name(file: Path, tmp_path: Path) -> None:
    """Answer, JSON, report and pictures, whatever the name holds."""
    assert main(['diagnose', str(file), *outputs(tmp_path, 'd')]) == 0
    assert json.loads((tmp_path / 'd.json').read_text('utf-8'))['verdict'] == 'missing-effect'
    assert 'backlash' in (tmp_path / 'd.html').read_text('utf-8')
    assert main(['plot', str(file), '--out', str(tmp_path / 'plots')]) == 0
    assert len(list((tmp_path / 'plots').iterdir())) == 1


@pytest.mark.slow
@pytest.mark.usefixtures('undrawn')  # `plot` draws the same pictures
def test_calibrate_reports_any_file_name(file: Path, tmp_path: Path) -> None:
    """The draws as well; the records' names stand in both."""
    words = ['calibrate', str(file), '--evaluations', '20000', '--save', str(tmp_path / 'c.npz')]
    assert main([*words, *outputs(tmp_path, 'c')]) in (0, 1)
    (record,) = json.loads((tmp_path / 'c.json').read_text('utf-8'))['records']
    assert record['source'].endswith(file.name)
    assert (tmp_path / 'c.html').stat().st_size > 10_000
    drawn = ['--draws', str(tmp_path / 'c.npz'), '--out', str(tmp_path / 'p')]
    assert main(['plot', str(file), *drawn]) == 0
    assert len(list((tmp_path / 'p').iterdir())) == 3


@pytest.mark.usefixtures('answers')
@pytest.mark.parametrize('file', NAMES[:1], indirect=True, ids=['bytes'])
@pytest.mark.parametrize(
    ('error', 'code'), [(RuntimeError('ink'), 0), (InputError('d.html: no ink'), 2)]
)
def test_a_report_that_fails_ends_nothing(
    file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: Exception,
    code: int,
) -> None:
    """The answer is printed, the JSON is there, and it is said what failed."""

    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(PosteriorModel, 'report', fail)
    assert main(['diagnose', str(file), *outputs(tmp_path, 'd')]) == code
    assert json.loads((tmp_path / 'd.json').read_text('utf-8'))['verdict'] == 'missing-effect'
    told = capsys.readouterr()
    assert 'backlash' in told.out
    assert 'ink' in told.err and 'Traceback' not in told.err


def test_a_full_disk_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """What the system says is told, and ends nothing."""

    def fill(_: str) -> None:
        raise OSError(28, 'No space left on device', 'd.html')

    assert _output.beside('d.html', fill) == 2
    assert 'No space left on device' in capsys.readouterr().err
    assert _output.beside(None, fill) == 0
