"""What a worker learns while it warms up."""

import pytest

from actuator_glue.nodes import estimating
from actuator_glue.nodes.estimating import Computed
from actuator_glue.online.sampling import Job
from actuator_glue.workers.warm import warm_windows
from actuator_glue.workers.worker import Tell


def test_compiling_does_not_count_as_what_a_window_takes() -> None:
    """The first run after installing left the first eleven windows no time to sample."""
    estimating._Reserve.seconds = 30.0
    estimating.warm_up()
    assert estimating._Reserve.seconds < 0.4


def test_tracking_numbers_take_no_time_from_a_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without time left for them there are none; a slow moment is forgotten after some windows."""
    computed: list[estimating.Computed] = []
    asked = estimating.compute

    def note(job: Job, deadline: float, frequencies: tuple[float, ...], tell: Tell) -> Computed:
        computed.append(asked(job, deadline, frequencies, tell))
        return computed[-1]

    monkeypatch.setattr(estimating, 'compute', note)
    estimating.warm_up()
    assert all(c.tracking is not None and 'J2' in c.tracking.predicted for c in computed)
    monkeypatch.setattr(estimating._Reserve, 'tracking', 100.0)
    done = len(computed)
    late = (estimating.time.monotonic() + 60.0, estimating.FREQUENCIES, lambda _: None)
    warm_windows(lambda job: note(job, *late).result, swap=False)
    assert all(c.tracking is None for c in computed[done:])
    for _ in range(10):
        warm_windows(lambda job: note(job, *late).result, swap=False)
    assert computed[-1].tracking is not None
