"""Importance sampling: its weights, its draws, and when it gives none."""

from collections.abc import Callable

import arviz as az
import numpy as np
import pytest
from scipy.stats import truncnorm

from actuator_glue.inference import importance

WANTED = 400


@pytest.mark.parametrize('spread', [0.3, 1.0, 2.0, 4.0])
def test_weights_are_smoothed_as_by_arviz(spread: float) -> None:
    """Impossible points have no weight."""
    log_weights = spread * np.random.default_rng(3).standard_normal(600)
    log_weights[:7] = -np.inf
    weights, shape = importance.smoothed(log_weights)
    reference, k = az.psislw(np.where(np.isfinite(log_weights), log_weights, -1e6))
    assert shape == pytest.approx(float(k), rel=1e-9)
    assert weights == pytest.approx(np.exp(reference), abs=1e-12)


@pytest.mark.parametrize('spread', [200.0, 400.0, 4000.0])
def test_weights_over_thousands_of_decades_overflow_nothing(spread: float, rng_seed: int) -> None:
    """One point outweighs all others; a tail that wide has hardly a shape."""
    rng = np.random.default_rng(rng_seed)
    for log_weights in spread * rng.standard_normal((200, 1920)):
        with np.errstate(over='raise'):
            weights, shape = importance.smoothed(log_weights)
        assert shape > 1.0
        assert weights.sum() == pytest.approx(1.0)


def test_a_tail_that_reaches_the_least_numbers_overflows_nothing() -> None:
    """The weight that the tail's width is taken from, a number that has no inverse."""
    log_weights = np.full(1920, -2000.0)
    log_weights[:5] = [0.0, -7.0, -114.0, -522.0, -713.8]
    with np.errstate(over='raise'):
        weights, _ = importance.smoothed(log_weights)
    assert weights[0] == pytest.approx(1.0, rel=1e-3)


START = importance.StudentMixture(np.ones(1), np.zeros((1, 3)), np.eye(3)[None])


def normal(z: np.ndarray) -> np.ndarray:
    """Twice as likely and half a standard deviation from where it is looked for."""
    return -0.25 * ((z - 0.7) ** 2).sum(axis=1)


def cut(z: np.ndarray) -> np.ndarray:
    """Nothing beyond a bound."""
    return np.where((z > -1.0).all(axis=1), -0.5 * (z**2).sum(axis=1), -np.inf)


CUT = truncnorm(-1.0, np.inf)


@pytest.mark.parametrize(
    ('density', 'mean', 'sd'), [(normal, 0.7, 2.0**0.5), (cut, CUT.mean(), CUT.std())]
)
def test_draws_are_of_the_density_and_worth_what_they_say(
    density: Callable[[np.ndarray], np.ndarray], mean: float, sd: float
) -> None:
    """Means of 60 runs: five standard errors, and their variance against the effective draws.

    The ratio is 0.95 to 1.25 over 300 runs; of 180 numbers it scatters by 0.11.
    """
    seeds = map(np.random.default_rng, range(60))
    runs = [importance.sample(rng, density, START, WANTED)[0] for rng in seeds]
    found = [run for run in runs if run is not None]
    assert len(found) > 50
    assert min(run.effective for run in found) >= WANTED
    assert max(run.pareto_k for run in found) < 0.5
    means = np.array([run.points.mean(axis=0) for run in found])
    spreads = np.array([run.points.std(axis=0) for run in found])
    assert means.mean(axis=0) == pytest.approx(mean, abs=5 * sd / np.sqrt(WANTED * len(found)))
    assert spreads.mean(axis=0) == pytest.approx(sd, rel=0.03)
    worth = np.mean([run.effective for run in found])
    assert 0.6 < np.mean((means - mean) ** 2) * worth / sd**2 < 1.8


def test_a_spike_and_a_slab_are_drawn_from_a_mixture() -> None:
    """Half of the mass each, one fifty times as wide: the share of the spike, four errors.

    From one Student t as wide as the slab nothing would ever fall on the spike.
    """
    widths, roots = np.array([0.02, 1.0]), np.array([0.02, 1.0])[:, None, None] * np.eye(3)

    def density(z: np.ndarray) -> np.ndarray:
        squares = ((z - 0.3) ** 2).sum(axis=1)
        return np.logaddexp(*(-0.5 * squares / w**2 - 3.0 * np.log(w) for w in widths))

    mixture = importance.StudentMixture(np.array([0.9, 0.1]), np.full((2, 3), 0.3), roots)
    for seed in range(5):
        found, _ = importance.sample(np.random.default_rng(seed), density, mixture, WANTED)
        assert found is not None
        near = np.linalg.norm(found.points - 0.3, axis=1) < 0.1
        assert near.mean() == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(WANTED))


