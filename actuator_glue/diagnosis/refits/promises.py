"""What effects promise to remove of a residual, by their signatures: what is worth a refit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias
from weakref import WeakKeyDictionary

import numpy as np

from actuator_glue.diagnosis.refits.candidates import structure_of
from actuator_glue.diagnosis.refits.screening import Remainder, screen, signatures
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.inference.least_squares.stretches import Part, stretches
from actuator_glue.model.effects import Effect, scale
from actuator_glue.records import Array

_SCREENED = 30.0  # s of stretches on which signatures are seen

# By effect, and whether it was beside the present ones.
_Screens: TypeAlias = dict[tuple[str, bool], tuple[float, Array]]


@dataclass
class Promises:
    """What each effect promises, on one data set.

    Attributes:
        data: the counted samples.
        base: fit of Eq. (2).
        entries: the effects, in the order in which they stand in a structure.
        each: screens effects, several at a time if it can.
    """

    data: Data
    base: Fit
    entries: Mapping[str, Effect]
    each: Each
    _signatures: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    _screened: WeakKeyDictionary[Fit, _Screens] = field(default_factory=WeakKeyDictionary)
    _remainders: dict[bool, tuple[Fit, Remainder]] = field(default_factory=dict)

    def of(self, entries: Mapping[str, Effect]) -> Promises:
        """Return these for more effects; what one of them finds, the other knows."""
        return replace(self, entries=entries)

    def signature(self, name: str) -> tuple[Array, Array]:
        """Starting sizes of an effect (s, k), and what each adds to Eq. (2) as fitted (s, M)."""
        if name not in self._signatures:
            alone, base = structure_of(self.entries, (name,)), self.base.theta
            thetas = alone.starts(base, scale(self.data.records, base))
            seen = signatures(self._seen_on(name).data, alone, thetas, base)
            self._signatures[name] = thetas[:, alone.columns(name)], seen
        return self._signatures[name]

    def signatures(self, names: Iterable[str]) -> tuple[Array, Array, Part]:
        """Signatures of effects at all their starting sizes (s, M) [m].

        And what they are seen beside: the Jacobian of Eq. (2) (4, M), and the data seen on.
        """
        part, rows = self._glances, []
        for name in names:
            own, seen = self._seen_on(name), self.signature(name)[1]
            rows.append(seen if own is part else seen[:, part.rows])
        every = np.concatenate(rows)
        # A metre of response: it diverged.
        alive = np.nan_to_num(np.abs(every), nan=np.inf).max(axis=1) < 1.0
        return every[alive], self.base.jacobian_of(part.rows), part

    def screen(self, current: Trial, name: str, *, beside: bool = False) -> tuple[float, Array]:
        """Project a structure's residual on an effect's signatures (see screening.py).

        They are those with Eq. (2) alone, or `beside` the effects of the structure.

        Returns:
            The largest share of the squared error that one of the effect's starting sizes can
            remove, and the starting parameters that promise most (s, p), read-only.
        """
        known = self._screened.setdefault(current.fit, {})
        if (name, beside) not in known:
            known[name, beside] = self._screen(current, name, beside)
        return known[name, beside]

    def share(self, current: Trial, name: str, least: float = 0.0) -> float:
        """Return the share of the squared error that an effect's signatures promise to remove.

        Where those with Eq. (2) alone promise less than `least`, the larger one of theirs and of
        those beside the present effects: given a delay, a damper removed half of what was left,
        and two thousandths were promised.
        """
        share = self.screen(current, name)[0]
        if share < least and current.effects:
            share = max(share, self.screen(current, name, beside=True)[0])
        return share

    def left(
        self, current: Trial, names: Iterable[str], *, beside: bool = False
    ) -> list[tuple[str, float]]:
        """Sort effects by the mean squared error that their signatures promise to leave [m^2].

        Those with Eq. (2) alone, or `beside` the present effects, which takes as long as refits.
        """
        wanted = list(names)
        shares = list(self.each(lambda n: self.screen(current, n, beside=beside)[0], wanted))
        left = [(n, (1.0 - s) * current.mean_square) for n, s in zip(wanted, shares, strict=True)]
        return sorted(left, key=lambda pair: pair[1])

    def best(self, current: Trial, names: Iterable[str], *, beside: bool = False) -> list[str]:
        """Sort effects by what their signatures promise, as `left`."""
        return [name for name, _ in self.left(current, names, beside=beside)]

    def _screen(self, current: Trial, name: str, beside: bool) -> tuple[float, Array]:
        model = structure_of(self.entries, (*current.effects, name))
        part, fit = self._seen_on(name), current.fit
        sizes, seen = self.signature(name)
        new = np.zeros(len(model.parameters), dtype=np.bool_)
        new[model.columns(name)] = True

        def with_others(own: Array) -> Array:
            thetas = np.empty((len(own), len(new)))
            thetas[:, new], thetas[:, ~new] = own, fit.theta
            return thetas

        if beside:
            simulated = part.data.target - fit.error[part.rows]
            seen = part.data.simulate(model, with_others(sizes)) - simulated
        left = self._remainder(fit, part)
        share, best = screen(self.entries[name].parameters, sizes, seen, left)
        starts = with_others(best)
        starts.flags.writeable = False  # it is kept
        return share, starts

    def _remainder(self, fit: Fit, part: Part) -> Remainder:
        """What a fit's parameters leave of its error; that of the last fit is kept."""
        whole = part is self._whole
        known = self._remainders.get(whole)
        if known is None or known[0] is not fit:
            left = Remainder.of(fit.error[part.rows], fit.jacobian_of(part.rows))
            self._remainders[whole] = known = fit, left
        return known[1]

    def _seen_on(self, name: str) -> Part:
        """Return the data on which an effect's signatures are seen."""
        return self._whole if self.entries[name].record_time else self._glances

    @cached_property
    def _whole(self) -> Part:
        return Part.whole(self.data)

    @cached_property
    def _glances(self) -> Part:
        return stretches(self.data, _SCREENED) or self._whole
