"""Refit Eq. (2) with effects added: rough refits of all candidates, then those that matter."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.learned.forms import forms
from actuator_glue.diagnosis.learned.term import is_learned
from actuator_glue.diagnosis.refits import global_search, poles
from actuator_glue.diagnosis.refits.candidates import FEEDBACK, structure_of
from actuator_glue.diagnosis.refits.promises import Promises
from actuator_glue.diagnosis.score.scorer import Scorer, evidence, splits_of, structure_and_noise
from actuator_glue.diagnosis.score.weights import price
from actuator_glue.diagnosis.thresholds import FAR, UNDERSTATED
from actuator_glue.diagnosis.trial import Trial, removed
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import Fit, base_fit, fit, rms
from actuator_glue.inference.least_squares.scatter import scattered
from actuator_glue.inference.least_squares.space import Space, sum_of_squares
from actuator_glue.inference.least_squares.stretches import Part, stretches
from actuator_glue.model.effects import CATALOGUE, Effect, Scale, scale
from actuator_glue.model.parameters import BASE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

_COARSE = 8  # iterations of every refit; promising ones go on
_TOLERANCE = 1e-4
# Relative gain of a step below which a promising refit ends. A hundredth of a nat of a structure's
# weight is 1e-5 of the squared error where that is only noise (weights.py).
_DONE = 1e-5
_FINISHED = 2  # iterations on all samples after those on stretches of them
_PROMISING = 0.95  # of the error: friction that leaves less is searched for globally
_POLISHED = 4
_LAST, _LEAST_GAIN = 60, 1e-6  # iterations at most of a reported structure, and tolerance
_FINER = 0.1  # of a usual finite-difference step
_LONG = 5.0  # times their stretches: for longer data these tell which minimum is the lowest


def by_score(trial: Trial) -> float:
    """Sort the best out-of-sample score first."""
    return -float(trial.scores.sum())


@dataclass(frozen=True)
class Asked:
    """Refits of a structure that are asked for.

    Attributes:
        current: the structure.
        names: further effects, added one at a time.
        below: mean squared error below which a refit is of use [m^2].
        every: whether those that promise too little are listed all the same, after one step.
    """

    current: Trial
    names: tuple[str, ...]
    below: float = np.inf
    every: bool = False


def _worth_finishing(row: Sequence[Trial], below: float) -> list[Trial]:
    """Return the trials near the best, best first, and those of far smaller error.

    A fit short of its optimum has a bad score, but is not worth finishing where another is far
    better.
    """
    error = row[0].mean_square if row else 0.0
    tried = [t for i, t in enumerate(row[:_POLISHED]) if i < 2 or t.mean_square < FAR * error]
    least = sorted(row[_POLISHED:], key=lambda t: t.mean_square)[:2]
    tried += [t for t in least if FAR * t.mean_square < error]
    return [t for t in tried if t.mean_square < below]


@dataclass
class Refits:
    """All structures tried on one data set, each refitted once.

    Attributes:
        data: the counted samples.
        entries: all effects, in the order in which they stand in a structure: those of the
            catalogue, and learned terms for these data.
        names: effects that act on the mean response.
        each: refits candidates, several at a time if it can (the kernels release the
            interpreter lock).
        described: whether the entries hold the learned terms.
        effort: what all refits cost.
    """

    data: Data
    names: tuple[str, ...]
    each: Each = map
    entries: dict[str, Effect] = field(default_factory=lambda: dict(CATALOGUE))
    described: bool = False
    effort: Effort = field(default_factory=Effort)
    _scorer: Scorer | None = None
    _tried: dict[frozenset[str], Fit] = field(default_factory=dict)
    _misfit: WeakKeyDictionary[Fit, Scorer] = field(default_factory=WeakKeyDictionary)
    _promises: Promises | None = None
    _polished: dict[frozenset[str], int] = field(default_factory=dict)
    _descended: set[tuple[frozenset[str], tuple[str, ...]]] = field(default_factory=set)

    def base(self) -> Fit:
        """Fit Eq. (2)."""
        if frozenset() not in self._tried:
            self._tried[frozenset()] = self.effort.spent_on(base_fit(self.data))
        return self._tried[frozenset()]

    @property
    def scorer(self) -> Scorer:
        """Noise and blocks, once they were taken from a structure's residual."""
        assert self._scorer is not None
        return self._scorer

    @scorer.setter
    def scorer(self, scorer: Scorer) -> None:
        """Take another noise."""
        self._scorer = scorer

    @property
    def promises(self) -> Promises:
        """What effects promise, once the base is fitted."""
        if self._promises is None:
            base = self._tried[frozenset()]
            self._promises = Promises(self.data, base, self.entries, self.each)
        return self._promises

    def scale(self) -> Scale:
        """Sizes of this test at the fitted base."""
        return scale(self.data.records, self._tried[frozenset()].theta)

    def structure(self, *effects: str) -> Structure:
        """Return the structure of these effects, in their order."""
        return structure_of(self.entries, effects)

    def price(self, structure: Structure) -> float:
        """Return what a structure costs besides its error [nats]."""
        return price(structure, self.entries, len(self.names))

    def trial(self, effects: tuple[str, ...], added: str = '') -> Trial:
        """Score an already refitted structure with the current noise."""
        found = self._tried[frozenset(effects)]
        return Trial(self.structure(*effects), added, found, self.scorer.block_scores(found))

    def with_misfit(self, trial: Trial) -> Scorer:
        """Return a scorer that counts all that a structure leaves as noise."""
        if trial.fit not in self._misfit:
            parts = splits_of(self.data, trial.fit.error)
            self._misfit[trial.fit] = Scorer.of(self.data, parts, misfit=True)
        return self._misfit[trial.fit]

    def known(self, effects: Iterable[str]) -> Trial | None:
        """Return a structure that was refitted, or None."""
        names = tuple(effects)
        return self.trial(names) if frozenset(names) in self._tried else None

    def others(self, trial: Trial) -> list[str]:
        """Return the names that a structure does not have."""
        return [n for n in self.names if n not in trial.effects]

    def terms(self) -> list[str]:
        """Return the learned terms for this test; the entries hold them from the first call on."""
        if not self.described:
            self.entries |= {e.name: e for e in forms(self.scale(), self.entries)}
            self.described = True
        return [n for n, e in self.entries.items() if is_learned(e) and n not in self.names]

    def wider(self, names: Sequence[str]) -> Refits:
        """Return a copy that tries further effects; it knows all structures refitted so far."""
        own = {f.name: copy(getattr(self, f.name)) for f in fields(self) if f.name[0] == '_'}
        entries = dict(self.entries)
        own['_promises'] = self.promises.of(entries)
        return replace(self, names=(*self.names, *names), entries=entries, **own)

    def take_over(
        self, other: Refits, final: Trial, singles: Sequence[Trial], matters: float
    ) -> None:
        """Refit structures of another search of nearly the same target, from where they ended.

        Args:
            other: the search; its names and learned terms are taken over.
            final: its result; structures that leave no materially larger error, or have one
                effect less, are refitted, too.
            singles: every single effect; those that leave more are taken as they are.
            matters: least rms error that matters [m].
        """
        self.names, self.entries = other.names, dict(other.entries)
        self.described, self._promises = other.described, None
        most = final.mean_square + matters**2
        near = {key for key, known in other._tried.items() if known.rms**2 < most}
        near |= {frozenset(final.effects) - {n} for n in final.effects} & other._tried.keys()
        far = {frozenset(t.effects) for t in singles} - near
        self._polished |= {key: other._polished[key] for key in near & other._polished.keys()}

        def again(key: frozenset[str]) -> Fit:
            start, steps = other._tried[key].theta, 0 if key in far else _COARSE
            return self._fit(self.data, self.structure(*key), start, iterations=steps)

        asked = sorted(near | far, key=sorted)
        for key, found in zip(asked, self.each(again, asked), strict=True):
            if key not in self._tried or found.rms < self._tried[key].rms:
                self._keep(key, found)

    def left_at_most(self, mean_square: float) -> list[tuple[Structure, Fit]]:
        """Return all refitted structures that leave no more than a mean squared error [m^2]."""
        found = [(key, fit) for key, fit in self._tried.items() if fit.rms**2 <= mean_square]
        return [(self.structure(*effects), fit) for effects, fit in found]

    def add(self, current: Trial, name: str, each: Each = map, *, briefly: bool = False) -> Trial:
        """Refit `current` with one more effect, `briefly` by a single step.

        Pass `each` where nothing else runs meanwhile.
        """
        model = self.structure(*current.effects, name)
        key = frozenset(model.effects)
        near = self.effort.earlier.ended.get(key)
        if key not in self._tried and near is not None:
            starts = np.stack([near, self.promises.screen(current, name)[1][0]])
            start = self._lowest(starts, model.effects)
            found = self._fit(self.data, model, start, iterations=_COARSE, tolerance=_TOLERANCE)
            self._keep(key, found)
        elif key not in self._tried:
            starts, part = self.promises.screen(current, name)[1], self._stand_in(model)
            starts, steps = (starts[:1], 1) if briefly else (starts, _COARSE)
            found = self._fit(part.data, model, starts, iterations=steps, tolerance=_TOLERANCE)
            friction = self.entries[name].group == 'friction' and not (current.effects or briefly)
            if friction and found.rms < _PROMISING * rms(current.fit.error[part.rows]):
                found = self.effort.spent_on(
                    global_search.refit(part.data, model, found, _COARSE, _TOLERANCE, each)
                )
            if part is not self._whole:
                last = {'iterations': 0 if briefly else _FINISHED, 'tolerance': _TOLERANCE}
                found = self._fit(self.data, model, found.theta, **last)
            self._keep(key, found)
        return self.trial(model.effects, name)

    def polish(self, trial: Trial, valves: bool = True) -> Trial:
        """Finish the refit of a promising trial, from slower or quicker valves if need be."""
        key, added = frozenset(trial.effects), self.entries[trial.added]
        wanted = 2 if valves and poles.may_change(added) else 1
        if self._polished.get(key, 0) < wanted:
            some = self._stand_in(trial.structure).data
            data = some if _LONG * some.target.size < self.data.target.size else self.data
            before = self._tried[key].theta
            start = global_search.along_ridge(data, trial.structure, before)
            if wanted > 1:
                stiffness = frozenset(r.known_stiffness() for r in data.records)
                start = poles.starts(trial.structure, added, start, stiffness)
            if data is not self.data:
                start = np.stack([self._fit(data, trial.structure, start).theta, before])
            self._keep(key, self._fit(self.data, trial.structure, start))
            self._polished[key] = wanted
        return self.trial(trial.effects, trial.added)

    def finished(self, trial: Trial, finely: bool = False) -> Trial:
        """Go on with a refit until it gains nothing: a pole near a zero converges slowly.

        Where something remains (`finely`), also with small difference steps and from points around
        it: across the close kinks of stick-slip friction, usual differences do not point downhill.
        """
        key, model = frozenset(trial.effects), trial.structure
        last: dict[str, Any] = {'iterations': _LAST, 'tolerance': _LEAST_GAIN}
        found = self._fit(self.data, model, trial.fit.theta, **last)
        if finely:
            space = Space(model, self.data.duration, _FINER)
            lower = self._fit(self.data, model, found.theta, space=space, **last)
            if lower.rms < found.rms:
                found = self._fit(self.data, model, lower.theta, iterations=_FINISHED)
            found = self.effort.spent_on(scattered(self.data, model, found, _DONE))
        self._keep(key, found)
        return self.trial(trial.effects, trial.added)

    def _keep(self, key: frozenset[str], found: Fit) -> None:
        """Note a refitted structure; a learned term's name means nothing to a later diagnosis."""
        self._tried[key] = found
        # On the kinks of friction a refit may end anywhere: a later diagnosis searches it anew.
        if all(n in CATALOGUE and CATALOGUE[n].group != 'friction' for n in key):
            self.effort.remembered.ended[key] = found.theta

    def _fit(self, data: Data, model: Structure, starts: Array, **how: Any) -> Fit:
        return self.effort.spent_on(fit(data, model, starts, **{'tolerance': _DONE, **how}))

    def _lowest(self, starts: Array, effects: Sequence[str]) -> Array:
        """Return the parameters (p,) of some (s, p) that leave the least error."""
        simulated = self.data.simulate(self.structure(*effects), starts)
        return np.asarray(starts[np.argmin(sum_of_squares(self.data.target - simulated))])

    def _stand_in(self, model: Structure) -> Part:
        """Return the data that structures are refitted to roughly."""
        return self._whole if any(e.record_time for e in model.entries) else self._stretches

    @cached_property
    def _whole(self) -> Part:
        return Part.whole(self.data)

    @cached_property
    def _stretches(self) -> Part:
        return stretches(self.data) or self._whole

    def additions(
        self,
        current: Trial,
        names: Iterable[str] | None = None,
        progress: Callable[[float], None] | None = None,
        *,
        valves: bool = True,
        below: float = np.inf,
    ) -> list[Trial]:
        """Refit `current` with every further effect, best out-of-sample score first.

        Those near the best are finished, from a slower and a quicker valve too if need be, where
        they leave a mean squared error of less than `below` [m^2].
        """
        asked = Asked(current, tuple(names or self.names), below, every=names is None)
        return self.additions_to([asked], progress, valves=valves)[0]

    def additions_to(
        self,
        asked: Sequence[Asked],
        progress: Callable[[float], None] | None = None,
        *,
        valves: bool = True,
        together: bool = False,
    ) -> list[list[Trial]]:
        """Refit several structures as `additions` does, all of their refits at the same time.

        Those that promise too little are left out. Those near the best of their row, or of all
        rows `together`, are finished.
        """
        wanted = [self._wanted(a) for a in asked]
        # Two structures may lead to the same one: it is refitted from the first.
        first: dict[frozenset[str], tuple[Trial, str, bool]] = {}
        for current, name, briefly in itertools.chain(*wanted):
            first.setdefault(frozenset((*current.effects, name)), (current, name, briefly))

        def add(refit: tuple[Trial, str, bool]) -> Trial:
            return self.add(*refit[:2], briefly=refit[2])

        # The longest first, so that at the end no thread works on one alone for long.
        longest = sorted(first.values(), key=lambda refit: -self._expected_work(*refit))
        for i, _ in enumerate(self.each(add, longest)):
            if progress is not None:
                progress((i + 1) / len(first))
            else:
                self.effort.tell()
        rows = [sorted(map(add, row), key=by_score) for row in wanted]
        if together:
            every = {frozenset(t.effects): t for t in itertools.chain(*rows)}
            best = sorted(every.values(), key=by_score)
            worth = [_worth_finishing(best, max((a.below for a in asked), default=np.inf))]
        else:
            worth = [_worth_finishing(row, a.below) for row, a in zip(rows, asked, strict=True)]
        last = {frozenset(t.effects): t for t in itertools.chain(*worth)}
        done = dict[frozenset[str], Trial]()
        polished = self.each(lambda trial: self.polish(trial, valves), last.values())
        for key, trial in zip(last, polished, strict=True):
            done[key] = trial
            self.effort.tell()
        known = [[(done.get(frozenset(t.effects), t), t.added) for t in row] for row in rows]
        return [sorted((replace(t, added=n) for t, n in row), key=by_score) for row in known]

    def _wanted(self, asked: Asked) -> list[tuple[Trial, str, bool]]:
        """Return what is refitted: the structure, a further effect, whether briefly.

        An effect whose signature promises far less than another one's is left out, or than is of
        use where that is much of the structure that remains; where every one is listed, it is
        refitted briefly.
        """
        current = asked.current
        names = [n for n in asked.names if n not in current.effects]
        shares = list(self.each(lambda n: self.promises.share(current, n), names))
        use = max(0.0, 1.0 - asked.below / current.mean_square)
        if max(shares, default=0.0) < use < self._structure(current.fit) / UNDERSTATED:
            use = 0.0
        least = max([use, *shares]) / UNDERSTATED
        shares = list(self.each(lambda n: self.promises.share(current, n, least), names))
        far = {n for n, s in zip(names, shares, strict=True) if s < least and n != FEEDBACK}
        return [(current, n, n in far) for n in names if asked.every or n not in far]

    def _expected_work(self, current: Trial, name: str, briefly: bool) -> int:
        """Return a number that is larger for refits that take longer; 0 for a brief one."""
        model = self.structure(*current.effects, name)
        return 0 if briefly else len(model.parameters) * model.program.shorter

    def _structure(self, fit: Fit) -> float:
        """Return the share of a fit's squared error that is no noise."""
        return (structure_and_noise(self.data, fit.error)[0] / fit.rms) ** 2

    def worth(self, final: Trial) -> tuple[dict[str, float], dict[str, float]]:
        """Return, by effect, rms error [m] removed and nats gained beside the other effects."""
        gains, nats = {}, {}
        for name in final.effects:
            rest = self.without(final, name)
            gains[name], nats[name] = removed(rest, final), evidence(final.scores, rest.scores)
        return gains, nats

    def without_each(self, current: Trial) -> list[Trial]:
        """Refit a structure with each of its effects taken away, in their order, as `without`."""
        smaller = list(self.each(lambda name: self.without(current, name), current.effects))
        self.effort.tell()
        return smaller

    def without(self, current: Trial, name: str) -> Trial:
        """Refit a structure with one effect taken away, from where the larger one stands.

        A smaller structure that was fitted before may have stopped in a worse minimum than the
        larger one leads to: the effect would then be credited with what only the start gained.
        """
        effects = tuple(n for n in current.effects if n != name)
        key = frozenset(effects)
        if (key, current.effects) not in self._descended:
            self._descended.add((key, current.effects))
            kept = np.delete(current.fit.theta, current.structure.columns(name))
            starts = np.tile(kept, (2, 1))
            starts[1, : len(BASE)] = self._tried[frozenset()].theta
            model, start = self.structure(*effects), self._lowest(starts, effects)
            again = self._fit(self.data, model, start, tolerance=_TOLERANCE)
            if again.rms**2 < FAR * current.mean_square:
                again = self._fit(self.data, model, again.theta)
            if key not in self._tried or again.rms < self._tried[key].rms:
                self._tried[key] = again
            self._polished.setdefault(key, 1)
        return self.trial(effects)
