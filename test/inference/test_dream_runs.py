"""Runs of the sampler: reproducibility, what ends them, burn-in, impossible regions, bad input."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
import targets
from scipy import stats

from actuator_glue.errors import InputError
from actuator_glue.inference.adaptation import rescue
from actuator_glue.inference.dream import Chains, SamplerSettings, init, sample, step
from actuator_glue.inference.posterior import Target
from actuator_glue.inference.posterior import sample as sample_posterior
from actuator_glue.records import Array


def _short(seed: int, evaluations: int = 6000, **settings: object) -> Chains:
    target = targets.scales()
    return sample(
        np.random.default_rng(seed),
        target.log_density,
        target.lower,
        target.upper,
        evaluations=evaluations,
        settings=SamplerSettings(population=100, **settings),
    )


def _digest(chains: Chains) -> str:
    return hashlib.sha256(chains.draws.tobytes() + chains.log_density.tobytes()).hexdigest()


def test_same_seed_same_bits_in_another_process() -> None:
    here = _digest(_short(7))
    assert here == _digest(_short(7))
    assert here != _digest(_short(8))
    code = 'import test_dream_runs as t; print(t._digest(t._short(7)))'
    there = subprocess.run(
        [sys.executable, '-c', code],
        capture_output=True,
        text=True,
        check=True,
        # Which kernels BLAS takes and how many threads, by variables, changes the last bits.
        env=os.environ | {'PYTHONPATH': ':'.join(p for p in sys.path if p)},
    )
    assert there.stdout.strip() == here


def test_a_shorter_run_is_the_beginning_of_a_longer_one() -> None:
    long, short = _short(3, 6000), _short(3, 4000)
    assert np.array_equal(long.draws[: len(short.draws)], short.draws)
    assert short.burn == SamplerSettings().adaptation


@pytest.mark.parametrize(('evaluations', 'share'), [(1500, 0.0), (1500, 0.9), (9000, 0.5)])
def test_burn_in_is_a_share_of_the_run_and_never_ends_inside_the_adaptation(
    evaluations: int, share: float
) -> None:
    archive = targets.scales().draw(np.random.default_rng(0), 400)
    settings = SamplerSettings(population=100, burn_in=share)
    target = targets.scales()
    chains = sample(
        np.random.default_rng(1),
        target.log_density,
        target.lower,
        target.upper,
        evaluations=evaluations,
        settings=settings,
        archive=archive,
    )
    steps = len(chains.draws)
    assert chains.burn == max(min(settings.adaptation, steps), int(share * steps))
    assert len(chains.kept) == steps - chains.burn


def test_a_run_that_ends_in_its_adaptation_gives_no_posterior() -> None:
    target = targets.scales()
    wanted = Target(target.log_density, (target.lower, target.upper))
    settings = SamplerSettings(population=100)
    with pytest.raises(InputError, match='no posterior was reached'):
        sample_posterior(
            wanted, (1,), 20_000, settings=settings, stop=lambda state: state.made >= 50
        )
    found = sample_posterior(
        wanted, (1,), 20_000, settings=settings, stop=lambda state: state.made >= 90
    )
    assert len(found.kept) >= 30


@pytest.mark.slow
def test_variance_of_means_is_what_the_effective_sample_size_says(rng_seed: int) -> None:
    """Over replicates, (mean - truth)^2 ESS / variance is chi-squared with as many degrees.

    Twenty per cent either way are allowed to the reported ESS itself.
    """
    target, count = targets.scales(), 60
    ratio = np.empty((count, 4))
    for i, rng in enumerate(np.random.default_rng(rng_seed).spawn(count)):
        chains = sample(rng, target.log_density, target.lower, target.upper, evaluations=8000)
        error = (chains.posterior().mean(axis=0) - target.mean) / target.sd
        ratio[i] = error**2 * chains.ess
    total = ratio.sum(axis=0)
    # One false failure in a million runs, over four parameters and two sides.
    assert (total < 1.2 * stats.chi2.isf(1e-6 / 8, count)).all(), total / count
    assert (total > 0.8 * stats.chi2.ppf(1e-6 / 8, count)).all(), total / count


def test_the_published_sampler_has_the_published_moves_only() -> None:
    published = SamplerSettings.published()
    assert [move.name for move in published.moves] == ['parallel', 'snooker']
    target = targets.scales()
    chains = sample(
        np.random.default_rng(1),
        target.log_density,
        target.lower,
        target.upper,
        evaluations=6000,
        settings=published,
    )
    assert chains.draws.shape[1] == 3 and chains.start_evaluations == 3
    assert chains.burn == len(chains.draws) // 2


def test_step_leaves_the_given_state_as_it_is_and_branches_do_not_meet() -> None:
    target = targets.scales()
    rng = np.random.default_rng(5)
    state = init(rng, target.log_density, target.lower, target.upper, SamplerSettings(thinning=1))
    before = [
        np.array(part) for part in (state.now.x, state.now.z, state.archive.rows, state.counts)
    ]

    def walk(seed: int) -> Array:
        rng, now = np.random.default_rng(seed), state
        for _ in range(5):
            now, _info = step(rng, now)
        return np.array(now.archive.rows)

    first, other, again = walk(1), walk(2), walk(1)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    for old, part in zip(
        before, (state.now.x, state.now.z, state.archive.rows, state.counts), strict=True
    ):
        assert np.array_equal(old, part)


def test_burn_in_ends_what_must_end() -> None:
    target = targets.scales()
    rng = np.random.default_rng(1)
    settings = SamplerSettings(adaptation=30, thinning=3)
    state = init(rng, target.log_density, target.lower, target.upper, settings)
    fits = []
    for _ in range(2000):
        old = state
        state, _ = step(rng, state)
        if not old.adapting:
            assert np.array_equal(
                state.context.tuning.crossover_cdf, old.context.tuning.crossover_cdf
            )
            if state.fitted != old.fitted:
                fits.append(state.fitted)
    assert fits and all(b >= 2 * a for a, b in pairwise(fits))


def test_outlier_chains_are_found_and_rescued_in_burn_in_only() -> None:
    for total, where in (
        ([-10.0, -11.0, -9.0, -10.5, -500.0], [0, 1, 2, 3, 2]),
        ([-10.0, -11.0, -9.0, -10.5, -12.0], [0, 1, 2, 3, 4]),
    ):
        walk = [np.arange(5.0)[:, None], np.arange(5.0)[:, None], np.arange(5.0), np.arange(5.0)]
        rescue(*walk, np.array(total))
        assert all(part.ravel().tolist() == where for part in walk)

    target = targets.scales()
    settings = SamplerSettings(chains=8, adaptation=20, thinning=5)

    def stranded(made: int) -> bool:
        """Put one chain where no move leads away from, see whether it is brought back."""
        rng = np.random.default_rng(2)
        state = init(rng, target.log_density, target.lower, target.upper, settings)
        values = state.now.log_density.copy()
        values[3] = -1e6

        def nowhere_but_there(x: Array) -> Array:
            found = target.log_density(x)
            found[3] = -np.inf
            return found

        x, z = state.now.x.copy(), state.now.z.copy()
        z[3] = 5.0
        now = state.now._replace(x=x, z=z, log_density=values)
        state = state._replace(now=now, made=made, log_density=nowhere_but_there)
        for _ in range(10):
            state, _ = step(rng, state)
        return bool((state.now.z[3] == 5.0).all())

    assert not stranded(0)
    assert stranded(20)
