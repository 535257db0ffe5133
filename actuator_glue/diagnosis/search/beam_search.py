"""Name the missing effects: beam search over sets of effects, alternatives of each member."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import partial

from actuator_glue.diagnosis.finding import Rival
from actuator_glue.diagnosis.learned.term import is_learned
from actuator_glue.diagnosis.refits.refits import Asked, Refits, by_score
from actuator_glue.diagnosis.score import false_alarms
from actuator_glue.diagnosis.search import pairs
from actuator_glue.diagnosis.search.judge import Judge
from actuator_glue.diagnosis.search.ties import compare
from actuator_glue.diagnosis.selection import SearchStep, Selection
from actuator_glue.diagnosis.stages import EFFECTS, Progress
from actuator_glue.diagnosis.thresholds import (
    BEAM,
    BEATEN_NOISE,
    FAR,
    LATER_SHARE,
    LEFT_SHARE,
    MOST_TERMS,
    NAMES_FIRST,
    PROMISED,
    SEEN,
    TERMS,
    TRIED,
    WORTH_FINISHING,
    Thresholds,
)
from actuator_glue.diagnosis.trial import Trial, removed

# Rounds in which members may be swapped for better or simpler ones.
_SWAPS = 4
# Rounds and swaps where something material remains: fewer, as learned terms may help instead.
_OPEN, _OPEN_TRIED = 1, 3


class BeamSearch(Judge):
    """Beam search over effect sets on one data set.

    Args:
        refits: the structures.
        settings: what a caller may set.
        progress: takes progress.
    """

    def __init__(self, refits: Refits, settings: Thresholds, progress: Progress) -> None:
        super().__init__(refits)
        self.settings, self.progress = settings, progress

    def apart(self) -> BeamSearch:
        """Return a copy with additions and noise of its own; it shares only the effort."""
        other = copy(self)
        other.refits = self.refits.wider(())
        return other

    def extend(self, beam: Sequence[Trial], stage: int) -> list[Trial]:
        """Refit every structure of the beam with its most promising further effects.

        Beyond `NAMES_FIRST` of them with learned terms, too: for what is outside the catalogue,
        further names would only imitate it.
        """
        label = EFFECTS[min(stage, len(EFFECTS)) - 1]
        self.progress(label, 0.0)
        asked = []
        for current in beam:
            names = self.refits.promises.best(current, self.refits.others(current))
            names = names[:TRIED]
            if stage > NAMES_FIRST:
                names += self.promising_terms(current)
            asked.append(Asked(current, tuple(names)))
        found: dict[tuple[str, ...], Trial] = {}
        told = partial(self.progress, label)
        for row in self.refits.additions_to(asked, told, valves=False, together=True):
            for trial in row:
                found.setdefault(trial.effects, trial)
        return sorted(found.values(), key=by_score)

    def explained_by_term(self, current: Trial) -> bool:
        """Whether a learned term leaves nothing material, alone or added to the names found.

        Tried before many names are added: for a machine outside the catalogue, further names would
        cost the time that a description needs.
        """
        enough = FAR * (self.noise**2 + self.material**2)
        starts = self.refits.trial(()), current
        asked = [Asked(s, self.promising_terms(s, enough), enough) for s in starts]
        rows = self.refits.additions_to(asked)
        return any(self.left(trial) < self.material for trial in itertools.chain(*rows))

    def promising_terms(self, current: Trial, below: float = math.inf) -> tuple[str, ...]:
        """Return the learned terms that promise most beside the present effects.

        Args:
            current: the structure.
            below: mean squared error that is of use [m^2]; terms whose signatures promise far more
                are left out.
        """
        if sum(map(is_learned, current.structure.entries)) >= MOST_TERMS:
            return ()
        names = [n for n in self.refits.terms() if n not in current.effects]
        promised = self.refits.promises.left(current, names)
        best = [n for n, left in promised if left < PROMISED * below][:TERMS]
        held = (self.refits.entries[n].holds for n in best)
        plainer = [h[0] for h in held if h is not None and h[0] not in current.effects]
        return tuple(dict.fromkeys((*best, *plainer)))

    def overlooked(self, current: Trial) -> list[Trial]:
        """Refit a structure with effects that only show once its members are in the model.

        With a clock's skew in it a payload looks like one; with Eq. (2) alone, like the skew.
        """
        here, names = current.effects, self.refits.others(current)
        new = [n for n in names if self.refits.known((*here, n)) is None]
        return self._rough(current, self.promising(current, new))

    def promising(self, current: Trial, names: Sequence[str]) -> list[str]:
        """Return the effects that promise most beside the present ones."""
        return self.refits.promises.best(current, names, beside=True)[:TRIED]

    def _rough(self, current: Trial, names: Sequence[str]) -> list[Trial]:
        """Refit a structure roughly with each further effect; finish those that may matter."""
        below = self.may_matter_below(current)
        return self.refits.additions(current, names, valves=False, below=below)

    def run(self) -> Selection:
        """Add effects while each is worth it, then check each against its rivals."""
        self.renoise()
        base = self.refits.trial(())
        below = base.mean_square - (SEEN * self.material) ** 2
        self.refits.effort.expects(self.left(base) >= self.material)
        tell = partial(self.progress, 'effect 1')
        singles = self.refits.additions(base, None, tell, below=below)
        self.progress('weighing', 0.0)
        self.renoise(self._nearest(singles))
        base, singles = self.refits.trial(()), self.rescored(singles)
        self._set_nats()
        return self._grown(base, singles, singles, (SearchStep.to(base, 'Eq. (2) alone'),))

    def resumed(self, before: Refits, found: Selection) -> Selection:
        """Continue from the result of another search of the same samples, since cleaned again.

        Its structures are refitted from where they ended, so only changes cost effort; once the
        effort is spent, its answer still stands.

        Args:
            before: the other search.
            found: its result.
        """
        own = found.final.added if found.final.own is not None else ''
        common = before.trial(tuple(n for n in found.final.effects if n != own))
        self.renoise()
        self.refits.take_over(before, common, found.singles, found.material)
        return self.grown_from(self.refits.trial(common.effects), found)

    def grown_from(self, current: Trial, found: Selection) -> Selection:
        """Continue from a structure that another result led to."""
        current = self._at_its_optimum(current)
        self._set_nats()
        return self._grown(current, self.rescored(found.singles), (), ())

    def _set_nats(self) -> None:
        seen, jacobian, part = self.refits.promises.signatures(self.refits.names)
        noise = self.refits.scorer.of_part(part)
        self.nats = false_alarms.threshold(seen, jacobian, noise, self.settings.false_alarms)

    def _grown(
        self,
        current: Trial,
        singles: Sequence[Trial],
        ranked: Sequence[Trial],
        begun: tuple[SearchStep, ...],
    ) -> Selection:
        """Add effects to a structure while each is worth it, then hold each against its rivals.

        Args:
            current: the structure.
            singles: every single effect.
            ranked: structures with one more effect, best first; empty tries promising ones.
            begun: steps that led here; empty when another search is continued.
        """
        most, steps, described = self.settings.most, list(begun), False
        current, threshold = self.refits.trial(current.effects, current.added), self.material
        base, singles = self.refits.trial(()), list(singles)
        for stage in range(len(current.effects) + 1, most + 1):
            best = self._first_worth(ranked, current, threshold)
            open_ = self.left(current) >= self.material and not self.refits.effort.over
            if best is None and open_:
                ranked = self.overlooked(current)
                best = self._first_worth(ranked, current, threshold)
            if best is None:
                # No further name is worth it; a learned term was not tried yet with so few names.
                asked = open_ and len(current.effects) < NAMES_FIRST
                described = asked and self.explained_by_term(current)
                break
            current = self._at_its_optimum(best)
            steps.append(SearchStep.to(current, f'with {best.added}'))
            base, singles = self.refits.trial(()), self.rescored(singles)
            threshold = self.material
            if self.left(current) < max(threshold, LEFT_SHARE * self.first):
                # Most is explained: a small gain may only correct the form of an effect found.
                threshold = max(threshold, LATER_SHARE * removed(base, current))
            if self.left(current) < self.material or stage == most or self.refits.effort.over:
                break
            if stage == NAMES_FIRST and (described := self.explained_by_term(current)):
                break
            width = max(1, BEAM + 1 - stage)  # the more effects, the fewer alternatives
            ranked = self.extend(self.rescored(ranked[:width]), stage + 1)
            if ranked and self.left(current) >= self.material:
                self.renoise(self._nearest(ranked))
                ranked = self.rescored(ranked)
            current = self.refits.trial(current.effects, current.added)
        # The result of another search was already compared with its rivals there.
        spared = described or (not begun and self.refits.effort.over)
        found = self.checked(current, singles, exchanged=not spared)
        if set(found.final.effects) != set(current.effects):
            steps.append(
                SearchStep.to(found.final, 'each held against its absence and its rivals')
            )
        return replace(found, steps=tuple(steps), described=described)

    def _first_worth(
        self, ranked: Sequence[Trial], current: Trial, threshold: float
    ) -> Trial | None:
        """Return the best structure that is worth its parameters.

        Nats weigh the whitened error, materiality the plain one: the best by nats may be
        immaterial where another effect is material. A structure that leaves nothing material
        does more than correct a form, so it must only be material.
        """
        for trial in ranked:
            cost = self._choice(trial)
            if self.better(trial, current, threshold, cost):
                return trial
            corrects = threshold <= self.material or self.left(trial) >= self.material
            if not corrects and self.better(trial, current, self.material, cost):
                return trial
        return None

    def _choice(self, trial: Trial) -> float:
        """Nats that the choice of a learned term costs; the level covers that of a name."""
        added = self.refits.entries[trial.added]
        return math.log(len(self.refits.terms())) if is_learned(added) else 0.0

    def _at_its_optimum(self, current: Trial) -> Trial:
        """Take the noise from a structure, fully refitted: a rough fit's error is no effect."""
        self.renoise(current)
        if self.left(current) >= self.material:
            current = self.refits.finished(current, finely=True)
            self.renoise(current)
        return current

    def _nearest(self, trials: Sequence[Trial]) -> Trial:
        """Return the structure of least left-out error: its residual is nearest to noise.

        Nats weigh the few frequencies with little noise: by them a structure that explains nearly
        everything may be last.
        """
        return min(trials, key=lambda t: self.refits.scorer.left_out_error(t.fit))

    def checked(
        self, current: Trial, singles: Sequence[Trial], *, exchanged: bool = True
    ) -> Selection:
        """Compare each member with its absence and its rivals, and note its evidence.

        Args:
            current: the structure.
            singles: every single effect, whatever noise it was scored with.
            exchanged: whether rivals are refitted; else those that are known already count.
        """
        self.progress('rivals', 0.0)
        current = self.pruned(current)
        if exchanged:
            for name in current.effects:
                current = self.refits.polish(replace(current, added=name))
            rest = self.left(current) >= BEATEN_NOISE * self.noise
            current = self.refits.finished(current, finely=rest)
        current, rivals = self.settle(current, refitted=exchanged)
        taken, nats = self.refits.worth(current)
        return Selection(
            self.refits.trial(()), tuple(self.rescored(singles)), current, rivals, taken, nats,
            self.first, self.left(current), self.noise, self.material, self.nats,
        )  # fmt: skip

    def pruned(self, current: Trial) -> Trial:
        """Remove members that are not worth their parameters."""
        for rest in self.refits.without_each(current) if len(current.effects) > 1 else ():
            if not self.better(current, rest, self.least(current, rest)):
                return self.pruned(rest)
        return current

    def settle(
        self, current: Trial, *, refitted: bool
    ) -> tuple[Trial, dict[str, tuple[Rival, ...]]]:
        """Exchange one member at a time for a rival of more weight, until none has more.

        Args:
            current: the structure.
            refitted: whether rivals are refitted, for some rounds and while effort is left; then,
                and else, those that are known count.

        Returns:
            The structure, and the rivals of each of its members.
        """
        complete = self.left(current) < self.material
        most = TRIED if complete else _OPEN_TRIED
        rounds = (_SWAPS if complete else _OPEN) if refitted else 0
        while True:
            rests = self.refits.without_each(current)
            if rounds:
                in_place = self._in_place(current, rests, most, complete)
            else:
                in_place = [self._known_in_place(current, rest) for rest in rests]
            heavier = self._exchanged(current, in_place)
            if heavier is None:
                return current, self._all_rivals(current, rests, in_place)
            current, rounds = heavier, 0 if self.refits.effort.over else max(0, rounds - 1)

    def _exchanged(self, current: Trial, in_place: Sequence[Sequence[Trial]]) -> Trial | None:
        """Return a structure with another member and more weight than the current one, if any.

        The heaviest is tried first. With the new member, others may no longer be worth their
        parameters: what remains without these must have more weight, too.
        """
        behind = [(self.behind(t, current), t) for t in itertools.chain(*in_place)]
        for nats, trial in sorted(behind, key=lambda pair: pair[0]):
            if nats >= 0.0:
                break
            if pairs.both_worth(self, trial):
                kept = self.pruned(trial)
                if self.behind(kept, current) < 0.0:
                    return kept
        return None

    def _known_in_place(self, current: Trial, rest: Trial) -> list[Trial]:
        """Return the known refits with another effect in place of a member."""
        tried = [(n, self.refits.known((*rest.effects, n))) for n in self.refits.others(current)]
        return [replace(trial, added=name) for name, trial in tried if trial is not None]

    def _all_rivals(
        self, current: Trial, rests: Sequence[Trial], in_place: Sequence[Sequence[Trial]]
    ) -> dict[str, tuple[Rival, ...]]:
        rows = zip(current.effects, rests, in_place, strict=True)
        return {name: self._rivals(rest, current, name, trials) for name, rest, trials in rows}

    def _in_place(
        self, current: Trial, rests: Sequence[Trial], most: int, complete: bool
    ) -> list[list[Trial]]:
        """Refit with the most promising effects, or pairs, in place of each member.

        Args:
            current: the structure.
            rests: the structure without each of its members.
            most: effects tried in place of each of several members.
            complete: whether nothing material is left.
        """
        refits, asked = self.refits, []
        for rest in rests:
            names = refits.others(current)
            if len(current.effects) > 1:
                names = refits.promises.best(rest, names)[:most]
            # A rough refit of a rival that leaves more is not worth finishing.
            taken = rest.mean_square - current.mean_square
            below = rest.mean_square - WORTH_FINISHING**2 * taken
            asked.append(Asked(rest, tuple(names), below))
        singles = refits.additions_to(asked)
        return [
            [*trials, *pairs.rivals(refits, name, trials, most, a.below, complete)]
            for name, trials, a in zip(current.effects, singles, asked, strict=True)
        ]

    def _rivals(
        self, rest: Trial, best: Trial, name: str, trials: Sequence[Trial]
    ) -> tuple[Rival, ...]:
        """Return the rivals with their probabilities; remaining misfit counts as noise."""
        odds, scorer = self.odds(rest, best, trials), self.refits.scorer
        if self.left(best) >= self.material:
            scorer = self.refits.with_misfit(best)
            rest, best, *trials = (scorer.scored(t) for t in (rest, best, *trials))
        return compare(rest, replace(best, added=name), trials, odds, scorer)
