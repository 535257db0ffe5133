"""Coordinates, bands, noise, alarm, collector: the parts of the estimator one by one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from online_streams import RATE, THETA, block, record, setup
from scipy.special import ndtri
from scipy.stats import norm

from actuator_glue.inference.predictive import ResidualModel, total_band
from actuator_glue.model import identifiable, linear
from actuator_glue.normal import below
from actuator_glue.online.collect import PIECE, Collector
from actuator_glue.online.mixture import mixture_band
from actuator_glue.online.playback import stream
from actuator_glue.online.response import response_band
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.setups import StreamSetup


@pytest.mark.parametrize('stiffness', [0.0, 250e3])
def test_bounds_beyond_all_reason_leave_the_density_a_number(stiffness):
    low, high = np.zeros(4), np.array([400.0, 1e125, 1e120, 100.0])
    theta = np.array([[134.0, 1e120, 1e118, 0.5]])
    phi, back, log_jacobian = np.empty((1, 4)), np.empty((1, 4)), np.empty(1)
    identifiable.coordinates_all(theta, stiffness, low, high, phi)
    identifiable.physical_all(phi, stiffness, low, high, back, log_jacobian)
    assert np.isfinite(log_jacobian).all()
    assert np.allclose(back, theta, rtol=1e-9)


def test_what_is_uniform_between_bounds_is_a_normal_score():
    share = np.concatenate([np.logspace(-6.9, -0.4, 500), 1.0 - np.logspace(-6.9, -0.4, 500)])
    scores = np.array([identifiable.score(s) for s in share])
    assert np.allclose(scores, ndtri(share), rtol=0.0, atol=1e-12)
    assert np.allclose([below(z) for z in scores], share, rtol=1e-12)
    assert (
        identifiable.score(0.0) == -identifiable.EDGE
        and identifiable.score(1.0) == identifiable.EDGE
    )
    assert identifiable.score(np.nan) == -identifiable.EDGE


def test_a_mixture_of_one_is_a_normal():
    levels = (0.5, 0.95)
    draws = np.tile(np.linspace(-1e-3, 1e-3, 7), (20, 1))
    band = mixture_band(draws, np.full(20, 2e-6), np.full(20, 1e-5), levels)
    for i, level in enumerate(levels):
        half = norm.ppf((1 + level) / 2) * 1e-5
        assert np.allclose(band.upper[i], draws[0] + 2e-6 + half, atol=1e-10)
        assert np.allclose(band.lower[i], draws[0] + 2e-6 - half, atol=1e-10)
    assert np.allclose(band.median, draws[0] + 2e-6, atol=1e-10)


@pytest.mark.parametrize('share', [1e-3, 0.3, 1.0, 5.0])
def test_the_mixture_is_what_total_band_samples_from(share):
    """Skewed draws from far narrower to far wider than the residual."""
    rng = np.random.default_rng(1)
    sd = 1e-5
    draws = share * sd * rng.exponential(size=(400, 5))
    residual = ResidualModel(mean=1e-6, sd=sd, phi=0.0, samples=10**6)
    ours = mixture_band(draws, np.full(400, 1e-6), np.full(400, sd), (0.5, 0.95))
    parts = [total_band(rng, draws, residual, (0.5, 0.95)) for _ in range(60)]
    for name in ('lower', 'median', 'upper'):
        theirs = np.array([getattr(p, name) for p in parts])
        # 60 bands of 1000 rows; the mean's standard error is 0.4 % of the spread.
        error = np.abs(getattr(ours, name) - theirs.mean(axis=0)) / theirs.std(axis=0)
        assert error.max() < 1.0


def test_the_frequency_response_band_holds_the_truth():
    draws = THETA * (1 + 0.02 * np.random.default_rng(0).standard_normal((300, 4)))
    settings = EstimatorSettings(headline_frequency=5.0)
    found = response_band(draws, 250e3, settings)
    assert len(found.frequency) == settings.frequencies
    truth = linear.frequency_response(THETA, 250e3, found.frequency)
    inside = (found.amplitude.lower[-1] <= abs(truth)) & (abs(truth) <= found.amplitude.upper[-1])
    assert inside.all()
    at = int(np.abs(found.frequency - 5.0).argmin())
    assert found.headline[1] == pytest.approx(found.amplitude.median[at], rel=1e-9)
    assert found.headline[3] == pytest.approx(-np.angle(truth[at]) / (10 * np.pi), rel=0.02)


@given(st.lists(st.tuples(st.integers(1, 120), st.booleans()), min_size=1, max_size=80))
def test_the_collector_is_bounded_and_joins_only_what_is_contiguous(pieces):
    collector = Collector(4.0)
    collector.setup(setup())
    index = 0
    for size, gap in pieces:
        index += 13 * gap
        collector.push(block(index, size))
        index += size
    found = collector.records(shortest=PIECE)
    assert sum(r.duration for r in found) <= 4.0 + 1e-9
    for part in found:
        first = part.first_index
        assert np.array_equal(part.command, 1e-6 * np.arange(first, first + len(part)))


def test_the_collector_gives_back_the_record():
    collector = Collector(60.0)
    whole = record(10.0)
    for item in stream(whole):
        (collector.setup if isinstance(item, StreamSetup) else collector.push)(item)
    (found,) = collector.records()
    assert len(found) > len(whole) - PIECE * RATE
    assert np.array_equal(found.measured, whole.measured[: len(found)])
    assert found.stiffness == whole.stiffness and found.start_ns == whole.start_ns
    collector.forget()
    assert collector.records() == []
