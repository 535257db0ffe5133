"""Structure that looks as stationary as noise, detected by forecasts of left-out stretches.

Under a random command the residual of a wrong model has the same spectrum at all times, but it
follows from the motion, which the model knows. A ridge regression on generic features of the
motion and on the motion's past (a finite impulse response for each stiffness, as long as a lightly
damped mode rings) forecasts it, but no noise: no measurement is among the features. The prior
variances of the weights maximise the marginal likelihood of other stretches, too (MacKay 1992;
decaying impulse responses: Chen, Ohlsson & Ljung 2012).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, product
from typing import Any

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from actuator_glue.diagnosis.score.motion_features import library
from actuator_glue.diagnosis.score.scorer import Scorer, evidence, splits_of
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.decimate import motion_bandwidth
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.inference.noise import whiten
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

_FOLDS = 6  # each is forecast by the others; their blocks lie spread over all records
# Lags of the motion's past: for one stiffness, for all together, and per period of the fastest
# motion. 128 at 10 Hz reach back by 3 s.
_LAGS, _ALL_LAGS, _PER_PERIOD = 128, 384, 4.0
_FADING = (0.1, 0.5, 2.0)  # s: time constants of the decay of an impulse response's variance
_KEPT = 8_000_000  # feature values kept at most: 64 MB with the whitened ones
# Prior variances of weights, for features of unit power, in units of the noise.
_SIZES = (0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0)
_NONE = 1e-4  # weights expected to be this much smaller than the largest are left out
# Share of a motion's power that passes for noise, above which a residual's may, too: 0.93 to 1 for
# random commands, 0.22 to 0.47 for shaking that swells and fades, below 0.12 for sines, and for
# sweeps nearly always below this limit (100 of each).
_STATIONARY = 0.2


def stationary(data: Data) -> list[bool]:
    """Whether structure may look like noise, per record: its motion does."""
    motions = splits_of(data, data.target)
    return [m.noise**2 > _STATIONARY * m.mean_square for m in motions]


def noise(features: Features, scorer: Scorer, fit: Fit, nats: float) -> Array:
    """Return an upper bound of the noise in each record, (R,) [m].

    That is the error of its forecasts; infinite where they are no better than chance.

    Args:
        features: of the motion.
        scorer: noise and blocks.
        fit: the structure whose residual is forecast.
        nats: evidence of any addition.
    """
    data = features.data
    error, alone, forecast = fit.error, *left_out(features, scorer, fit)
    white, gains = [scorer.whiten(e) for e in (alone, forecast)], []
    squares = error**2
    for block in scorer.blocks:
        # A block unlike all that was fitted, at the start, say, must not dominate.
        before, after = (float(e[block] @ e[block]) for e in white)
        gains.append(0.5 * (before - min(after, 4.0 * before + 8.0)))
        left, whole = (float(e[block] @ e[block]) for e in (forecast, error))
        squares[block] = min(left, 4.0 * whole) / (block.stop - block.start)
    if evidence(np.array(gains), np.zeros(len(gains))) < nats:
        return np.full(len(data.records), np.inf)
    return np.array([np.sqrt(np.mean(s)) for s in data.split(squares)])


def left_out(features: Features, scorer: Scorer, fit: Fit) -> tuple[Array, Array]:
    """Return a structure's residual less two forecasts of left-out stretches, (N,) [m] each.

    The first forecast is of the structure refitted alone, the second of the features, too.

    Args:
        features: of the motion.
        scorer: noise and blocks.
        fit: the structure.
    """
    data, past = features.data, features.past
    products = features.products(scorer, fit)
    own, names = len(fit.slopes), features.names
    counts = np.zeros(_FOLDS)
    for fold, block, _, _ in _blocks(data, scorer):
        counts[fold] += block.stop - block.start
    scale = np.sqrt(np.einsum('frr->r', products) / fit.error.size)
    scale[-1] = 1.0
    scale[scale < 1e-12 * scale.max()] = 1.0
    products /= np.outer(scale, scale)
    lags, alone = np.tile(past.lags, past.count), np.append(np.arange(own), -1)
    whole = products.sum(axis=0)
    # A block must not influence its forecast: half of the folds take the other half's variances.
    sizes = [
        _sizes(products[other::2].sum(axis=0), float(counts[other::2].sum()), own, lags)
        for other in (1, 0)
    ]
    before, after = fit.error.copy(), fit.error.copy()
    weights = np.empty((_FOLDS, len(scale) - 1))
    for fold, count in enumerate(counts.sum() - counts):
        rest = whole - products[fold]
        weights[fold] = _weights(rest, float(count), own, sizes[fold % 2]) / scale[:-1]
    few = [_alone((whole - one)[np.ix_(alone, alone)]) / scale[:own] for one in products]
    fold_of = np.empty(fit.error.size, dtype=np.intp)
    for fold, block, record, at in _blocks(data, scorer):
        fold_of[block] = fold
        slopes = fit.jacobian_of(block)
        before[block] -= few[fold] @ slopes
        after[block] -= weights[fold, :own] @ slopes
        columns = past.columns(record, own + len(names))
        after[block] -= weights[fold, columns] @ past.rows(record, past.motions[record], at)
    for i, name, feature in features.library():
        part = data.parts[i]
        after[part] -= weights[fold_of[part], own + names.index(name)] * feature
    return before, after


@dataclass
class Features:
    """Predictors of residuals: features of the motion that Eq. (2) simulates, and its past.

    They are the same for every structure, so they are computed once where memory allows.

    Attributes:
        data: the counted samples.
        theta: Eq. (2) (4,).
    """

    data: Data
    theta: Array
    _kept: list[tuple[int, str, NDArray[np.float32]]] | None = None
    _white: tuple[tuple[Array, ...], list[NDArray[np.float32]], Array] | None = None

    @cached_property
    def past(self) -> _Past:
        """The motion's past."""
        return _Past(self.data, self.theta)

    @cached_property
    def names(self) -> list[str]:
        """Names of the features, in their order."""
        return list(dict.fromkeys(name for _, name, _ in self.library()))

    def library(self) -> Iterator[tuple[int, str, NDArray[np.floating[Any]]]]:
        """Yield record, name and values (n,) of every feature."""
        if self._kept is not None:
            yield from self._kept
            return
        kept, room = list[tuple[int, str, NDArray[np.float32]]](), _KEPT
        common = library(self.data, self.theta, plays=True)
        for i, name, feature in chain(common, self._settings()):
            room -= feature.size
            if room >= 0:
                kept.append((i, name, feature.astype(np.float32)))
            yield i, name, feature
        if room >= 0:
            self._kept = kept

    def _settings(self) -> Iterator[tuple[int, str, Array]]:
        """Yield motion and velocity of each of several records under one stiffness.

        They stand for a gain or a delay of one record alone, which no common response contains.
        """
        kinds, data = self.past.kinds, self.data
        for i, (motion, mask) in enumerate(zip(self.past.motions, data.masks, strict=True)):
            if kinds.count(kinds[i]) > 1:
                yield i, f'gain of record {i + 1}', motion[mask]
                velocity = np.gradient(motion, data.periods[i])
                yield i, f'delay of record {i + 1}', velocity[mask]

    def products(self, scorer: Scorer, fit: Fit) -> Array:
        """Products of all rows with each other in each fold, whitened, (_FOLDS, r, r).

        Rows are the structure's Jacobian, features, the motion's past under each stiffness, and
        the residual.

        Args:
            scorer: noise and blocks.
            fit: the structure.
        """
        table, known = self._whitened(scorer)
        error, jacobian = scorer.whiten(fit.error), scorer.whiten(fit.jacobian)
        own, past = len(jacobian), self.past
        size = own + len(known[0]) + 1
        out = np.zeros((_FOLDS, size, size))
        out[:, own:-1, own:-1] = known
        ends = np.append(np.arange(own), size - 1)
        moved = [whiten(x, taps) for x, taps in zip(past.motions, scorer.taps, strict=True)]
        for fold, block, record, at in _blocks(self.data, scorer):
            rows = np.concatenate([jacobian[:, block], error[None, block]])
            columns = past.columns(record, own + len(table))
            out[fold][np.ix_(ends, ends)] += rows @ rows.T
            out[fold][ends, own : own + len(table)] += rows @ _block(table, block).T
            out[fold][ends, columns] += rows @ past.rows(record, moved[record], at).T
        out[:, own:-1, ends] = out[:, ends, own:-1].swapaxes(1, 2)
        return out

    def _whitened(self, scorer: Scorer) -> tuple[list[NDArray[np.float32]], Array]:
        """Whitened features (N,) in single precision; products of features and the past."""
        if self._white is not None and self._white[0] is scorer.taps:
            return self._white[1:]
        self._white, data, past = None, self.data, self.past
        table: dict[str, NDArray[np.float32]] = {}
        for i, name, feature in self.library():
            row = table.setdefault(name, np.zeros(data.target.size, dtype=np.float32))
            row[data.parts[i]] = scorer.whiten(feature.astype(np.float64), i)
        rows, first = list(table.values()), len(table)
        size = first + past.count * len(past.lags)
        products = np.zeros((_FOLDS, size, size))
        moved = [whiten(x, taps) for x, taps in zip(past.motions, scorer.taps, strict=True)]
        for fold, block, record, at in _blocks(data, scorer):
            both = np.concatenate([_block(rows, block), past.rows(record, moved[record], at)])
            columns = past.columns(record, first)
            index = np.concatenate([np.arange(first), np.r_[columns]])
            products[fold][np.ix_(index, index)] += both @ both.T
        if self._kept is not None:
            self._white = scorer.taps, rows, products
        return rows, products


