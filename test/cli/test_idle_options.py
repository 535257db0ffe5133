"""Options that do nothing without another one, or beside it, are refused and not passed over."""

from pathlib import Path

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.api.simulation import Command, Sensors
from actuator_glue.errors import InputError


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        ('calibrate R --drift 0.1', '--drift does nothing without --prior'),
        ('calibrate R --drift 0.02', '--drift does nothing without --prior'),
        ('calibrate R --prior-age 24h', '--prior-age does nothing without --prior'),
        ('calibrate R --likelihood ar1 --shaping-factor 256', "of the likelihood 'glue'"),
        ('diagnose R --prior-age 24h', '--prior-age does nothing without --prior'),
        ('info R --resample-by lines', '--resample-by does nothing without --resample'),
        ('convert R b.csv --block 8', '--block does nothing for b.csv'),
        ('convert R b --unit m', '--unit does nothing for b'),
        ('replay R --namespace /a', "namespace '/a' says whose samples of a bag"),
        ('campaign --watch . --workers 2', '--watch looks at a campaign that runs'),
        ('rths sdof --posterior p.npz --scale 2', '--scale needs a --ground-motion'),
        ('simulate b --frequency 3', '--frequency does nothing with --command sweep'),
        ('simulate b --command sine --f1 3', '--f1 does nothing with --command sine'),
        ('simulate b --command-seed 3', '--command-seed does nothing with --command sweep'),
        ('simulate b --channels mts', '--channels does nothing with --command sweep'),
        ('simulate b --command R --duration 3', '--duration does nothing with --command R'),
        ('simulate b --plant problem-r --bits 12', '--bits do nothing with --plant problem-r'),
        ('simulate b --plant problem-r --f1 3', '--f1 does nothing with --plant problem-r'),
        ('simulate b --plant problem-r --command sine', '--command sine does nothing'),
        ('simulate b --plant benchmark --bits 12', 'benchmark plant has its own force sensor'),
    ],
)
def test_idle_options_are_refused(
    run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str, said: str
) -> None:
    """Who gave one believes that it did something; nothing is written."""
    monkeypatch.chdir(tmp_path)
    record = tmp_path / 'R'
    time = np.arange(2000) / 200.0
    rows = np.column_stack([time, np.sin(9 * time), np.sin(9 * time - 0.1)])
    header = 'time_s,command_mm,measured_mm'
    np.savetxt(record, rows, delimiter=',', header=header, comments='# stiffness_N_per_m = 0\n')
    done = run(*words.split())
    assert done.code == 2
    assert said in done.message
    assert list(tmp_path.iterdir()) == [record]


def test_idle_arguments_are_refused() -> None:
    """From Python as from the command line."""
    record = ag.simulate(Command(rate=200.0, duration=5.0))
    for given in ({'drift': 0.1}, {'prior_age': 3600.0}):
        for use in (ag.calibrate, ag.diagnose):
            with pytest.raises(InputError, match='drift and prior_age say how an earlier'):
                use([record], **given)  # type: ignore[operator]  # either function
    with pytest.raises(InputError, match='benchmark plant has its own force sensor'):
        ag.simulate(plant='benchmark', sensors=Sensors(force_noise=5.0))
