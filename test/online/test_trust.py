"""What speaks against a posterior: a rate too low for the loop, a contradicted prior."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from online_streams import RATE, SETTINGS, THETA, record, stream

from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import choose_model
from actuator_glue.model import linear
from actuator_glue.model.commands import noise
from actuator_glue.model.parameters import NAMES
from actuator_glue.online.channels import ChannelFault
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.job import WindowResult, run
from actuator_glue.online.playback import give, replay
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Contradicted
from actuator_glue.online.trust import Contradiction, natural_frequency, trust
from actuator_glue.records import Record


def sampled(rate, stiffness, seed=3):
    """Results of windows of the same loop, sampled at a rate."""
    command = noise(rate, 9.0, 0.2, min(0.2 * rate, 8.0), seed=seed)
    clean = linear.simulate(THETA, command, stiffness=stiffness, period=1.0 / rate)
    measured = clean + 1e-5 * np.random.default_rng(seed).standard_normal(len(clean))
    found = replay(stream(Record(command, measured, 1.0 / rate, stiffness)), EstimatorSettings())
    return [r for r in found if isinstance(r, WindowResult)]


@pytest.mark.parametrize('stiffness', [0.0, 250e3])
@pytest.mark.parametrize(('rate', 'too_low'), [(10.0, True), (30.0, False), (200.0, False)])
def test_a_rate_far_too_low_for_the_loop_is_said(rate, too_low, stiffness):
    """At 10 Hz beta_1 was 32 +- 2 of 134, some windows converged, and nothing was said."""
    results = sampled(rate, stiffness)
    assert len(results) >= 3
    for result in results:
        doubts = trust(result, Contradiction(), ChannelFault())['doubts']
        assert doubts == (['rate-too-low'] if too_low else [])
        wrong = ChannelFault()
        for _ in range(2):
            wrong.take('the channels are swapped')
        assert trust(result, Contradiction(), wrong)['doubts'] == [*doubts, 'channels-wrong']
    if not too_low:
        k, (_, ab, a2, a3) = stiffness, THETA
        true = math.sqrt((THETA[0] * a3 * k + ab) / (k + a2)) / (2.0 * math.pi)
        assert natural_frequency(results[-1]) == pytest.approx(true, rel=0.1)


def test_an_alarm_stands_until_later_samples_agree():
    """It reached nobody, and nobody knew since when or for how long."""
    draws = 1.4 * THETA * np.exp(0.02 * np.random.default_rng(0).standard_normal((600, 4)))
    settings = replace(SETTINGS, prior='calibration', drift=0.0, contradiction='widen')
    estimator = Estimator(settings, choose_model(), carried=Carried(NAMES, draws))
    contradiction, shown = Contradiction(), []
    whole = record(14.0)
    for item in stream(whole, 50):
        give(estimator, item)
        while (job := estimator.next_job()) is not None:
            result = run(job)
            events = [e for e in estimator.finish(result) if isinstance(e, Contradicted)]
            contradiction.take(result, events)
            shown.append((result, events, trust(result, contradiction, ChannelFault())))
    first = next(n for n, (_, events, _) in enumerate(shown) if events)
    assert not any(told['prior_contradicted'] for _, _, told in shown[:first])
    result, (event,), told = shown[first]
    assert told['doubts'] == ['prior-contradicted'] and told['prior_p_value'] < 1e-3
    end = result.window.record.stamp_ns(len(result.window.record) - 1)
    since = (end - whole.stamp_ns(event.since)) * 1e-9
    assert told['contradicted_for'] == pytest.approx(since, abs=1.0 / RATE)
    assert contradiction.since_ns is None and not shown[-1][2]['prior_contradicted']
    assert math.isnan(shown[-1][2]['contradicted_for'])


def test_an_alarm_of_a_prior_that_is_used_all_the_same_lasts():
    class Samples:
        """Two seconds at 1 kHz."""

        def __init__(self, start):
            self.first_index, self.start_ns = start, start * 10**6

        def __len__(self):
            return 2000

        def stamp_ns(self, sample):
            return self.start_ns + sample * 10**6

    def result(start, p_value):
        conflict = None if p_value is None else SimpleNamespace(p_value=p_value)
        return SimpleNamespace(window=SimpleNamespace(record=Samples(start)), conflict=conflict)

    alarm = Contradicted(3, 1500, 1e-9, '')
    contradiction = Contradiction()
    contradiction.take(result(0, 1e-9), [])
    assert contradiction.since_ns is None
    contradiction.take(result(2000, 1e-9), [alarm])
    assert contradiction.since_ns == 1500 * 10**6
    contradiction.take(result(3000, 0.9), [])  # shares samples with the one that raised it
    contradiction.take(result(5000, 0.01), [])
    assert contradiction.lasted(result(5000, 0.01).window) == pytest.approx(5.499)
    contradiction.take(result(7000, 0.4), [])
    assert contradiction.since_ns is None
    contradiction.take(result(9000, 1e-9), [alarm])
    contradiction.take(result(12_000, None), [])  # nothing is known any more
    assert contradiction.since_ns is None
