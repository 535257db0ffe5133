"""Frequency response of the model, and the test that would tell names apart."""

import numpy as np
import pytest
from scipy import signal

from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import Scorer, splits_of
from actuator_glue.diagnosis.telling import response
from actuator_glue.diagnosis.telling.next_experiment import ranked
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model import commands
from actuator_glue.model.effects import scale
from actuator_glue.model.linear import coefficients
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

K = 250e3


def test_gain_phase_delay_and_bandwidth_of_a_linear_model() -> None:
    """As Eq. (2a) with a delay says, and the intervals are those of the draws."""
    n0, d2, d1, d0 = (float(c) for c in coefficients(TABLE_2, K))
    record = Record(commands.sweep(256.0, 30.0), np.zeros(7681), 1 / 256.0, K)
    sizes = scale([record], TABLE_2)
    theta = np.append(TABLE_2, 4e-3)
    draws = np.repeat(theta[None], 50, axis=0)
    draws[:, 4] += np.linspace(-1e-4, 1e-4, 50)
    model = Structure(('delay',))
    found = response.of(model, theta, draws, sizes, K)
    for sine in found.sines:
        w = 2.0 * np.pi * sine.frequency
        expected = n0 / np.polyval([d2, d1, d0], 1j * w) * np.exp(-1j * w * 4e-3)
        # Samples of a linearly moving command: (w h)^2/12 of the amplitude, h the period.
        assert sine.gain == pytest.approx(abs(expected), rel=3e-3)
        assert sine.phase == pytest.approx(np.degrees(np.angle(expected)), abs=0.3)
        assert sine.delay == pytest.approx(-np.angle(expected) / w, abs=3e-5)
        assert sine.delay_ci[0] < sine.delay < sine.delay_ci[1]
        assert np.ptp(sine.delay_ci) == pytest.approx(1.9e-4, rel=0.1)
    f = np.geomspace(0.5, 60.0, 2000)
    gain = np.abs(signal.freqs([n0], [d2, d1, d0], 2.0 * np.pi * f)[1])
    width = f[np.flatnonzero(gain >= gain[200] / np.sqrt(2.0))[-1]]
    if width < 59.0:
        assert found.bandwidth == pytest.approx(width, rel=0.05)
    else:
        assert np.isnan(found.bandwidth)


def test_delay_and_lag_are_told_apart_by_fast_sweeps() -> None:
    """Expected nats grow with frequency, and are those that such a test then brings."""
    rng = np.random.default_rng(3)
    u = commands.sweep(128.0, 20.0, 0.1, 4.0)
    model = Structure(('delay',))
    theta = np.append(TABLE_2, 4e-3)
    record = Record(u, np.zeros(len(u)), 1 / 128.0, K)
    y = model.simulate(theta, record) + 1e-5 * rng.standard_normal(len(u))
    data = Data.whole([Record(u, y, 1 / 128.0, K)])
    refits = Refits(data, ('delay', 'sensor-lag'))
    refits.scorer = Scorer.of(data, splits_of(data, refits.base().error))
    delay, lag = (refits.polish(refits.add(refits.trial(()), n)) for n in refits.names)
    refits.scorer = Scorer.of(data, splits_of(data, delay.fit.error))
    tests = ranked(delay, [lag], refits.scorer, refits.scale(), 1e-5)
    assert max(e.amplitude for e in tests) == pytest.approx(2e-3, rel=0.1)
    nats = {(e.text.split()[1], e.amplitude, e.stiffness): e.nats for e in tests}
    assert 'sweep' in tests[0].text
    slow = max(v for (text, _, _), v in nats.items() if text == 'slow')
    assert tests[0].nats > 10.0 * slow + 1.0