def _block(rows: list[NDArray[np.float32]], block: slice) -> Array:
    return np.array([row[block] for row in rows], dtype=np.float64)


@dataclass(frozen=True)
class _Past:
    """The motion's past, as far back as it may still matter.

    Attributes:
        data: the counted samples.
        theta: Eq. (2) (4,).
    """

    data: Data
    theta: Array

    @cached_property
    def motions(self) -> list[Array]:
        """Motion that Eq. (2) simulates for each whole record, (n,) [m]."""
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
        """A record's motion (n,) at each lag before some samples, (L, len(at)); 0 before it."""
        steps = np.rint(self.lags / self.data.periods[record]).astype(np.intp)
        reach, first, length = int(steps[-1]), int(at[0]), int(at[-1] - at[0]) + 1
        known = motion[max(0, first - reach) : first + length]
        longer = np.concatenate([np.zeros(reach + length - len(known)), known])
        found = sliding_window_view(longer, length)[reach - steps]
        return found if len(at) == length else found[:, at - first]


def _blocks(data: Data, scorer: Scorer) -> Iterator[tuple[int, slice, int, NDArray[np.intp]]]:
    """Yield fold, place in the joined vectors, record, and samples in it, of every block."""
    ends = [part.stop for part in data.parts]
    counted = [np.flatnonzero(mask) for mask in data.masks]
    for i, block in enumerate(scorer.blocks):
        record = int(np.searchsorted(ends, block.start, side='right'))
        begin = data.parts[record].start
        yield i % _FOLDS, block, record, counted[record][block.start - begin : block.stop - begin]


