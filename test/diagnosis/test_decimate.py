"""Records sampled far too fast: what relates their channels stays, single samples count."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.verdict.alarm import ljung_box
from actuator_glue.inference.least_squares import decimate
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.structure import Structure
from actuator_glue.records import Hold, Record

THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])


def fast(
    rate: float,
    duration: float = 20.0,
    *,
    top: float = 10.0,
    hold: Hold = 'zoh',
    effects: Sequence[str] = (),
    sizes: Sequence[float] = (),
) -> Record:
    """A sweep without noise."""
    t = np.arange(int(duration * rate)) / rate
    u = 2e-3 * np.sin(np.pi * (top / duration) * t**2)
    silent = Record(u, u, 1 / rate, stiffness=0.0, hold=hold, source='fast')
    y = Structure(effects).simulate(np.append(THETA, sizes), silent)
    return replace(silent, measured=y)


@pytest.mark.parametrize('hold', ['zoh', 'linear'])
@pytest.mark.parametrize('count', [2, 3, 10, 33])
def test_a_linear_actuator_stays_what_it_was(hold: Hold, count: int) -> None:
    """Half a sample of lag would leave 4 um at 10 kHz; 0.02 um are left."""
    record = decimate.decimated(fast(10_000.0, hold=hold), count)
    assert record.period == pytest.approx(count * 1e-4)
    error = record.measured - Structure(()).simulate(THETA, record)
    inner = error[len(error) // 100 : -len(error) // 100]
    assert np.abs(inner).max() < 2e-8


def test_the_rate_follows_command_and_actuator() -> None:
    """A faster sweep keeps more samples; what is slow anyway keeps those that hum needs."""
    slow, middle, quick = (
        decimate.needed_rate(fast(10_000.0, top=top)) for top in (1.0, 30.0, 90.0)
    )
    assert slow == 300.0
    assert 12 * 27.0 < middle < 0.7 * quick
    assert quick > 12 * 75.0
    assert decimate.factor(fast(256.0)) == 1


def test_steps_of_a_slow_controller_ask_for_no_rate() -> None:
    """A command of 410 Hz in a record of 1 kHz: 4 % of it are steps, which the piston smooths."""
    rng, t = np.random.default_rng(5), np.arange(20_000) * 1e-3
    held = np.floor(410.0 * t) / 410.0
    record = fast(1000.0, top=15.0)
    u = 2e-3 * np.sin(np.pi * (15.0 / 20.0) * held**2)
    y = Structure(()).simulate(THETA, replace(record, command=u))
    y += 3e-6 * rng.standard_normal(len(y))
    record = replace(record, command=u, measured=y)
    assert decimate.factor(record) == 3
    slow = decimate.decimated(record, 3)
    error = slow.measured - Structure(()).simulate(THETA, slow)
    assert np.std(error[100:-100]) < 3e-6


def test_noise_goes_with_the_means() -> None:
    """White noise of 33 samples and their neighbours: a seventh is left, and nothing folds."""
    rng = np.random.default_rng(4)
    record = fast(10_000.0)
    silent = decimate.decimated(record, 33).measured
    noisy = replace(record, measured=record.measured + 1e-5 * rng.standard_normal(len(record)))
    left = decimate.decimated(noisy, 33).measured - silent
    assert np.std(left) == pytest.approx(1e-5 * np.sqrt(2 / 3 / 33), rel=0.05)
    line = 1e-5 * np.sin(2 * np.pi * 1830.0 * record.time)  # 12 Hz if it were folded
    folded = decimate.means(line, 33)
    assert np.std(folded) < 1e-2 * np.std(line)


def test_prepared_records_say_what_was_done() -> None:
    """The note names both rates; the recorded samples stay at hand for what lives in them."""
    prepared = prepare([fast(3000.0)], [])
    (count,) = prepared.fit.factors
    assert count == 8
    assert any('3000 Hz' in note and 'at 375 Hz' in note for note in prepared.notes)
    whole = prepared.fit.as_recorded
    assert len(whole.masks[0]) == len(whole.records[0]) == 60_000
    assert abs(whole.masks[0].mean() - prepared.fit.masks[0].mean()) < 1e-3


@pytest.mark.usefixtures('few_forms', 'few_names')
@pytest.mark.parametrize(('effect', 'size'), [('quantisation', 4e-5), ('timing-jitter', 4e-4)])
def test_what_lives_in_single_samples_is_found(effect: str, size: float) -> None:
    """A converter's step and a jittering clock at 2 kHz, with the size they have there.

    The edge of the filter that isolates jitter takes 7 % of it, at any rate.
    """
    rng = np.random.default_rng(7)
    record = fast(2000.0, 24.0)
    y = np.array(record.measured)
    if effect == 'timing-jitter':
        y += np.gradient(y, record.period) * size * rng.standard_normal(len(y))
    y += 3e-6 * rng.standard_normal(len(y))
    if effect == 'quantisation':
        y = size * np.round(y / size)
    found = diagnose([replace(record, measured=y)], settings=Thresholds(evaluations=0))
    (seen,) = [e for e in found.effects if e.name == effect]
    assert next(iter(seen.parameters.values())).mean == pytest.approx(size, rel=0.1)
    assert found.to_json()['sampling'] == [
        {
            'source': 'fast',
            'rate_hz': 2000.0,
            'fitted_rate_hz': pytest.approx(2000.0 / 6),
            'impulse_samples': 0,
            'noise_at_rest_m': None,
        }
    ]


def test_whiteness_takes_no_square_of_a_long_record() -> None:
    """Ten minutes at 300 Hz; the same value as a library's that correlates over all lags."""
    from statsmodels.stats.diagnostic import acorr_ljungbox

    rng = np.random.default_rng(8)
    short = rng.standard_normal(3000)
    expected = float(acorr_ljungbox(short, lags=[20])['lb_pvalue'].iloc[0])
    assert ljung_box(short) == pytest.approx(expected, rel=1e-9)


def test_a_simulation_in_parts_is_the_simulation() -> None:
    """Parameter sets are simulated a few at a time."""
    record = fast(300.0, 600.0)
    thetas = THETA * np.linspace(0.9, 1.1, 21)[:, None]
    data = Data.whole([record])
    assert np.array_equal(
        data.simulate(Structure(()), thetas), Structure(()).simulate(thetas, record)
    )
