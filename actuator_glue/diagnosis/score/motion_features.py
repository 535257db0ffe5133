"""Generic features of a motion at places of the loop, for regressions of what a model leaves."""

from __future__ import annotations

from collections.abc import Container, Iterator
from dataclasses import replace

import numpy as np

from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.structure import Structure
from actuator_glue.play import play
from actuator_glue.records import Array, Record

_RADII = (0.005, 0.01, 0.02, 0.05, 0.1)  # of plays, in amplitudes


def _motions(x: Array, record: Record, plays: bool) -> dict[str, Array]:
    """Polynomials of displacement, velocity, servo error and time, of order one each.

    And displacement, command and servo error less their play of several widths
    (Prandtl-Ishlinskii), if `plays` are wanted.
    """
    t = np.linspace(-1.0, 1.0, len(x))
    v = np.gradient(x, record.period)
    x, v, e, u = (
        c / max(float(np.abs(c).max()), 1e-12) for c in (x, v, record.command - x, record.command)
    )
    out = {'1': np.ones_like(x), 't': t}
    for name, c in (('x', x), ('v', v), ('e', e)):
        out |= {
            name: c,
            f'|{name}|': np.abs(c),
            f'{name}^2': c**2,
            f'{name}|{name}|': c * np.abs(c),
            f'{name}^3': c**3,
            f'sign {name}': np.tanh(50.0 * c),
            f't {name}': t * c,
        }
    for name, c in (('x', x), ('u', u), ('e', e)) if plays else ():
        out |= {f'{name} - play {r} {name}': c - play(c, r, 0.0) for r in _RADII}
    out |= {'x v': x * v, 'x^2 v': x**2 * v, 'x v^2': x * v**2, 'x e': x * e}
    if record.known_stiffness() > 0.0:
        out |= {'k x': x, 'k x^2': x**2, 'k x^3': x**3, 'k sign v': np.tanh(50.0 * v)}
    else:
        out |= {name: np.zeros_like(x) for name in ('k x', 'k x^2', 'k x^3', 'k sign v')}
    return out


def library(
    data: Data, theta: Array, wanted: Container[str] | None = None, *, plays: bool = False
) -> Iterator[tuple[int, str, Array]]:
    """Yield features of the motion that Eq. (2) simulates, at the counted samples (n,).

    Each is taken as it is (a sensor's place), passed through the closed loop (a command's
    place) and as the derivative of that (a flow's or a force's place).

    Args:
        data: counted samples.
        theta: Eq. (2) (4,).
        wanted: names of the features; None for all.
        plays: whether plays are among them.

    Yields:
        Which record, name, and feature.
    """
    model = Structure(())
    for i, (record, mask) in enumerate(zip(data.records, data.masks, strict=True)):
        x = np.asarray(model.simulate(theta, record)).reshape(-1)
        stroke = float(np.abs(record.command).max()) or 1.0
        motions = _motions(x, record, plays)
        for name, raw in motions.items():
            texts = name, f'loop({name})', f'd/dt loop({name})'
            if wanted is not None and not any(text in wanted for text in texts):
                continue
            passed = _passed(model, theta, record, stroke * raw)
            rate = np.gradient(passed, record.period)
            for text, c in zip(texts, (stroke * raw, passed, rate), strict=True):
                if wanted is None or text in wanted:
                    yield i, text, c[mask]


def _passed(model: Structure, theta: Array, record: Record, command: Array) -> Array:
    if not command.any():
        return np.zeros_like(command)
    return np.asarray(model.simulate(theta, replace(record, command=command))).reshape(-1)
