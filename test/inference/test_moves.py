"""Every move: leaves its target as it is, draws what it says with the probabilities it says."""

from __future__ import annotations

import numpy as np
import pytest
import targets
from scipy import stats

from actuator_glue.inference import metropolis, moves, student
from actuator_glue.inference.adaptation import empty_counts, tuned
from actuator_glue.inference.moves import MOVES
from actuator_glue.inference.moves.draw import distinct
from actuator_glue.inference.moves.move import (
    Move,
    ProposalContext,
    uniforms_per_chain,
    workspace,
)
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.transforms.log import Log
from actuator_glue.records import Array

SETTINGS = SamplerSettings()
# Each check below compares at most 64 statistics with this two-sided normal limit: one false
# failure in 1e5 runs of this whole file.
LIMIT = float(stats.norm.isf(0.5e-5 / 64 / 20))

TARGETS = {
    'corner': targets.corner(),
    'scales': targets.scales(),
    'banana': targets.banana(3, 0.05),
}


def _context(
    points: Array, move: Move, settings: SamplerSettings = SETTINGS, box: Log | None = None
) -> ProposalContext:
    """Context fitted to points, in which nothing but one move is made."""
    d = points.shape[1]
    box = box or Log(np.full(d, -1.0), np.full(d, 1.0))
    fitted = tuned(points, empty_counts(settings), settings, box)
    cdf = np.cumsum([float(other is move) for other in settings.moves])
    return fitted._replace(tuning=fitted.tuning._replace(move_cdf=cdf))


def _tuned(context: ProposalContext, **parts: Array) -> ProposalContext:
    return context._replace(tuning=context.tuning._replace(**parts))


def _propose(rng, z, rows, context):
    uniforms = rng.random((len(z), uniforms_per_chain(MOVES, z.shape[1], context.knobs.pairs)))
    candidate, x = np.empty_like(z), np.empty_like(z)
    space = workspace(*z.shape, context.knobs.pairs)
    metropolis.propose(z, uniforms, rows, len(rows), context, candidate, x, space)
    return candidate, space


def _worst(
    target: targets.Target, move: Move, correct: bool, rng_seed: int
) -> tuple[float, float]:
    """Largest |z| of first and second moments after 12 steps from exact draws.

    The chains start as independent exact draws and share an archive independent of them, so they
    remain independent exact draws if, and only if, the move leaves the target invariant.
    """
    rng = np.random.default_rng(rng_seed)
    box = Log(target.lower, target.upper)
    chains = 30_000
    rows = box.forward(target.draw(rng, 500))
    z = box.forward(target.draw(rng, chains))
    context = _context(rows, move, box=box)
    x, jacobian = box.inverse(z)
    values = target.log_density(x)
    where = values + jacobian
    moved = 0.0
    for _ in range(12):
        new, space = _propose(rng, z, rows, context)
        new_x, _ = box.inverse(new)
        new_values = target.log_density(new_x)
        goal = new_values + space.log_jacobian
        if not correct:
            space.correction[:] = 0.0
        metropolis.accept(z, x, values, where, new, new_x, new_values, goal, space)
        z, x, values, where = new, new_x, new_values, goal
        moved += space.accepted.mean() / 12
    scaled = (x - target.mean) / target.sd
    exact = (target.draw(rng, chains) - target.mean) / target.sd
    worst = 0.0
    for statistic in (
        lambda s: s,
        lambda s: s**2,
        lambda s: s * np.roll(s, 1, axis=1),
        lambda s: (s < -0.5).astype(float),
    ):
        here, there = statistic(scaled), statistic(exact)
        error = np.sqrt((here.var(axis=0) + there.var(axis=0)) / chains)
        worst = max(worst, float(np.abs((here.mean(axis=0) - there.mean(axis=0)) / error).max()))
    return worst, moved


@pytest.mark.parametrize('name', TARGETS)
@pytest.mark.parametrize('move', MOVES, ids=lambda move: move.name)
def test_move_leaves_its_target_invariant(move: Move, name: str, rng_seed: int) -> None:
    worst, moved = _worst(TARGETS[name], move, True, rng_seed)
    assert worst < LIMIT
    assert moved > 0.05


