"""Native code of expressions: what every operation computes, and what it costs."""

from __future__ import annotations

import pickle
from collections.abc import Callable

import numpy as np
import pytest

from actuator_glue.model.commands import sweep
from actuator_glue.model.effects.terms import machine as m
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.effects.terms.expression import KNOWN, SIGNAL
from actuator_glue.model.effects.terms.native import InstructionGroup, Native
from actuator_glue.model.effects.terms.operations import PURE, REMEMBERING
from actuator_glue.model.parameters import TABLE_2, Parameter
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record
from benchmarks.effects import written

A, B, C, KEPT, RESULT = range(m.FIXED, m.FIXED + 5)
# One operation of the processor each, or a choice: to the last bit.
EXACT: dict[int, Callable[[Array, Array, Array], Array]] = {
    m.COPY: lambda a, b, c: a,
    m.ADD: lambda a, b, c: a + b,
    m.SUB: lambda a, b, c: a - b,
    m.MUL: lambda a, b, c: a * b,
    m.DIV: lambda a, b, c: a / b,
    m.NEG: lambda a, b, c: -a,
    m.ABS: lambda a, b, c: np.abs(a),
    m.SIGN: lambda a, b, c: np.where(np.isnan(a), 0.0, np.sign(a)),
    m.SQRT: lambda a, b, c: np.sqrt(a),
    m.MIN: lambda a, b, c: np.where((a < b) | np.isnan(a), a, b),
    m.MAX: lambda a, b, c: np.where((a > b) | np.isnan(a), a, b),
    m.LESS: lambda a, b, c: 1.0 * (a < b),
    m.SELECT: lambda a, b, c: np.where(c != 0.0, a, b),
    m.RECALL: lambda a, b, c: np.where(np.isnan(a), b, a),
}
CLOSE: dict[int, Callable[[Array, Array, Array], Array]] = {
    m.EXP: lambda a, b, c: np.exp(a),
    m.LOG: lambda a, b, c: np.log(a),
    m.SIN: lambda a, b, c: np.sin(a),
    m.COS: lambda a, b, c: np.cos(a),
    m.TANH: lambda a, b, c: np.tanh(a),
    m.ATAN: lambda a, b, c: np.arctan(a),
    m.POW: lambda a, b, c: a**b,
}


def executed(op: int, values: Array) -> Array:
    """Return registers after an operation on a, b, c and what is remembered, values (4, 32)."""
    g = np.zeros((RESULT + 1, 32))
    g[A : KEPT + 1] = values
    part = InstructionGroup((m.Instruction(op, RESULT, A, B, C, KEPT),), ((RESULT, RESULT),))
    native = Native((part,), {})
    m.once(native.addresses[0], g)
    return g


def drawn(scale: float, seed: int) -> Array:
    """Return operands (4, 32) with some that are special."""
    values = np.random.default_rng(seed).standard_normal((4, 32)) * scale
    values[0, :8] = np.nan, np.inf, -np.inf, 0.0, -0.0, 1.0, values[1, 6], 5e-324
    values[1, :3] = 0.0, np.inf, np.nan
    values[2, ::5] = 0.0
    return values


@pytest.mark.parametrize('op', EXACT)
def test_operations_are_those_of_the_processor(op: int, rng_seed: int) -> None:
    """Bit for bit numpy's."""
    values = drawn(1.0, rng_seed)
    with np.errstate(all='ignore'):
        expected = EXACT[op](*values[:3])
    assert np.array_equal(executed(op, values)[RESULT], expected, equal_nan=True)


@pytest.mark.parametrize('scale', [1e-9, 1e-2, 1.0, 30.0, 300.0])
@pytest.mark.parametrize('op', CLOSE)
def test_functions_are_those_of_the_library(op: int, scale: float, rng_seed: int) -> None:
    """Some roundings apart, a sine those of its argument's turns; no number stays none."""
    values = drawn(scale, rng_seed)
    values[:2] = np.clip(values[:2], -700.0, 700.0)
    with np.errstate(all='ignore'):
        expected = CLOSE[op](*values[:3])
    turns = 4e-16 * np.abs(values[0]) if op in (m.SIN, m.COS) else 0.0
    found = executed(op, values)[RESULT]
    assert np.array_equal(np.isnan(found), np.isnan(expected))
    far = np.isfinite(expected)
    with np.errstate(all='ignore'):
        far &= np.abs(found - expected) > 1e-15 * np.abs(expected) + turns + 5e-16
    assert not far.any()


def test_what_remembers(rng_seed: int) -> None:
    """At first 0 for an integral, else the signal itself; then what the last step has left."""
    assert set(REMEMBERING) | set(PURE) == set(range(25)) == {*REMEMBERING, *EXACT, *CLOSE}
    values = np.random.default_rng(rng_seed).standard_normal((4, 32))
    a, b, c = values[:3] = values[0], np.abs(values[1]), values[2]
    values[3, :5] = np.nan
    kept = np.where(np.isnan(values[3]), a, values[3])
    total = np.where(np.isnan(values[3]), 0.0, values[3])
    for op, result, after in (
        (m.LAG, a + (kept - a) * c, a + (kept - a) * b),
        (m.INTEGRAL, total + 0.5 * b * a, total + b * a),
    ):
        g = executed(op, values)
        assert np.array_equal(g[RESULT], result) and np.array_equal(g[KEPT], after), op