def _alone(products: Array) -> Array:
    """Return the least-squares weights of a structure's own rows alone, (own,)."""
    return np.asarray(scipy.linalg.cho_solve(_firm(products[:-1, :-1]), products[:-1, -1]))


def _firm(own: Array) -> tuple[Array, bool]:
    """Factor the products of free rows.

    If a structure does not move at all, its parameters explain nothing.
    """
    least = 1e-9 * np.trace(own) / len(own) or 1.0
    return scipy.linalg.cho_factor(own + least * np.eye(len(own)))


def _beside(products: Array, own: int) -> Array:
    """Products of all other rows, with the first (free) ones projected out."""
    taken = scipy.linalg.cho_solve(_firm(products[:own, :own]), products[:own, own:])
    return np.asarray(products[own:, own:] - products[own:, :own] @ taken)


def _sizes(products: Array, count: float, own: int, lags: Array) -> Array:
    """Return the prior variances of weights, (r - 1 - own,), of largest marginal likelihood.

    Args:
        products: of rows and, last, the residual with each other, (r, r).
        count: number of samples that they sum over.
        own: how many of the rows are free: the structure's own.
        lags: of the last rows; those between are features of the present motion, (l,) [s].
    """
    free = _beside(products, own)
    features = len(free) - 1 - len(lags)

    def sized(present: float, past: float, fading: float) -> Array:
        return np.append(np.full(features, present), past * np.exp(-lags / fading))

    def likelihood(way: tuple[float, float, float]) -> float:
        return _ridge(free, count, np.sqrt(sized(*way)))[0]

    # For features, for lags, then for features given the lags.
    best = max(((s, 0.0, 1.0) for s in _SIZES), key=likelihood)
    fading = ((best[0], s, fading) for s, fading in product(_SIZES[1:], _FADING))
    best = max(chain([best], fading), key=likelihood)
    return sized(*max(((s, *best[1:]) for s in _SIZES), key=likelihood))


def _weights(products: Array, count: float, own: int, sizes: Array) -> Array:
    """Return weights of rows, (r - 1,); those after the `own` free ones have prior variances."""
    others = _ridge(_beside(products, own), count, np.sqrt(sizes))[1]
    pull = products[:own, -1] - products[:own, own:-1] @ others
    return np.append(scipy.linalg.cho_solve(_firm(products[:own, :own]), pull), others)


def _ridge(products: Array, count: float, sizes: Array) -> tuple[float, Array]:
    """Log marginal likelihood of the weights' prior deviations (w,), and their means (w,).

    The noise variance is the one that maximises it.
    """
    use, out = sizes > _NONE * sizes.max(initial=0.0), np.zeros(len(sizes))
    size = sizes[use]
    firm = products[:-1, :-1][np.ix_(use, use)] * np.outer(size, size)
    firm[np.diag_indices(len(size))] += 1.0
    factor = scipy.linalg.cho_factor(firm, lower=True, overwrite_a=True, check_finite=False)
    pull = size * products[:-1, -1][use]
    means = scipy.linalg.cho_solve(factor, pull, check_finite=False)
    out[use] = size * means
    spread = np.log(np.diag(factor[0])).sum()
    return float(-0.5 * count * np.log(products[-1, -1] - pull @ means) - spread), out
