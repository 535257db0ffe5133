"""How well time left was told is measured as a reader of the bar would."""

from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest


@pytest.fixture
def time_left(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return the module, which stands beside scripts."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / 'benchmarks' / 'blind'))
    return import_module('time_left')


def test_a_bar_that_grows_evenly_is_always_right(time_left: ModuleType) -> None:
    """One that has done half in a sixth of the time is not."""
    times = np.arange(0.0, 60.0, 0.1)
    even = list(zip(times, times / 60.0, strict=True))
    assert time_left.told_in_time(even, 60.0) == 1.0
    hasty = list(zip(times, np.minimum(times / 20.0, 0.5 + times / 120.0), strict=True))
    assert time_left.told_in_time(hasty, 60.0) < 0.9


def test_a_bar_that_stands_is_right_in_its_third(time_left: ModuleType) -> None:
    """At a half: as much is left as has passed, which is within a factor of two in the middle."""
    assert time_left.told_in_time([(0.0, 0.5)], 90.0) == pytest.approx(1.0 / 3.0, abs=0.03)


def test_nothing_that_was_told_is_never_right(time_left: ModuleType) -> None:
    """A bar that stays at nothing says that it never ends."""
    assert time_left.told_in_time([(0.0, 0.0)], 30.0) == 0.0
