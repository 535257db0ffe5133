"""The stability of the hybrid test, watched by a node."""

import numpy as np
import pytest
from actuator_glue_msgs.msg import PosteriorDraws, PosteriorMoments, StabilityMargin
from ros_nodes import QUICK
from windows import windows_of_a_test

from actuator_glue.nodes import topics

NAMES = ['beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3']
THETA = np.array([133.65, 1.1005e9, 2.4927e5, 0.006])
PARTITION = """
numerical: {mass: 1000.0, damping: %g, stiffness: 0.0}
experimental: {mass: 0.0, damping: 0.0, stiffness: 39478.4}
rate: 1024.0
"""


def draws(window, spread=0.01, names=NAMES):
    """A message of 200 draws."""
    rng = np.random.default_rng(window)
    values = THETA * (1.0 + spread * rng.standard_normal((200, 4)))
    return PosteriorDraws(
        window=window, parameter_names=names, values=values.ravel(), ess_min=150.0, converged=True
    )


@pytest.mark.parametrize(('damping', 'unstable'), [(4000.0, False), (400.0, True)])
def test_margins_follow_posteriors(start, probe, tmp_path, damping, unstable):
    """One message per posterior; a warning where P(unstable) is above its level."""
    path = tmp_path / 'hybrid.yaml'
    path.write_text(PARTITION % damping)
    node = start('margin', partition=str(path))
    found = []
    probe.create_subscription(StabilityMargin, 'stability_margin', found.append, 10)
    out = probe.create_publisher(PosteriorDraws, 'posterior_draws', topics.DRAWS.qos)
    probe.until(lambda: out.get_subscription_count() == 1 and node.alive)
    # That the probe knows of the node says nothing of the other way round, and what is published
    # to who is not known yet is lost.
    sent = 100

    def met():
        nonlocal sent
        if not found:
            sent += 1
            out.publish(draws(sent))
            probe.for_a_while(0.2)
        return found and found[-1].window == sent

    probe.until(met, what='a margin')
    probe.for_reports('margin', 2)
    before = float(probe.value('margin', 'windows'))
    found.clear()
    out.publish(draws(1))
    broken = draws(2)
    broken.values = broken.values[:-1]
    out.publish(broken)
    nobody_knows = draws(2)
    nobody_knows.ess_min = float('nan')
    out.publish(nobody_knows)
    empty = draws(2)
    empty.values[5] = float('nan')
    out.publish(empty)
    out.publish(draws(3))
    probe.until(lambda: len(found) == 2)
    assert [m.window for m in found] == [1, 3]
    for message in found:
        assert message.partition == 'hybrid'
        assert message.p_unstable == float(unstable) and message.warning == unstable
        assert message.p_unstable_lower <= message.p_unstable <= message.p_unstable_upper
        assert (message.margin_upper < 0.0) == unstable
        assert message.delay_lower[1] < message.delay_median[1] < message.delay_upper[1]
        assert 0.01 < message.delay_median[1] < 0.05
    probe.until(lambda: float(probe.value('margin', 'windows')) == before + 2)
    for told in 'are no draws of 4 parameters', 'ess_min of 200 draws is NaN', 'NaN or infinite':
        assert told in node.text
    assert 'LinAlgError' not in node.text and 'internal error' not in node.text
    assert ('P(unstable)' in str(probe.value('margin', 'stability (last)', ''))) == unstable
    assert 'doubted' not in node.text
    posterior = probe.create_publisher(PosteriorMoments, 'posterior', topics.POSTERIOR.qos)
    probe.until(lambda: posterior.get_subscription_count() == 1)

    def told():
        posterior.publish(PosteriorMoments(window=4, doubts=['channels-wrong']))
        probe.for_a_while(0.2)
        return 'a posterior that is doubted: channels-wrong' in node.text

    probe.until(told, what='a doubt')
    assert node.end() == 0


@pytest.mark.slow
def test_the_estimator_feeds_it(start, probe):
    """From samples to StabilityMargin: one for each window, of the same number."""
    estimator = start('estimator', **QUICK)
    margin = start('margin', partition='sdof')
    found = []
    probe.create_subscription(StabilityMargin, 'stability_margin', found.append, 10)
    pairs = windows_of_a_test(start, probe, found)
    assert all(m.header.stamp == p.header.stamp for p, m in pairs)
    assert all(m.draws == 400 and m.frequency[1] == 5.0 for m in found)
    assert estimator.end() == 0 and margin.end() == 0