@pytest.mark.parametrize('bend', [0.7, 2.0, 5.0])
def test_the_ends_of_a_bent_ridge_are_found(bend: float) -> None:
    """Too narrow by 10 to 30 % where it ended with the first 400 effective draws."""

    def ridge(z: np.ndarray) -> np.ndarray:
        off = z[:, 1] - bend * (z[:, 0] ** 2 - 1.0)
        return np.asarray(-0.5 * (z[:, 0] ** 2 + off**2 + z[:, 2] ** 2))

    seeds = map(np.random.default_rng, range(12))
    runs = [importance.sample(rng, ridge, START, WANTED)[0] for rng in seeds]
    spreads = [run.points.std(axis=0) for run in runs if run is not None]
    assert len(spreads) > 9
    wide = np.array([1.0, np.sqrt(1.0 + 2.0 * bend**2), 1.0])
    assert np.mean(spreads, axis=0) / wide == pytest.approx(1.0, abs=0.12)


def test_none_of_what_it_cannot_reach() -> None:
    """Tails of a Cauchy distribution, and a place where nothing is possible."""

    def tails(z: np.ndarray) -> np.ndarray:
        return -0.55 * np.log1p((z / 0.05) ** 2).sum(axis=1)

    looks: list[int] = []

    def nothing(z: np.ndarray) -> np.ndarray:
        looks.append(len(z))
        return np.full(len(z), -np.inf)

    for density in (tails, nothing):
        for seed in range(3):
            rng = np.random.default_rng(seed)
            assert importance.sample(rng, density, START, WANTED)[0] is None
    # Where nothing is possible it soon gives up.
    assert len(looks) <= 3 * 12


def far(z: np.ndarray) -> np.ndarray:
    """A hill forty of its widths off, four of those of where it is looked for."""
    return -0.5 * (((z - 4.0) / 0.1) ** 2).sum(axis=1)


def wide(z: np.ndarray) -> np.ndarray:
    """Twenty times as wide as where it is looked for."""
    return -0.5 * (((z - 10.0) / 20.0) ** 2).sum(axis=1)


@pytest.mark.parametrize(('density', 'mean', 'sd'), [(far, 4.0, 0.1), (wide, 10.0, 20.0)])
def test_it_goes_on_while_the_mixture_comes_nearer(
    density: Callable[[np.ndarray], np.ndarray], mean: float, sd: float
) -> None:
    """Few effective draws for many batches; mean and spread of a coordinate, five errors."""
    for seed in range(5):
        found, _ = importance.sample(np.random.default_rng(seed), density, START, WANTED)
        assert found is not None
        assert len(found.points) > 5 * 192
        first = found.points[:, 0]
        assert first.mean() == pytest.approx(mean, abs=5 * sd / np.sqrt(WANTED))
        assert first.std() == pytest.approx(sd, rel=5 / np.sqrt(WANTED))


def test_what_it_came_to_is_nearer_than_what_it_began_with() -> None:
    """Where it gives no draws, chains start there: a hill far off that is full of small ones."""

    def rough(z: np.ndarray) -> np.ndarray:
        return np.asarray(far(z) + 3.0 * np.sin(70.0 * z).sum(axis=1))

    for seed in range(5):
        found, reached = importance.sample(np.random.default_rng(seed), rough, START, WANTED)
        assert found is None
        assert np.linalg.norm(reached.centres[0] - 4.0) < 0.2
        assert np.diag(reached.factors[0]).max() < 0.2


def test_two_hills_share_the_draws() -> None:
    """Either three widths from where it begins: half on each, four errors."""

    def hills(z: np.ndarray) -> np.ndarray:
        return np.logaddexp(*(-0.5 * ((z - s) ** 2).sum(axis=1) for s in (-3.0, 3.0)))

    for seed in range(20):
        found, _ = importance.sample(np.random.default_rng(seed), hills, START, WANTED)
        assert found is not None
        share = (found.points[:, 0] > 0.0).mean()
        assert share == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(WANTED))
