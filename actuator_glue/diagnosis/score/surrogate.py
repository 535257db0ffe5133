"""A generic regression as flexible as a structure, whose effects must not do worse."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis.score.motion_features import library
from actuator_glue.diagnosis.score.scorer import Scorer, evidence
from actuator_glue.diagnosis.thresholds import POINTING
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.json_value import Json, json_value
from actuator_glue.records import Array

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
