"""A machine tried under one stiffness says little of itself under another; that is no fault."""

import numpy as np
import pytest

from actuator_glue.diagnosis.posterior import discrepancy, posterior
from actuator_glue.diagnosis.posterior.answer_posterior import Side
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import Scorer, splits_of
from actuator_glue.diagnosis.verdict import held_out_reach
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE, NOISE = 128.0, 1e-5
THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])
PLAIN = Structure(())


def record(rng: np.random.Generator, stiffness: float, gain: float = 1.0) -> Record:
    """A sweep of a healthy machine, whose command may have been scaled by an untold gain."""
    t = np.arange(int(40 * RATE)) / RATE
    command = 2e-3 * np.sin(np.pi * (10.0 / 40.0) * t**2)
    silent = Record(gain * command, command, 1 / RATE, stiffness=stiffness)
    y = PLAIN.simulate(THETA, silent) + NOISE * rng.standard_normal(len(t))
    return Record(command, y, 1 / RATE, stiffness=stiffness)


@pytest.mark.parametrize('gain', [1.0, 1.1])
def test_what_one_stiffness_leaves_open_is_no_contradiction(gain: float, rng_seed: int) -> None:
    """The oil's stiffness is unknown until a test without specimen tells it; a gain it is not.

    The bound is three standard deviations of the noise's rms.
    """
    rng = np.random.default_rng(rng_seed)
    refits = Refits(Data.whole([record(rng, 400e3)]), ('backlash',))
    base = refits.base()
    refits.scorer = scorer = Scorer.of(refits.data, splits_of(refits.data, base.error))
    draws = posterior.sample(
        PLAIN,
        base,
        scorer,
        beside=discrepancy.beside(discrepancy.responses(refits, 5e-6), (), scorer),
        rng=rng,
        evaluations=0,
        progress=lambda share: None,
    ).points
    held = Data.whole([record(rng, 0.0, gain)])
    alone = held.target - held.simulate(PLAIN, base.theta)[0]
    left = held_out_reach.reached(scorer, held, Side(PLAIN, base.theta, draws))
    if gain == 1.0:
        assert left is not None and left < NOISE * (1.0 + 3.0 / np.sqrt(2.0 * alone.size))
    else:
        assert left is None or left > 3.0 * NOISE
