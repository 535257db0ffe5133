"""Intervals of reported sizes hold the truth as often as they say."""

import numpy as np
import pytest
from scipy import signal

from actuator_glue.diagnosis.posterior import discrepancy, posterior
from actuator_glue.diagnosis.refits.candidates import mean_effects
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import Scorer, splits_of
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import fit
from actuator_glue.model import commands
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 128.0
# Around the paper's machine and the benchmark's.
MACHINES = TABLE_2, np.array([235.0, 5.0e10, 4.23e6, 3.3])


@pytest.mark.slow
def test_what_is_immaterial_is_in_the_intervals() -> None:
    """20 N of friction and 3 um of play, too small to be added, move Eq. (2)'s parameters.

    Of 24 intervals of six machines 22.8 are expected; fewer than 19 come by chance in less than
    one of a hundred runs, even if those of a machine went together in pairs. Without an allowance
    for what is immaterial most of them miss.
    """
    truth, rng = Structure(('coulomb-friction', 'backlash')), np.random.default_rng(6)
    inside, plain = [], []
    for i in range(6):
        base = MACHINES[i % 2] * np.exp(0.15 * rng.standard_normal(4))
        theta = np.append(base, [min(20.0, 2e-6 * base[2]), 3e-6])
        records = []
        for k in (0.0, 250e3):
            u = commands.sweep(RATE, 30.0, 0.1, 8.0, 2e-3)
            y = truth.simulate(theta, Record(u, 0.0 * u, 1.0 / RATE, k))
            records.append(Record(u, y + 1e-5 * rng.standard_normal(len(u)), 1.0 / RATE, k))
        refits = Refits(Data.whole(records), mean_effects())
        found = refits.base()
        scorer = Scorer.of(refits.data, splits_of(refits.data, found.error))
        for hits, small in ((inside, discrepancy.responses(refits, 5e-6)), (plain, {})):
            draws = posterior.sample(
                Structure(()),
                found,
                scorer,
                beside=discrepancy.beside(small, (), scorer),
                rng=rng,
                evaluations=0,
                progress=lambda share: None,
            )
            low, high = np.quantile(draws.points, [0.025, 0.975], axis=0)
            hits.append((low <= base) & (base <= high))
    assert np.sum(inside) >= 19
    assert np.sum(plain) <= 12


@pytest.mark.slow
def test_intervals_under_slow_noise_hold_the_truth() -> None:
    """95 % intervals of 20 machines with half of the noise below 1 Hz.

    Of 140 intervals 133 are expected; fewer than 124 come by chance in less than one of a hundred
    runs, even if those of a machine went together in threes. Around the least-squares fit, which
    is up to 17 nats from the optimum of the likelihood, they were 84 % of 280.
    """
    model, rng = Structure(('gain', 'delay', 'backlash')), np.random.default_rng(5)
    inside = []
    for _ in range(20):
        base = TABLE_2 * np.exp(0.2 * rng.standard_normal(4))
        sizes = [1.0 + 0.02 * rng.standard_normal(), rng.uniform(1e-3, 6e-3)]
        theta = np.concatenate([base, sizes, [rng.uniform(1e-5, 4e-5)]])
        records = []
        for k in (0.0, 250e3):
            u = commands.sweep(RATE, 30.0, 0.1, 8.0, 2e-3)
            slow = signal.lfilter([1.0], [1.0, -0.97], rng.standard_normal(len(u) + 500))[500:]
            noise = rng.standard_normal(len(u)) + slow / slow.std()
            y = model.simulate(theta, Record(u, 0.0 * u, 1.0 / RATE, k))
            records.append(Record(u, y + 7.1e-6 * noise, 1.0 / RATE, k))
        data = Data.whole(records)
        found = fit(data, model, theta)
        scorer = Scorer.of(data, splits_of(data, found.error))
        draws = posterior.sample(
            model,
            found,
            scorer,
            beside=discrepancy.beside({}, (), scorer),
            rng=rng,
            evaluations=0,
            progress=lambda share: None,
        )
        low, high = np.quantile(draws.points, [0.025, 0.975], axis=0)
        inside.append((low <= theta) & (theta <= high))
    assert np.mean(inside) >= 124 / 140
