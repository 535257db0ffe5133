"""Structure that looks as stationary as noise, told by forecasts of stretches that were left out.

Under a random command what a wrong model leaves has the same spectrum at all times, but it follows
from the motion, which the model knows. A ridge regression on generic features of the motion and
on the motion's past (a finite impulse response for each stiffness, as long as a lightly damped
mode rings) forecasts it, and no noise: nothing that was measured is among the features. The sizes
that weights are expected to have are those of the largest marginal likelihood (MacKay 1992;
impulse responses that fade: Chen, Ohlsson & Ljung 2012), of the other stretches alone, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import scipy
from numpy.typing import NDArray

from actuator_glue.diagnosis.regression import library
from actuator_glue.diagnosis.score import Scorer, evidence, splits_of
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.decimate import motion_bandwidth
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.inference.noise import whiten
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

_FOLDS = 6  # each is forecast by the others; their blocks lie spread over all records
# Of the motion's past: lags of one stiffness, and of all, and how many to a period of the fastest
# motion. 128 at 10 Hz reach back by 3 s.
_LAGS, _ALL_LAGS, _PER_PERIOD = 128, 384, 4.0
_FADING = (0.1, 0.5, 2.0)  # s in which the expected square of an impulse response fades
# Expected squares of weights, of features of unit power and in units of the noise.
_SIZES = (0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0)
_NONE = 1e-4  # weights that are expected this much smaller than the largest are not asked for
# Share of a motion's power that passes for noise, above which a residual's may, too: 0.93 to 1 of
# random commands, 0.22 to 0.47 of shaking that swells and fades, below 0.12 of sines, and of
# sweeps nearly always below this (100 of each).
_STATIONARY = 0.2


def stationary(data: Data) -> list[bool]:
    """Whether what follows the command may look like noise: the motion of a record does."""
    motions = splits_of(data, data.target)
    return [m.noise**2 > _STATIONARY * m.mean_square for m in motions]


def noise(data: Data, scorer: Scorer, theta: Array, fit: Fit, nats: float) -> Array:
    """Return how much noise there is at most in each record, (records,) [m].

    That is the error of its forecasts; infinite where they are no better than chance.

    Args:
        data: the counted samples.
        scorer: noise and blocks.
        theta: Eq. (2), whose motion gives the features (4,).
        fit: the structure whose residual is forecast.
        nats: evidence of any addition.
    """
    error, alone, forecast = fit.error, *left_out(data, scorer, theta, fit)
    white, gains = [scorer.whiten(e) for e in (alone, forecast)], []
    squares = error**2
    for block in scorer.blocks:
        # What is unlike all that was fitted, at the start, say, must not explode.
        before, after = (float(e[block] @ e[block]) for e in white)
        gains.append(0.5 * (before - min(after, 4.0 * before + 8.0)))
        left, whole = (float(e[block] @ e[block]) for e in (forecast, error))
        squares[block] = min(left, 4.0 * whole) / (block.stop - block.start)
    if evidence(np.array(gains), np.zeros(len(gains))) < nats:
        return np.full(len(data.records), np.inf)
    return np.array([np.sqrt(np.mean(s)) for s in data.split(squares)])


def left_out(data: Data, scorer: Scorer, theta: Array, fit: Fit) -> tuple[Array, Array]:
    """Return what forecasts of left-out stretches leave of a structure's residual, (N,) [m].

    Without features, of the structure refitted alone, and with them.

    Args:
        data: the counted samples.
        scorer: noise and blocks.
        theta: Eq. (2), whose motion gives the features (4,).
        fit: the structure.
    """
    past = _Past(data, theta)
    names, products = _products(past, scorer, fit)
    own, fold_of = len(fit.jacobian), np.empty(fit.error.size, dtype=np.intp)
    for fold, block, _, _ in _blocks(data, scorer):
        fold_of[block] = fold
    scale = np.sqrt(np.einsum('frr->r', products) / fit.error.size)
    scale[-1] = 1.0
    scale[scale < 1e-12 * scale.max()] = 1.0
    products /= np.outer(scale, scale)
    lags, alone = np.tile(past.lags, past.count), np.append(np.arange(own), -1)
    weights, few = np.empty((_FOLDS, len(scale) - 1)), np.empty((_FOLDS, own))
    for fold, rest in enumerate(products.sum(axis=0) - products):
        count = float(np.sum(fold_of != fold))
        weights[fold] = _weights(rest, count, own, lags) / scale[:-1]
        few[fold] = _weights(rest[np.ix_(alone, alone)], count, own, lags[:0]) / scale[:own]
    before, after = fit.error.copy(), fit.error.copy()
    for i, name, feature in library(data, theta, plays=True):
        part = data.parts[i]
        after[part] -= weights[fold_of[part], own + names.index(name)] * feature
    for fold, block, record, at in _blocks(data, scorer):
        before[block] -= few[fold] @ fit.jacobian[:, block]
        after[block] -= weights[fold, :own] @ fit.jacobian[:, block]
        columns = past.columns(record, own + len(names))
        after[block] -= weights[fold, columns] @ past.rows(record, past.motions[record], at)
    return before, after


@dataclass(frozen=True)
class _Past:
    """The motion's past, as far as it may show now.

    Attributes:
        data: the counted samples.
        theta: Eq. (2) (4,).
    """

    data: Data
    theta: Array

    @cached_property
    def motions(self) -> list[Array]:
        """What Eq. (2) simulates of each record, whole, (n,) [m]."""
        model = Structure(())
        return [np.asarray(model.simulate(self.theta, r)).reshape(-1) for r in self.data.records]

    @cached_property
    def kinds(self) -> list[int]:
        """Which of the stiffnesses each record has."""
        known = [r.known_stiffness() for r in self.data.records]
        return [sorted(set(known)).index(k) for k in known]

    @property
    def count(self) -> int:
        """How many stiffnesses there are."""
        return max(self.kinds) + 1

    @cached_property
    def lags(self) -> Array:
        """Lags of each stiffness, (L,) [s]."""
        fastest = max(motion_bandwidth(record) for record in self.data.records)
        step = max(1.0 / (_PER_PERIOD * fastest), *self.data.periods)
        return np.asarray(step * np.arange(min(_LAGS, _ALL_LAGS // self.count)))

    def columns(self, record: int, first: int) -> slice:
        """Where the lags of a record's stiffness stand, behind `first` other columns."""
        begin = first + self.kinds[record] * len(self.lags)
        return slice(begin, begin + len(self.lags))

    def rows(self, record: int, motion: Array, at: NDArray[np.intp]) -> Array:
        """A motion (n,) of a record before some of its samples, (L, len(at)); rest before it."""
        steps = np.rint(self.lags / self.data.periods[record]).astype(np.intp)
        index = at - steps[:, None]
        return np.asarray(np.where(index >= 0, motion[np.maximum(index, 0)], 0.0))


