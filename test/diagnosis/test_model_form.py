"""Where structure remains, intervals hold what the choice of the equations leaves open."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from actuator_glue.diagnosis.posterior import model_form
from actuator_glue.inference.least_squares.space import Space
from actuator_glue.model.structure import Structure

THETA = np.array([230.0, 1.7e10, 5.3e6, 26.0])


def trial(effects: tuple[str, ...], *sizes: float, factor: float = 1.0) -> Any:
    """A refitted structure: Eq. (2)'s parameters times a factor, and sizes in its order."""
    structure = Structure(effects)
    theta = np.concatenate([factor * THETA, sizes])
    return SimpleNamespace(
        structure=structure,
        effects=structure.effects,
        fit=SimpleNamespace(theta=theta),
        mean_square=1e-10,
    )


def test_a_size_is_as_open_as_its_companions_leave_it() -> None:
    """The median of how far it moved; one companion that takes it anywhere is one of many."""
    final = trial(('backlash',), 30e-6)
    others = [
        trial(('backlash', 'gain'), 1.0, 32e-6, factor=1.02),
        trial(('backlash', 'delay'), 1e-3, 27e-6, factor=1.04),
        trial(('backlash', 'drift'), 1e-6, 34e-6, factor=0.97),
        trial(('backlash', 'sensor-lag'), 900e-6, 2e-3, factor=9.0),
        trial(('delay',), 4e-3, factor=1.03),  # has Eq. (2)'s parameters only
        final,
    ]
    for other in others[:4]:  # the catalogue's order, not ours
        names = [p.name for p in other.structure.parameters]
        own = other.fit.theta[4:].copy()
        other.fit.theta[names.index('backlash')] = min(own, key=lambda s: abs(s - 30e-6))
        rest = next(i for i in (4, 5) if names[i] != 'backlash')
        other.fit.theta[rest] = max(own, key=lambda s: abs(s - 30e-6))
    asked: list[float] = []

    def left_at_most(mean_square: float) -> list[Any]:
        asked.append(mean_square)
        return [(other.structure, other.fit) for other in others]

    refits: Any = SimpleNamespace(left_at_most=left_at_most)
    space = Space(final.structure, 60.0)
    size = model_form.spread(refits, final, 2e-6, space)
    assert asked == [pytest.approx(1e-10 + 4e-12)]
    assert size[4] == pytest.approx(1.4826 * 3.5e-6)
    assert size[0] == pytest.approx(1.4826 * abs(np.log(0.97)))
    assert not model_form.spread(refits, trial(('valve-null',), 0.0), 0.0, space)[4]


def test_intervals_are_widened_one_by_one(rng_seed: int) -> None:
    """By the square root of the sum of squares, Eq. (2)'s as logarithms, within the bounds.

    Standard deviations of 20 000 draws scatter by 0.5 %.
    """
    rng = np.random.default_rng(rng_seed)
    space = Space(Structure(('backlash',)), 60.0)
    z = space.z(np.concatenate([THETA, [30e-6]])[None])
    draws = space.theta(z + rng.standard_normal((20_000, 5)) * [0.01, 0.01, 0.01, 0.01, 3e-6])
    wider = model_form.widened(draws, np.array([0.02, 0.0, 0.0, 0.0, 4e-6]), space, rng)
    assert np.std(np.log(wider[:, 0])) == pytest.approx(np.hypot(0.01, 0.02), rel=0.04)
    assert np.std(wider[:, 4]) == pytest.approx(5e-6, rel=0.04)
    assert wider[:, 1] == pytest.approx(draws[:, 1])
    wide = model_form.widened(draws, np.array([0.0, 0.0, 0.0, 0.0, 1.0]), space, rng)
    assert wide[:, 4].min() == 0.0 and wide[:, 4].max() == pytest.approx(1e-3)
