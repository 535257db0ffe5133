"""What a worker learns while it warms up."""

from actuator_glue.nodes import estimating


def test_compiling_does_not_count_as_what_a_window_takes() -> None:
    """The first run after installing left the first eleven windows no time to sample."""
    estimating._Reserve.seconds = 30.0
    estimating.warm_up()
    assert estimating._Reserve.seconds < 0.4
