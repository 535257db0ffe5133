"""The reference bags are what the commands beside them make."""

import shlex
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.cli.main import main
from actuator_glue.io.bag_reader import decoded, summarise
from actuator_glue.io.bag_records import read_records

BAGS = Path(__file__).resolve().parent.parent / 'bags'
COMMANDS = [
    shlex.split(line)[1:]
    for line in (BAGS / 'README.md').read_text(encoding='utf-8').splitlines()
    if line.startswith('actuator-glue simulate')
]
# Half a per cent of the sensor noise: other compilers and processors may round otherwise.
TOLERANCE = 5e-8  # m


def test_every_bag_has_its_command() -> None:
    """No bag of unknown origin."""
    made = {Path(c[1]).name for c in COMMANDS} | {'session', 'older_session'}
    assert made == {p.name for p in BAGS.iterdir() if p.is_dir()}


def test_session_holds_a_closed_loop() -> None:
    """The recorded run has what the layouts draw: bands, a diagnosis, a change of the model."""
    summary = summarise(BAGS / 'session')
    assert summary.finished and not summary.damage
    names = ('EstimatorSetup', 'PosteriorMoments', 'PredictionBand', 'Diagnosis')
    found = {n: [m for _, m in decoded(BAGS / 'session', (n,))] for n in names}
    assert [list(m.effects) for m in found['EstimatorSetup']] == [[], ['backlash']]
    assert found['Diagnosis'][0].verdict == 'missing-effect'
    windows = [p.window for p in found['PosteriorMoments']]
    assert windows == sorted(set(windows)) and len(windows) > 20
    noise = [b for b in found['PredictionBand'] if b.scored and b.kind == 'noise']
    assert noise[-1].widest_coverage > 0.9 > noise[0].widest_coverage
    assert noise[-1].rms_error < 0.7 * noise[0].rms_error


@pytest.mark.parametrize('command', COMMANDS, ids=lambda c: Path(c[1]).name)
def test_command_makes_the_bag(command: list[str], tmp_path: Path) -> None:
    """Made again, a bag holds the same samples and set-up."""
    kept, made = BAGS / Path(command[1]).name, tmp_path / 'made'
    assert main([command[0], str(made), *command[2:]]) == 0
    assert summarise(kept).finished and not summarise(kept).damage
    old, new = read_records(kept), read_records(made)
    assert len(old) == len(new) == 1
    for a, b in zip(old, new, strict=True):
        assert (a.stiffness, a.period, a.hold, len(a)) == (b.stiffness, b.period, b.hold, len(b))
        assert np.abs(a.command - b.command).max() < TOLERANCE
        assert np.abs(a.measured - b.measured).max() < TOLERANCE


@pytest.mark.slow
def test_the_session_replays_to_the_bit(capsys: pytest.CaptureFixture[str]) -> None:
    """As its page promises; a change of the sampler makes another session, recorded anew."""
    code = main(['replay', str(BAGS / 'session')])
    assert code == 0, f'make it again as {BAGS.name}/README.md says\n{capsys.readouterr().out}'
