"""A short simulated test before an estimator, and what follows each of its windows."""

from actuator_glue_msgs.msg import PosteriorMoments
from ros_nodes import RATE


def windows_of_a_test(start, probe, found):
    """Stream six simulated seconds to an estimator that has started.

    Returns pairs of a posterior and what followed it, window by window. These topics keep nothing
    for who is not known yet, and a machine that is busy may take seconds to make a subscription
    known: pairs are from the first window that both have shown to the last, gaps not allowed.
    """
    posteriors = []
    probe.create_subscription(PosteriorMoments, 'posterior', posteriors.append, 10)
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 120, 'estimator compiled')
    simulator = start(
        'actuator_sim',
        duration=6.0,
        rate=RATE,
        specimen_stiffness=250e3,
        wait_for=1,
        exit_at_end=True,
    )
    assert simulator.wait(60) == 0, simulator.text

    def common():
        both = [[m.window for m in messages] or [0] for messages in (posteriors, found)]
        return range(max(w[0] for w in both), min(w[-1] for w in both) + 1)

    probe.until(lambda: len(common()) > 2, 30, 'three windows that both show')
    both = [[m for m in messages if m.window in common()] for messages in (posteriors, found)]
    assert all([m.window for m in messages] == list(common()) for messages in both)
    return list(zip(*both, strict=True))