def _blocks(data: Data, scorer: Scorer) -> Iterator[tuple[int, slice, int, NDArray[np.intp]]]:
    """Yield fold, place in the joined vectors, record, and samples in it, of every block."""
    ends = [part.stop for part in data.parts]
    counted = [np.flatnonzero(mask) for mask in data.masks]
    for i, block in enumerate(scorer.blocks):
        record = int(np.searchsorted(ends, block.start, side='right'))
        begin = data.parts[record].start
        yield i % _FOLDS, block, record, counted[record][block.start - begin : block.stop - begin]


def _products(past: _Past, scorer: Scorer, fit: Fit) -> tuple[list[str], Array]:
    """Products of all rows with each other in each fold, whitened, (_FOLDS, r, r).

    Rows are the structure's Jacobian, features, the motion's past under each stiffness, and the
    residual. Features are kept in short numbers.

    Returns:
        Names of the features, and the products.
    """
    data = past.data
    error, own = scorer.whiten(fit.error), scorer.whiten(fit.jacobian)
    table: dict[str, NDArray[np.float32]] = {}
    for i, name, feature in library(data, past.theta, plays=True):
        row = table.setdefault(name, np.empty(len(error), dtype=np.float32))
        row[data.parts[i]] = whiten(feature, scorer.taps[i])
    first = len(own) + len(table)
    size = first + past.count * len(past.lags) + 1
    out = np.zeros((_FOLDS, size, size))
    moved = [whiten(x, taps) for x, taps in zip(past.motions, scorer.taps, strict=True)]
    for fold, block, record, at in _blocks(data, scorer):
        features = np.array([row[block] for row in table.values()], dtype=np.float64)
        lagged = past.rows(record, moved[record], at)
        rows = np.concatenate([own[:, block], features, lagged, error[None, block]])
        columns = past.columns(record, first)
        index = np.concatenate([np.arange(first), np.r_[columns], [size - 1]])
        out[fold][np.ix_(index, index)] += rows @ rows.T
    return list(table), out


def _weights(products: Array, count: float, own: int, lags: Array) -> Array:
    """Return weights of rows, (r - 1,), under the prior of largest marginal likelihood.

    Args:
        products: of rows and, last, the residual with each other, (r, r).
        count: samples that they are sums of.
        own: how many of the rows are free: the structure's own.
        lags: of the last rows; those between are features of the present motion, (l,) [s].
    """
    # Where a structure does not move at all none of its parameters takes anything up.
    least = 1e-9 * np.trace(products[:own, :own]) / own or 1.0
    firm = products[:own, :own] + least * np.eye(own)
    given = scipy.linalg.cho_factor(firm)
    free = products[own:, own:] - products[own:, :own] @ scipy.linalg.cho_solve(
        given, products[:own, own:]
    )
    features = len(free) - 1 - len(lags)

    def tried(present: float, past: float, fading: float) -> tuple[float, Array]:
        sizes = np.append(np.full(features, present), past * np.exp(-lags / fading))
        return _ridge(free, count, np.sqrt(sizes))

    # Sizes of features, of lags, of features beside lags.
    best = max(((s, 0.0, 1.0) for s in _SIZES), key=lambda o: tried(*o)[0])
    ways = [(best[0], s, fading) for s, fading in product(_SIZES, _FADING)]
    best = max(ways, key=lambda o: tried(*o)[0])
    best = max(((s, *best[1:]) for s in _SIZES), key=lambda o: tried(*o)[0])
    others = tried(*best)[1]
    pull = products[:own, -1] - products[:own, own:-1] @ others
    return np.append(scipy.linalg.cho_solve(given, pull), others)


def _ridge(products: Array, count: float, sizes: Array) -> tuple[float, Array]:
    """Log marginal likelihood of the sizes of weights (w,), and their means (w,).

    The noise's variance is what makes it largest.
    """
    use, out = sizes > _NONE * sizes.max(initial=0.0), np.zeros(len(sizes))
    size = sizes[use]
    firm = products[:-1, :-1][np.ix_(use, use)] * np.outer(size, size)
    factor = scipy.linalg.cho_factor(firm + np.eye(len(size)), lower=True)
    pull = size * products[:-1, -1][use]
    means = scipy.linalg.cho_solve(factor, pull)
    out[use] = size * means
    spread = np.log(np.diag(factor[0])).sum()
    return float(-0.5 * count * np.log(products[-1, -1] - pull @ means) - spread), out
