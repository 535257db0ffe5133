"""Discrepancies of unknown scale: what they leave open, and what they must not."""

import numpy as np
import pytest
from scipy import stats

from actuator_glue.diagnosis.posterior.discrepancy import _SCALES, Discrepancy, beside, responses
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import Scorer, splits_of
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

N = 400
WIDE = np.full(2, 10.0)


def test_the_likelihood_is_that_of_the_mixture() -> None:
    """Closed form against the normal densities of all scales, with their full covariances."""
    rng = np.random.default_rng(1)
    rows = 3.0 * rng.standard_normal((3, 12))
    errors = rng.standard_normal((4, 12)) + rng.standard_normal((4, 3)) @ rows
    prior = np.full(len(_SCALES), 0.5 / (len(_SCALES) - 1))
    prior[0] = 0.5
    expected = np.log(
        sum(
            p * stats.multivariate_normal(cov=1.7 * np.eye(12) + s**2 * rows.T @ rows).pdf(errors)
            for p, s in zip(prior, _SCALES, strict=True)
        )
    )
    found = Discrepancy.of(rows).log_likelihood(errors, 1.7)
    # Up to a constant, which the noise alone decides.
    assert found - expected == pytest.approx(np.full(4, (found - expected)[0]), abs=1e-9)


def test_what_diverged_is_impossible(rng_seed: int) -> None:
    """Whether it ran out of numbers or became none; nothing is said of the others."""
    rng = np.random.default_rng(rng_seed)
    errors = rng.standard_normal((4, N))
    errors[1, -1], errors[2, -1] = 1e200, np.nan
    found = Discrepancy.of(rng.standard_normal((3, N)))
    with np.errstate(all='raise'):
        likely = found.log_likelihood(errors, 1.0)
    assert (likely[1:3] == -np.inf).all()
    assert (likely[[0, 3]] == found.log_likelihood(errors[[0, 3]], 1.0)).all()


def test_a_clean_record_keeps_its_narrow_interval() -> None:
    """Noise alone: the spread is that of least squares; beside a shape that is there, it is not.

    The shape pulls the first parameter by half of its size; the allowance holds the truth.
    """
    rng = np.random.default_rng(2)
    jac = rng.standard_normal((2, N))
    shape = 0.5 * jac[0] + rng.standard_normal(N)
    beside = Discrepancy.of(0.8 * shape[None])
    noise = rng.standard_normal(N)
    plain = np.sqrt(np.diag(np.linalg.inv(jac @ jac.T)))
    _, covariance = beside.gaussians(jac, noise, 1.0, WIDE).moments()
    assert np.sqrt(np.diag(covariance)) == pytest.approx(plain, rel=0.1)
    error = noise + 0.6 * shape
    alone = np.linalg.solve(jac @ jac.T, jac @ error)
    assert alone[0] > 4.0 * plain[0]
    move, covariance = beside.gaussians(jac, error, 1.0, WIDE).moments()
    assert abs(move[0]) < 2.5 * np.sqrt(covariance[0, 0])


def test_what_no_record_tells_keeps_the_width_of_the_bounds() -> None:
    """Two parameters that do the same: their sum is known, neither of them is."""
    rng = np.random.default_rng(3)
    row = rng.standard_normal(N)
    empty = Discrepancy.of(np.empty((0, N)))
    move, covariance = empty.gaussians(np.stack([row, row]), row, 1.0, WIDE).moments()
    assert np.sqrt(np.diag(covariance)) == pytest.approx(WIDE / np.sqrt(2.0), rel=0.01)
    assert move.sum() == pytest.approx(1.0, abs=0.01)
    assert np.sqrt(covariance.sum()) == pytest.approx(1.0 / np.linalg.norm(row), rel=0.01)


def test_each_record_may_have_a_zero_of_its_own(rng_seed: int) -> None:
    """Whatever offset and drift each one has, the shapes take it up, and no more than that."""
    rng = np.random.default_rng(rng_seed)
    t = np.arange(0.0, 20.0, 1.0 / 64.0)
    records = []
    for k in (0.0, 250e3):
        bare = Record(2e-3 * np.sin(t**2), 0.0 * t, 1.0 / 64.0, stiffness=k)
        measured = Structure(()).simulate(TABLE_2, bare) + 1e-5 * rng.standard_normal(len(t))
        records.append(Record(bare.command, measured, bare.period, stiffness=k))
    refits = Refits(Data.whole(records), ('gain',))
    scorer = Scorer.of(refits.data, splits_of(refits.data, refits.base().error))
    small = responses(refits, 5e-6)
    own = np.concatenate([a + b * t for a, b in rng.standard_normal((2, 2))])
    shapes = beside(small, ('gain',), scorer)
    assert len(shapes.shapes) == 4
    assert np.linalg.norm(shapes.without(scorer.whiten(own))) < 1e-6 * np.linalg.norm(own / 1e-5)
    moves = scorer.whiten(np.concatenate([r.command for r in records]))
    assert np.linalg.norm(shapes.without(moves)) > 0.9 * np.linalg.norm(moves)
