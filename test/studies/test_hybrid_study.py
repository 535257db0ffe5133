"""The study of predictions: its truths are the benchmark's, its findings follow the outcomes."""

import json
from pathlib import Path

import numpy as np
import pytest

from studies.hybrid import __main__ as command
from studies.hybrid import library
from studies.hybrid.findings import findings
from studies.hybrid.trial import EFFECTS, Outcome, partition, truth


def test_a_truth_is_the_benchmark_s_plant() -> None:
    """Delay at 5 Hz within the published spread; its loop grows as published at 5 % damping."""
    delays = []
    for seed in range(40):
        theta, specimen = truth(seed)
        names = library.Structure(EFFECTS).names
        loop = library.Loop.of(partition(seed), theta, names, EFFECTS, specimen)
        gain = loop.actuators.system.response(np.array([[2j * np.pi * 5.0]]))
        delays.append(-1e3 * float(np.angle(gain[0, 0])) / (10.0 * np.pi))
    assert np.mean(delays) == pytest.approx(22.74, abs=0.35)  # 4 standard errors
    assert 0.3 < np.std(delays) < 0.85


def outcome(predicted: float, unstable: bool, inside: float = 0.95) -> Outcome:
    """An outcome."""
    return Outcome(1, predicted, unstable, inside, 0.02)


def test_findings_follow_the_outcomes() -> None:
    """Bins, their intervals, the Brier score, what is not met."""
    good = [outcome(0.3, i < 3) for i in range(10)] + [outcome(1.0, True)] * 5
    found = findings(good)
    assert [(b.count, b.unstable, b.met) for b in found.bins] == [(10, 3, True), (5, 5, True)]
    assert found.brier == pytest.approx((3 * 0.49 + 7 * 0.09) / 15)
    wrong = findings([outcome(0.0, True, 0.5)] * 8)
    assert not wrong.bins[0].met and 'NOT met' in wrong.text()
    assert wrong.worst == wrong.coverage == 0.5


def test_the_command_writes_what_it_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Numbers, figure and text of outcomes that are given here."""
    monkeypatch.setattr(command, 'trial', lambda seed: outcome(0.1 * seed, seed > 2))
    assert command.main(['--actuators', '4', '--out', str(tmp_path / 'out')]) == 0
    content = json.loads((tmp_path / 'out' / 'results.json').read_text())
    assert len(content['actuators']) == 4 and content['bins'][0]['count'] == 4
    assert (tmp_path / 'out' / 'reliability.png').stat().st_size > 1000
    assert 'Brier' in capsys.readouterr().out
    assert command.main(['--actuators', '0', '--out', str(tmp_path / 'none')]) == 2