@pytest.mark.parametrize('op', [m.PLAY, m.LIMIT])
def test_what_turns_over_within_a_step(op: int, rng_seed: int) -> None:
    """Mean and end of a line's, walked in 20000 pieces; also of a held one, and without room."""
    steps = 20000
    values = np.random.default_rng(rng_seed).standard_normal((4, 32))
    values[1] = np.abs(values[1])
    values[2, :4] = values[1, 4:8] = 0.0
    a, b, c, kept = values
    walked = np.zeros(32)
    for at in np.arange(steps) / steps - 0.5:
        before = kept
        if op == m.PLAY:
            if at == -0.5:
                before = np.clip(kept, a - 0.5 * c - b, a - 0.5 * c + b)
            line = a + (at + 1.0 / steps) * c
            kept = np.clip(before, line - b, line + b)
        else:
            line = a + (at + 1.0 / steps) * c
            kept = before + np.clip(line - before, -b / steps, b / steps)
        walked += 0.5 * (before + kept) / steps
    g = executed(op, values)
    assert np.abs(g[RESULT] - walked).max() < 5.0 / steps
    assert np.abs(g[KEPT] - kept).max() < 5.0 / steps


@pytest.mark.parametrize('place', SIGNAL)
def test_every_signal_known_at_a_place_acts_there(place: str) -> None:
    """An expression that names it is not the same as without, in this process and another."""
    u = sweep(256.0, duration=1.0, f0=1.0, f1=10.0, amplitude=2e-3)
    record, own = Record(u, u, 1 / 256.0, 250e3), (Parameter('own', '1', 0.0, 1.0, '', 0.0),)
    size = {'u': 1e-4, 'e': 1e-4, 'y': 1e-4, 'q': 1e4, 'f': 50.0}[SIGNAL[place]]
    usual = {'u': 1e-3, 'e': 1e-4, 'x': 1e-3, 'y': 1e-3, 'v': 0.03, 'q': 1e4, 'f': 300.0, 't': 1.0}
    plain = Structure().simulate(TABLE_2, record)
    for symbol in KNOWN[place]:
        change = f'{size}*own*tanh({symbol}/{usual[symbol]})'
        effect = term('own-effect', f'{place}: {SIGNAL[place]} = {SIGNAL[place]} + {change}', own)
        structure = Structure((effect,))
        y = structure.simulate([*TABLE_2, 1.0], record)
        assert 1e-7 < np.abs(y - plain).max() < 2e-3, symbol
        sent = pickle.loads(pickle.dumps(structure))
        assert np.array_equal(sent.simulate([*TABLE_2, 1.0], record), y)


@pytest.mark.parametrize(
    'name',
    [
        'valve: e = tanh(own*e)/own',
        'flow: q = q*(1 + own*sign(q))',
        'specimen: f = f + k*own*x**3',
        'force: f = f + own*tanh(v/1e-2)',
    ],
)
def test_an_expression_costs_at_most_twice_a_compiled_effect(name: str) -> None:
    """Of its kind, in turns, so that a machine which slows down slows both; the best of six."""
    assert any(written([name], 5)[name]['ratio'] < 2.0 for _ in range(6))


@pytest.mark.parametrize(
    'beside', [(), ('specimen-gap',), ('specimen-hardening',), ('specimen-yield',)]
)
@pytest.mark.parametrize('stiffness', [0.0, 250e3])
def test_a_force_however_steep_is_found(
    beside: tuple[str, ...], stiffness: float, rng_seed: int
) -> None:
    """As its turn gets steeper it becomes Coulomb friction, of which the step knows the solution.

    As close as some percent more friction, which tells how much depends on when the piston
    sticks. Newton's steps alone leap to and fro there and end a millimetre beside it.
    """
    rng = np.random.default_rng(rng_seed)
    u = rng.uniform(1e-3, 4e-3) * np.sin(
        2.0 * np.pi * rng.uniform(2.0, 6.0) * np.arange(2000) / 1e3
    )
    record = Record(u, u, 1e-3, stiffness)
    dry = Structure((*beside, 'coulomb-friction'))
    theta = dry.neutral(np.array(TABLE_2))
    for j, parameter in enumerate(dry.parameters[4:-1], start=4):
        theta[j] = parameter.lower + 0.1 * (parameter.upper - parameter.lower)
    theta[-1] = rng.uniform(100.0, 400.0)
    expected = dry.simulate(theta, record)
    more = [
        float(np.abs(dry.simulate([*theta[:-1], times * theta[-1]], record) - expected).max())
        for times in (0.97, 1.03)
    ]
    own = Parameter('own', 'N', 0.0, 2e4, '', 0.0), Parameter('turn', 'm/s', 1e-6, 1.0, '', 1.0)
    steep = Structure((*beside, term('own', 'force: f = f + own*tanh(v/turn)', own)))
    for turn in (1e-4, 1e-5):
        found = steep.simulate([*theta, turn], record)
        assert np.abs(found - expected).max() < 2.0 * max(more) + 2e-6
