"""A generic regression as flexible as a structure, whose effects must not do worse."""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis.score.scorer import Scorer, evidence
from actuator_glue.diagnosis.thresholds import POINTING
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.json_value import Json, json_value
from actuator_glue.model.structure import Structure
from actuator_glue.play import play
from actuator_glue.records import Array, Record

_RADII = (0.005, 0.01, 0.02, 0.05, 0.1)  # of plays, in amplitudes
_PIECE = 1 << 13  # samples whose products are taken at a time


@dataclass(frozen=True)
class Surrogate:
    """Regression of the residual of Eq. (2) on generic features of its own motion.

    Attributes:
        features: the features chosen, best first.
        structure: effects of the structure compared with.
        error: error left on blocks that were left out of the fit, rms [m].
        structure_error: the same for the structure [m].
        explained: share of the squared error of Eq. (2) that the surrogate removes.
        nats: evidence of the surrogate over the structure, out of sample.
        tried: how many features were there to choose from.
    """

    features: tuple[str, ...]
    structure: tuple[str, ...]
    error: float
    structure_error: float
    explained: float
    nats: float
    tried: int

    @property
    def place(self) -> str:
        """Where in the loop the strongest feature acts; empty where it explains little."""
        if not self.features or self.explained < POINTING:
            return ''
        if self.features[0].startswith('d/dt'):
            return 'flow or force'
        return 'command' if self.features[0].startswith('loop') else 'sensor'

    def beats(self, material: float, nats: float) -> bool:
        """Whether the surrogate explains more, beyond chance: each feature was the best of many.

        Nats weigh the whitened error; a surrogate of materially larger plain error is no rival.
        """
        worse = max(0.0, self.error**2 - self.structure_error**2) > material**2
        return not worse and self.nats > nats + len(self.features) * math.log(self.tried)

    def to_json(self) -> Json:
        """Return the JSON object of the surrogate."""
        return {
            'unit': 'm',
            'parameters': len(self.features),
            'features': list(self.features),
            'error': json_value(self.error),
            'structure': list(self.structure),
            'structure_error': json_value(self.structure_error),
            'nats': json_value(self.nats),
            'explained': self.explained,
            'place': self.place,
        }


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


def compare(data: Data, scorer: Scorer, base: Trial, structure: Trial) -> Surrogate:
    """Choose as many features as the structure has parameters beyond Eq. (2), and score both.

    Forward selection on the whitened residual with the base Jacobian projected out (orthogonal
    least squares, Chen, Billings and Luo 1989); base and weights are then refitted together
    and scored on the same left-out blocks as any structure. The choice itself sees all blocks,
    which favours the surrogate by little: tens of features against thousands of samples.
    """
    count = len(structure.fit.theta) - len(base.fit.theta)
    fit, chosen, tried = _regressed(data, base.fit.theta, scorer, base.fit, count)
    left, whole = scorer.left_out_error(fit), scorer.left_out_error(base.fit)
    return Surrogate(
        features=tuple(chosen),
        structure=structure.effects,
        error=left,
        structure_error=scorer.left_out_error(structure.fit),
        explained=max(0.0, 1.0 - (left / whole) ** 2) if whole > 0.0 else 0.0,
        nats=evidence(scorer.block_scores(fit), structure.scores),
        tried=tried,
    )


def _regressed(
    data: Data, theta: Array, scorer: Scorer, fit: Fit, count: int
) -> tuple[Fit, list[str], int]:
    """Regress a residual on the best of all features, parameters refitted with them.

    Features are chosen by their products with each other: the table of a long record's features
    is the largest that a diagnosis holds, so it is gone through once and kept in single precision,
    whose rounding is 1e-14 of a feature's power.

    Returns:
        The residual that is left, with the Jacobian of parameters and weights; which features
        were chosen, best first; how many there were.
    """
    error, own = scorer.whiten(fit.error), scorer.whiten(fit.jacobian)
    table: dict[str, NDArray[np.float32]] = {}
    for i, name, feature in library(data, theta):
        row = table.setdefault(name, np.empty(len(error), dtype=np.float32))
        row[data.parts[i]] = scorer.whiten(feature, i)
    known = np.vstack([np.linalg.qr(own.T)[0].T, error])
    gram, cross = _products(list(table.values()), known)
    names, start = list(table), np.diag(gram).copy()
    del table
    gram -= cross[:, :-1] @ cross[:, :-1].T  # the parameters projected out
    pull = cross[:, -1] - cross[:, :-1] @ (known[:-1] @ error)
    chosen: list[str] = []
    for _ in range(count):
        power = np.diag(gram)
        usable = power > 1e-6 * np.maximum(start, 1e-300)
        merit = np.where(usable, pull**2 / np.maximum(power, 1e-300), -1.0)
        best = int(np.argmax(merit))
        if merit[best] <= 0.0:
            break
        chosen.append(names[best])
        along = gram[best] / np.sqrt(power[best])
        pull = pull - along * (pull[best] / np.sqrt(power[best]))
        gram = gram - np.outer(along, along)
    rows = np.empty((len(chosen), len(error)))
    for i, name, feature in library(data, theta, chosen):
        rows[chosen.index(name), data.parts[i]] = feature
    raw = np.concatenate([fit.jacobian, rows])
    white = np.concatenate([own, scorer.whiten(rows)])
    scale = np.sqrt(np.einsum('pn,pn->p', white, white))
    scale = np.where(scale > 0.0, scale, 1.0)
    weights, *_ = np.linalg.lstsq((white / scale[:, None]).T, error, rcond=1e-10)
    left = Fit(fit.theta, fit.error - (weights / scale) @ raw, raw, fit.z, fit.room)
    return left, chosen, len(names)


def _products(rows: Sequence[NDArray[np.float32]], known: Array) -> tuple[Array, Array]:
    """Products of rows (f, N) with each other (f, f) and with known ones (p, N), (f, p)."""
    gram, cross = np.zeros((len(rows), len(rows))), np.zeros((len(rows), len(known)))
    for begin in range(0, known.shape[1], _PIECE):
        piece = slice(begin, begin + _PIECE)
        some = np.array([row[piece] for row in rows], dtype=np.float64)
        gram += some @ some.T
        cross += some @ known[:, piece].T
    return gram, cross
