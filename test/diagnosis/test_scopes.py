"""Structures of every scope are rows of one table."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from actuator_glue.diagnosis.learned.forms import forms
from actuator_glue.diagnosis.search.conclusion import Conclusion
from actuator_glue.diagnosis.search.table import (
    LINEAR,
    Row,
    outweighs,
    scoped,
    since,
    weighed,
)
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.inference.transforms.inverse_response import Ridge
from actuator_glue.model.effects import Scale
from actuator_glue.model.structure import Structure

MATERIAL = 5e-6


def row(*effects: str, left: float, price: float = 5.0, scope: str = '') -> Row:
    """A row that leaves so much [um], without parameters."""
    return Row(effects, scope, {}, {}, 1e-6 * left, 1e-6 * left, price)


def test_a_scope_costs_its_choice() -> None:
    """What another scope leaves less must be worth more than that."""
    plain, other = row(left=10.0), row(left=10.0)
    table = weighed([plain, *scoped([other], 'linear', np.log(2.0))], MATERIAL, (), '')
    assert [r.scope for r in table] == ['', 'linear']
    assert table[0].chosen and not table[1].chosen
    assert table[1].log_weight == pytest.approx(-np.log(2.0))


def test_what_matters_less_has_less_weight_than_nothing() -> None:
    """Half of what matters is there beyond chance, but no addition; twice of it is."""
    for left, greatest in ((np.hypot(10.0, 2.5), ()), (np.hypot(10.0, 10.0), ('gain',))):
        rows = [row(left=left, price=4.0), row('gain', left=10.0, price=8.0)]
        assert weighed(rows, MATERIAL, (), '')[0].effects == greatest


def test_which_effect_it_is_is_told_more_sharply() -> None:
    """A fifth of what matters tells two names apart; both share the weight of their kind."""
    rows = [
        row(left=20.0, price=4.0),
        row('gain', left=10.0),
        row('delay', left=np.hypot(10.0, 1.0)),
    ]
    table = weighed(rows, MATERIAL, ('gain',), '')
    assert [r.effects for r in table] == [('gain',), ('delay',), ()]
    assert table[1].log_weight == pytest.approx(-((1.0 / 0.25) ** 2))
    alone = weighed(rows[:2], MATERIAL, ('gain',), '')
    shared = np.logaddexp(table[0].log_weight, table[1].log_weight) - table[2].log_weight
    assert shared == pytest.approx(alone[0].log_weight - alone[1].log_weight)


def test_where_material_error_remains_a_small_difference_tells_nothing() -> None:
    """The printed weights are those that decided: all are wrong, and 1 um more tells little."""
    rows = [row('gain', left=30.0, price=8.0), row('delay', left=31.0, price=8.0)]
    sharp = weighed(rows, MATERIAL, ('gain',), '')[1].log_weight
    blunt = weighed(rows, MATERIAL, ('gain',), '', complete=False)[1].log_weight
    assert sharp == pytest.approx(100.0 * blunt)


def test_another_hold_counts_as_an_addition() -> None:
    """It rivals an effect that imitates it, told by a fifth of what matters."""
    drift = row('gain-drift', left=np.hypot(10.0, 1.0), price=8.0)
    (linear,) = scoped([row(left=10.0, price=4.0)], LINEAR, np.log(2.0))
    assert outweighs(linear, drift, MATERIAL, True) and not outweighs(
        drift, linear, MATERIAL, True
    )
    (worse,) = scoped([row(left=np.hypot(10.0, 2.0), price=4.0)], LINEAR, np.log(2.0))
    assert not outweighs(worse, drift, MATERIAL, True)
    assert outweighs(worse, drift, MATERIAL, False)  # both are wrong: the plainer one
    (both,) = scoped([row('gain-drift', left=10.0, price=8.0)], LINEAR, np.log(2.0))
    assert not outweighs(both, drift, MATERIAL, True)


def test_an_onset_must_matter() -> None:
    """What it leaves less beside the same effect counts in units of what matters."""
    (since_then,) = scoped([row('delay', left=10.0)], 'since 3.0 s of a', 5.0)
    assert not outweighs(since_then, row('delay', left=np.hypot(10.0, 4.0)), MATERIAL, True)
    assert outweighs(since_then, row('delay', left=np.hypot(10.0, 8.0)), MATERIAL, True)


def answer(found: Row, left: float) -> Any:
    """An answer that leaves so much structure [um]."""
    out = SimpleNamespace(
        row=found,
        scope=found.scope,
        found=SimpleNamespace(material=MATERIAL),
        decision=SimpleNamespace(left=1e-6 * left),
    )
    for name in ('leaves_nothing', 'matters'):
        setattr(out, name, vars(Conclusion)[name].fget(out))
    return out


def test_what_remains_unexplained_is_no_other_scope() -> None:
    """Removing 5 of 25 um tells no hold or onset while 24 um remain; an effect it may tell.

    A scope under which an effect explains all is told.
    """

    def first(*beside: tuple[Row, float]) -> bool:
        other, told = (answer(*pair) for pair in beside)
        return bool(Conclusion.outweighs(other, told))

    plain = row(left=np.hypot(10.0, 25.0), price=4.0), 25.0
    less = row(left=np.hypot(10.0, 24.0), price=4.0), 24.0
    (linear,) = scoped([less[0]], LINEAR, np.log(28.0))
    (late,) = scoped([less[0]], 'since 9.5 s of a', 5.0)
    assert not first((linear, 24.0), plain) and not first((late, 24.0), plain)
    assert first((row('delay', left=np.hypot(10.0, 24.0), price=8.0), 24.0), plain)
    (whole,) = scoped([row('delay', left=10.0, price=8.0)], LINEAR, np.log(28.0))
    assert first((whole, 0.0), plain)


def test_scopes_of_scopes_are_told_together() -> None:
    inner = row('gain', left=1.0, scope='gain in b only')
    (told,) = scoped([inner], 'since 3.0 s of a', 5.0)
    assert told.scope == 'since 3.0 s of a, gain in b only' and told.price == 10.0


def test_what_holds_since_a_moment_counts_over_all_data() -> None:
    """A quarter of the samples leave 2 um before it, the others 4 um since then."""
    before = Fit(np.zeros(4), np.full(100, 2e-6), np.zeros((4, 100)), np.zeros(4))
    (told,) = since([row('backlash', left=4.0)], before, 300)
    assert told.left_out == pytest.approx(1e-6 * np.sqrt(0.25 * 4.0 + 0.75 * 16.0))


def test_of_one_structure_in_one_scope_the_nearest_fit_counts() -> None:
    """Two searches may have refitted the same; the told one is that of its own scope."""
    rows = [row('delay', left=9.0), row('delay', left=8.0), row('delay', left=7.0, scope='since')]
    table = weighed(rows, MATERIAL, ('delay',), '')
    assert [(r.scope, r.chosen) for r in table] == [('since', False), ('', True)]
    assert table[1].left_out == 8e-6


def test_a_learned_force_counts_beside_the_oil() -> None:
    """Along the ridge of one stiffness forces grow with the oil: its coordinate stays."""
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5])
    offered = forms(Scale(2e-3, 0.05, 30.0, 0.005, 0.0, theta))
    (friction,) = (e for e in offered if e.name == 'learned-force-friction')
    model = Structure([friction])
    low, high = (
        np.array([getattr(p, end) for p in model.parameters]) for end in ('lower', 'upper')
    )
    high[4] = 1e6
    ridge = Ridge([p.name for p in model.parameters], low, high, 0.0, 0.0, model.parameters)
    small = np.array([[*theta, 300.0, 1e-3]])
    large = small * np.array([1.0, 3.0, 3.0, 1.0, 3.0, 1.0])
    a, b = ridge.forward(small)[0], ridge.forward(large)[0]
    moved = np.abs(a - b) > 1e-9 * np.maximum(np.abs(a), 1e-12)
    assert moved.tolist() == [False, False, True, False, False, False]
    there, _ = ridge.inverse(b[None])
    np.testing.assert_allclose(there, large, rtol=1e-6)