@pytest.mark.parametrize('move', MOVES[1:], ids=lambda move: move.name)
def test_a_missing_hastings_correction_is_noticed(move: Move, rng_seed: int) -> None:
    worst, _ = _worst(TARGETS['scales'], move, False, rng_seed)
    assert worst > 2.0 * LIMIT


def test_folding_at_the_bounds_would_not_be_exact(rng_seed: int) -> None:
    """Why bounds are mapped away: reflected archive differences lose detailed balance."""
    target = TARGETS['corner']
    rng = np.random.default_rng(rng_seed)
    chains = 30_000
    rows = target.draw(rng, 2000)
    x = target.draw(rng, chains)
    values = target.log_density(x)
    for _ in range(12):
        a, b = rng.integers(0, len(rows), (2, chains))
        new = np.abs(x + 1.2 * (rows[a] - rows[b]))
        new = np.where(new > 8.0, 16.0 - new, new)
        goal = target.log_density(new)
        accept = np.log(rng.random(chains)) < goal - values
        x, values = np.where(accept[:, None], new, x), np.where(accept, goal, values)
    error = (x.mean(axis=0) - target.mean) / target.sd * np.sqrt(chains)
    assert np.abs(error).max() > 2.0 * LIMIT


def _chi_square(observed: Array, probability: Array) -> float:
    return float(stats.chisquare(observed, probability * observed.sum()).pvalue)


def test_archive_indices_are_all_ordered_samples_alike(rng_seed: int) -> None:
    rng = np.random.default_rng(rng_seed)
    counts: dict[tuple[int, ...], int] = {}
    indices = np.empty((3, 4), np.int64)
    for row in rng.random((60_000, 4)):
        distinct(row, 0, 4, 5, indices)
        key = tuple(int(i) for i in indices[0])
        counts[key] = counts.get(key, 0) + 1
    assert all(len(set(key)) == 4 for key in counts)
    assert len(counts) == 120
    assert _chi_square(np.array(list(counts.values())), np.full(120, 1 / 120)) > 1e-6


def test_crossover_classes_and_unit_jumps_occur_as_often_as_they_should(rng_seed: int) -> None:
    rng = np.random.default_rng(rng_seed)
    d, chains = 6, 100_000
    settings = SamplerSettings(unit_jump=0.2, crossovers=3)
    rows = rng.standard_normal((40, d))
    crossover = np.array([0.2, 0.3, 0.5])
    context = _context(rows, moves.PARALLEL, settings)
    context = _tuned(context, crossover_cdf=crossover.cumsum())
    candidate, space = _propose(rng, np.zeros((chains, d)), rows, context)
    assert not space.correction.any()
    used = space.label[:, 1]
    probability = np.concatenate([[0.2], 0.8 * crossover])
    assert _chi_square(np.bincount(used + 1, minlength=4), probability) > 1e-6
    moved = (candidate != 0.0).sum(axis=1)
    assert (moved[(used == -1) | (used == 2)] == d).all()
    for k in (0, 1):
        expected = stats.binom.pmf(np.arange(d + 1), d, (k + 1) / 3)
        expected[1] += expected[0]  # where no coordinate crosses over, one is chosen
        seen = np.bincount(moved[used == k], minlength=d + 1)
        assert seen[0] == 0
        assert _chi_square(seen[1:], expected[1:]) > 1e-6
    lone = candidate[moved == 1] != 0.0
    assert _chi_square(lone.sum(axis=0), np.full(d, 1 / d)) > 1e-6


def test_archive_pairs_occur_as_often_as_they_should_with_their_jump_rate(rng_seed: int) -> None:
    """Rows of the archive are unit vectors: a candidate shows which ones made it."""
    rng = np.random.default_rng(rng_seed)
    d, chains = 12, 100_000
    settings = SamplerSettings(jitter=0.0, noise=1e-12, unit_jump=0.2, crossovers=1, pairs=3)
    rows = np.eye(d)
    context = _context(rows, moves.PARALLEL, settings)
    candidate, space = _propose(rng, np.zeros((chains, d)), rows, context)
    plus, minus = (candidate > 0.01), (candidate < -0.01)
    pairs = plus.sum(axis=1)
    assert (pairs == minus.sum(axis=1)).all()
    unit = space.label[:, 1] == -1
    assert (pairs[unit] == 1).all()
    assert _chi_square(np.bincount(pairs[~unit], minlength=4)[1:], np.full(3, 1 / 3)) > 1e-6
    gamma = np.where(unit, 1.0, 2.38 / np.sqrt(2.0 * pairs * d))
    assert np.allclose(candidate[plus], np.broadcast_to(gamma[:, None], plus.shape)[plus])
    assert np.allclose(candidate[minus], -np.broadcast_to(gamma[:, None], plus.shape)[minus])
    for rows_used in (plus, minus):
        assert _chi_square(rows_used[pairs == 1].sum(axis=0), np.full(d, 1 / d)) > 1e-6


