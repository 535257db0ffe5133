"""Curves of learned terms: what each adds over the range that was excited, with its band."""

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from actuator_glue.diagnosis.learned.forms import forms
from actuator_glue.diagnosis.learned.term import LearnedTerm
from actuator_glue.model.effects import Effect, Scale
from actuator_glue.model.effects.terms.definition import mapping
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.report.learned_figure import curve, learned_terms

SCALE = Scale(2e-3, 0.1, 60.0, 1 / 256, 250e3, TABLE_2)
T = np.arange(0.0, 10.0, 1 / 256)
# Term, its parameters, and what the records excited.
CASES: dict[str, tuple[tuple[float, ...], dict[str, tuple[float, float]]]] = {
    'learned-sensor-y3': ((2e4,), {'y': (-3e-3, 1e-3)}),
    'learned-valve-hysteresis': ((0.5, 1e-4), {'e': (-1e-3, 1e-3)}),
    'learned-flow-settling': ((0.2, 8.0), {'q': (-1e5, 2e5), 't': (0.0, 40.0)}),
    'learned-command-resonance': ((0.1, 0.02, 4.0, 0.05), {'u': (-2e-3, 2e-3)}),
    'learned-specimen-k-x2': ((5.0,), {'x': (-2e-3, 2e-3), 'f': (-500.0, 500.0)}),
}


@cache
def by_name() -> dict[str, Effect]:
    """All forms."""
    return {effect.name: effect for effect in forms(SCALE)}


def found(*names: str, spread: float = 0.1) -> Any:
    """A diagnosis with these terms, each parameter known to a share of itself."""
    rng = np.random.default_rng(1)
    terms, columns, draws = [], [], []
    for name in names:
        effect, (values, excited) = by_name()[name], CASES[name]
        columns += [p.name for p in effect.parameters]
        draws += [v * (1.0 + spread * rng.standard_normal(2000)) for v in values]
        definition = mapping([effect])[name]
        own: Any = dict.fromkeys(p.name for p in effect.parameters)
        terms.append(
            LearnedTerm(name, effect.place, effect.equation, '', {}, own, excited, definition)
        )
    return SimpleNamespace(
        learned=tuple(terms),
        names=('beta_1', *columns),
        joint=np.column_stack([np.ones(2000), *draws]),
        best=np.array([*TABLE_2, 0.0]),
        traces=tuple(
            SimpleNamespace(stiffness=k, time=T, command=2e-3 * np.sin(2.0 * np.pi * 4.0 * T))
            for k in (0.0, 250e3)
        ),
    )


def test_a_power_is_its_curve() -> None:
    """Over the range that was excited, which may lie to one side; ten per cent of it the band.

    Of 250 draws the median scatters by 0.8 %, the ends of the interval by some 8 % of its width.
    """
    answer = found('learned-sensor-y3')
    over, y, (middle, low, high) = curve(answer, answer.learned[0])
    assert over == 'y'
    assert (y.min(), y.max()) == (pytest.approx(-3e-3), pytest.approx(1e-3))
    assert middle == pytest.approx(2e4 * y**3, rel=0.05, abs=1e-9)
    width = 3.92 * 0.1 * 2e4 * np.abs(y) ** 3
    assert high - low == pytest.approx(width, rel=0.35, abs=1e-9)


def test_what_remembers_is_a_loop() -> None:
    """Half of the play is missing on the way up and too much on the way down."""
    answer = found('learned-valve-hysteresis', spread=1e-3)
    over, e, (middle, _, _) = curve(answer, answer.learned[0])
    assert over == 'e'
    up = np.gradient(e) > 0.0
    inner = np.abs(e) < 5e-4
    assert middle[up & inner] == pytest.approx(-5e-5, rel=0.01)
    assert middle[~up & inner] == pytest.approx(5e-5, rel=0.01)


def test_what_changes_is_drawn_over_time() -> None:
    """At the largest flow, from nothing to the share that it settles at."""
    answer = found('learned-flow-settling', spread=1e-3)
    over, t, (middle, _, _) = curve(answer, answer.learned[0])
    assert over == 't' and (t[0], t[-1]) == (0.0, 40.0)
    assert middle == pytest.approx(0.2 * 2e5 * (1.0 - np.exp(-t / 8.0)), rel=0.02, abs=10.0)


def test_what_resonates_is_drawn_at_the_usual_frequency() -> None:
    """There a resonance of 0.1 adds a tenth of the signal, its poles another way 0.02/0.1."""
    answer = found('learned-command-resonance', spread=1e-3)
    over, u, (middle, _, _) = curve(answer, answer.learned[0])
    assert over == 'u'
    expected = abs(0.1 + 0.02 * (1.0 - 1.0 / 0.1j))
    assert np.abs(middle).max() == pytest.approx(expected * np.abs(u).max(), rel=0.03)


def test_every_term_has_a_panel() -> None:
    """With its name, units that people read, and no line beyond the range excited."""
    figure = learned_terms(found(*CASES))
    assert [a.get_title(loc='left') for a in figure.axes if a.get_visible()] == list(CASES)
    labels = [(a.get_xlabel(), a.get_ylabel()) for a in figure.axes]
    assert labels[0] == ('y [mm]', 'added to y [um]')
    assert labels[2] == ('time [s]', 'added to q [N/s]')
    assert labels[3] == ('u [mm], at 4 Hz', 'added to u [um]')
    assert labels[4] == ('f [kN]', 'added to f [N]')
    assert figure.axes[0].lines[0].get_xdata().min() == pytest.approx(-3.0)
