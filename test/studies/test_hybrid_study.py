"""The study of predictions: its truths are the benchmark's, its findings follow the outcomes."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from actuator_glue.errors import InputError
from studies.hybrid import __main__ as command
from studies.hybrid import library, outcomes, trial
from studies.hybrid.actuators import EFFECTS, drawn
from studies.hybrid.judgement import EDGES, FALSE_ALARM, findings, limits
from studies.hybrid.trial import Outcome


def test_a_truth_is_the_benchmark_s_plant() -> None:
    """Delay at 5 Hz within the published spread."""
    delays = []
    for seed in range(40):
        one = drawn(seed)
        names = library.Structure(EFFECTS).names
        first = {name: values[:1] for name, values in one.specimen.items()}
        loop = library.Loop.of(one.test, one.theta[None], names, EFFECTS, first)
        gain = loop.actuators.system.response(np.array([[2j * np.pi * 5.0]]))
        delays.append(-1e3 * float(np.angle(gain[0, 0])) / (10.0 * np.pi))
    assert np.mean(delays) == pytest.approx(22.74, abs=0.35)  # 4 standard errors
    assert 0.3 < np.std(delays) < 0.85


def test_no_two_uses_of_a_seed_share_their_numbers() -> None:
    """The test that is predicted has noise of its own, other than that of the prediction."""
    uses = [library.stream(7, use) for use in ('actuator', 'prediction', 'sensors')]
    starts = {seed: np.random.default_rng(seed).random() for seed in uses}
    starts |= {(seed, 0): np.random.default_rng((seed, 0)).random() for seed in uses}
    assert len({starts[seed] for seed in uses}) == 3
    assert starts[uses[1]] != starts[uses[2], 0]


def outcome(seed: int, predicted: float, unstable: bool, inside: float | None = 0.95) -> Outcome:
    """An outcome."""
    return Outcome(seed, predicted, 300.0, unstable, float(inside is None), inside, 0.02, 1.0)


def test_findings_follow_the_outcomes() -> None:
    """Bins and their limits, the Brier score, what is not met, what has no band."""
    good = [outcome(i, 0.3, i < 3) for i in range(10)] + [outcome(10, 1.0, True, None)] * 5
    found = findings(good)
    assert [(b.count, b.unstable, b.met) for b in found.bins] == [(10, 3, True), (5, 5, True)]
    assert found.brier == pytest.approx((3 * 0.49 + 7 * 0.09) / 15, abs=1e-3)
    assert found.reliable and found.covered and found.banded == 10
    wrong = findings([outcome(i, 0.0, True, 0.5) for i in range(8)])
    assert not wrong.reliable and not wrong.covered and 'NOT reliable' in wrong.text()
    assert wrong.worst == wrong.coverage == 0.5


def test_limits_of_a_bin_are_binomial() -> None:
    """Equal probabilities give the binomial distribution's quantiles."""
    for p in (0.02, 0.4, 0.9):
        least, most = limits(np.full(40, p), 0.05)
        assert least == binom.ppf(0.025, 40, p) and most == binom.ppf(0.975, 40, p)


@pytest.mark.slow
def test_right_predictions_are_refused_as_seldom_as_stated(rng_seed: int) -> None:
    """All bins together: 5 % at most, the counts being whole; wrong ones are found.

    Seeds vary; with 300 studies the share has a standard error of 1.3 %, five of which are 6.
    """
    rng = np.random.default_rng(rng_seed)
    refused = caught = 0
    for _ in range(300):
        p = rng.beta(0.3, 0.3, 300)
        hits = rng.random(300) < p
        some = [
            outcome(i, float(a), bool(b)) for i, (a, b) in enumerate(zip(p, hits, strict=True))
        ]
        refused += not findings(some).reliable
        sharper = np.clip(p + 0.15 * np.sign(p - 0.5), 0.0, 1.0)
        bold = [
            outcome(i, float(a), bool(b))
            for i, (a, b) in enumerate(zip(sharper, hits, strict=True))
        ]
        caught += not findings(bold).reliable
    assert refused <= 300 * (FALSE_ALARM + 0.065)
    assert caught > 270  # 97 % are, seen in 600 studies: 292, standard error 2.8
    assert EDGES[0] == 0.0 and EDGES[-1] == 1.0


def test_the_command_writes_what_it_found_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of outcomes that are given here; what is noted is not made again."""
    asked: list[int] = []

    def given(seed: int) -> Outcome:
        asked.append(seed)
        return outcome(seed, 0.0 if seed < 3 else 1.0, seed > 2)

    monkeypatch.setattr(outcomes, 'trial', given)
    out = tmp_path / 'out'
    assert command.main(['--actuators', '3', '--out', str(out)]) == 0
    with (out / command.KEPT).open('a') as file:
        file.write('{"seed": 4, "predic')  # stopped while writing
    assert command.main(['--actuators', '5', '--out', str(out)]) == 0
    assert asked == [1, 2, 3, 4, 5]
    content = json.loads((out / command.NUMBERS).read_text())
    assert [a['seed'] for a in content['actuators']] == [1, 2, 3, 4, 5]
    assert content['reliable'] and (out / command.PICTURE).stat().st_size > 1000
    assert 'Brier' in capsys.readouterr().out
    assert command.main(['--actuators', '0', '--out', str(out)]) == 2
    monkeypatch.setattr(trial, 'EVALUATIONS', 1)
    assert command.main(['--actuators', '5', '--out', str(out)]) == 2
    assert 'other settings' in capsys.readouterr().err
    with pytest.raises(InputError, match='no outcomes'):
        (out / command.KEPT).write_text('nonsense\n')
        outcomes.Outcomes(out / command.KEPT)