def test_snooker_stays_on_its_line_and_carries_its_jacobian(rng_seed: int) -> None:
    rng = np.random.default_rng(rng_seed)
    d = 5
    rows = rng.standard_normal((3, d))
    z = rng.standard_normal((200, d))
    scale = np.array([1.0, 10.0, 0.1, 3.0, 1.0])
    candidate, space = _propose(rng, z, rows, _tuned(_context(rows, moves.SNOOKER), scale=scale))
    step = (candidate - z) / scale
    found = np.zeros(len(z), bool)
    for anchor, one, two in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):
        line = (z - rows[anchor]) / scale
        unit = line / np.linalg.norm(line, axis=1, keepdims=True)
        projected = (unit * (rows[one] - rows[two]) / scale).sum(axis=1)
        gamma = (step * unit).sum(axis=1) / projected
        fits = (np.abs(step - gamma[:, None] * projected[:, None] * unit).max(axis=1) < 1e-9) & (
            (np.abs(gamma) >= 1.2 - 1e-9) & (np.abs(gamma) <= 2.2 + 1e-9)
        )
        lengths = np.linalg.norm((candidate - rows[anchor]) / scale, axis=1) / np.linalg.norm(
            line, axis=1
        )
        assert np.allclose(space.correction[fits], (d - 1) * np.log(lengths[fits]), atol=1e-9)
        found |= fits
    assert found.all()


def test_independence_draws_have_the_density_it_claims(rng_seed: int) -> None:
    """Importance weights of the draws against a known Gaussian integrate it to one."""
    rng = np.random.default_rng(rng_seed)
    d, count = 5, 200_000
    points = targets.equicorrelated(d).draw(rng, 2000)
    context = _context(points, moves.INDEPENDENCE)
    tuning = context.tuning
    z = np.tile(tuning.centre, (count, 1))
    drawn, space = _propose(rng, z, points, context)
    t = stats.multivariate_t(tuning.centre, tuning.factor @ tuning.factor.T, df=student.DEGREES)
    log_q = t.logpdf(drawn)
    # The correction is ln q(centre) - ln q(candidate).
    assert np.allclose(space.correction, t.logpdf(tuning.centre) - log_q, atol=1e-9)
    normal = stats.multivariate_normal(tuning.centre, tuning.factor @ tuning.factor.T)
    weights = np.exp(normal.logpdf(drawn) - log_q)
    error = weights.std() / np.sqrt(count)
    assert abs(weights.mean() - 1.0) < LIMIT * error
    cross = weights * (drawn[:, 0] - tuning.centre[0]) * (drawn[:, 4] - tuning.centre[4])
    exact = (tuning.factor @ tuning.factor.T)[0, 4]
    assert abs(cross.mean() - exact) < LIMIT * cross.std() / np.sqrt(count)


@pytest.mark.parametrize('dimension', [1, 2, 5])
def test_an_independent_draw_knows_how_far_from_the_centre_it_is(dimension, rng_seed):
    rng = np.random.default_rng(rng_seed)
    centre = rng.standard_normal(dimension)
    spread = rng.standard_normal((dimension, dimension))
    factor = np.linalg.cholesky(spread @ spread.T + np.eye(dimension))
    point = np.empty(dimension)
    for uniforms in rng.random((20, dimension + 4)):
        distance2 = student.draw(uniforms, 0, centre, factor, point)
        away = np.linalg.solve(factor, point - centre)
        np.testing.assert_allclose(distance2, away @ away, rtol=1e-9)
