"""Long records: rough refits on stretches of them, finished on all samples."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.diagnosis.score.scorer import Scorer, splits_of
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.stretches import stretches
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 128.0
THETA = [235.0, 5.0e10, 4.23e6, 3.3]


def long_record(effects: tuple[str, ...], own: list[float], seconds: float = 300.0) -> Record:
    """Return a slow sweep of a machine with some effects, noise of 3 um."""
    t = np.arange(round(seconds * RATE)) / RATE
    command = 2e-3 * np.sin(np.pi * (5.0 / seconds) * t**2)
    bare = Record(command, np.zeros(len(t)), 1 / RATE, stiffness=250e3)
    y = Structure(effects).simulate(np.array([*THETA, *own]), bare)
    noise = 3e-6 * np.random.default_rng(0).standard_normal(len(t))
    return replace(bare, measured=y + noise)


def test_short_records_are_taken_whole() -> None:
    """Two minutes in all and below."""
    assert stretches(Data.whole([long_record((), [], 50.0)] * 2)) is None


def test_stretches_are_the_samples_they_stand_for() -> None:
    """The rows of a held-out pattern, and the motion with what counts from the test's begin."""
    record = long_record(('drift', 'clock-skew'), [1e-6, 2e-5])
    data = prepare([record], []).fit
    part = stretches(data)
    assert part is not None
    assert part.data.target.size < 0.25 * data.target.size
    np.testing.assert_array_equal(part.data.target, data.target[part.rows])
    model, theta = Structure(('drift', 'clock-skew')), np.array([*THETA, 1e-6, 2e-5])
    whole = data.simulate(model, theta)[0][part.rows]
    np.testing.assert_allclose(part.data.simulate(model, theta)[0], whole, atol=1e-6)


def test_a_candidate_costs_little_more_than_its_last_refit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Most of what is simulated are stretches; the answer is that of all samples."""
    data = prepare([long_record(('backlash',), [5e-5])], []).fit
    refits = Refits(data, ('backlash',))
    refits.scorer = Scorer.of(data, splits_of(data, refits.base().error))
    base, simulated = refits.trial(()), []
    simulate = Structure.simulate

    def counted(self: Structure, theta: np.ndarray, record: Record, **how: object) -> np.ndarray:
        simulated.append(len(np.atleast_2d(theta)) * len(record))
        return simulate(self, theta, record, **how)

    monkeypatch.setattr(Structure, 'simulate', counted)
    found = refits.add(base, 'backlash')
    assert sum(simulated) < 100 * len(data.records[0])
    monkeypatch.undo()
    assert found.fit.theta[-1] == pytest.approx(5e-5, rel=0.02)
    assert found.fit.rms == pytest.approx(refits.polish(found).fit.rms, rel=0.01)
