"""What an estimator keeps of each structure that it carries, and which structures it drops."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.online import structures
from actuator_glue.online.forecast import FrozenPosterior
from actuator_glue.online.job import WindowResult
from actuator_glue.online.knowledge import Knowledge
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Contradicted, Event, Reweighed, structure_name
from actuator_glue.online.structures import Proposal
from actuator_glue.online.window_posterior import WindowFit
from actuator_glue.records import Array


@dataclass(slots=True, eq=False)
class CarriedStructure:
    """A structure that is carried, and what it keeps of its last result.

    Attributes:
        model: the structure.
        knowledge: what earlier samples say of its parameters.
        archive: points that its next window starts from.
        epoch: actuator of these points.
        frozen: its last posterior, with which it forecasts while it is not sampled.
        waited: windows since its last result.
        before: it is a reference that new structures must beat: Eq. (2), or carried before them.
        worse: successive windows in which its forecasts were worse than a reference's.
    """

    model: ModelChoice
    knowledge: Knowledge
    archive: Array | None = None
    epoch: int = -1
    frozen: FrozenPosterior | None = None
    waited: int = 0
    before: bool = False
    worse: int = 0

    def learn(self, found: WindowResult | WindowFit) -> list[Contradicted]:
        """Keep the results of a window; return alarms that it contradicts the prior."""
        self.waited = 0
        if found.failure:
            return []
        if found.archive is not None:
            self.archive, self.epoch = found.archive, found.window.epoch
        if found.frozen is not None:
            self.frozen = replace(found.frozen, beside=())
        return self.knowledge.learn(found.window, found.learned, found.conflict)


class CarriedStructures:
    """The structures that are carried, the likeliest first.

    Args:
        settings: of the estimator.
        carried: draws of an earlier calibration, for the priors that start from one.
        proposal: what is carried first.

    Attributes:
        proposal: what is carried, as it was proposed last.
    """

    def __init__(
        self, settings: EstimatorSettings, carried: Carried | None, proposal: Proposal
    ) -> None:
        self._settings = settings
        self._carried = carried
        self._members: list[CarriedStructure] = []
        self._judged_to: int | None = None
        self._log_prior = self._evidence = np.zeros(0)
        self.begin(proposal)

    def __iter__(self) -> Iterator[CarriedStructure]:
        return iter(self._members)

    def __len__(self) -> int:
        return len(self._members)

    @property
    def leading(self) -> CarriedStructure:
        """The likeliest structure."""
        return self._members[0]

    @property
    def rivals(self) -> list[CarriedStructure]:
        """The others."""
        return self._members[1:]

    @property
    def weights(self) -> tuple[tuple[ModelChoice, float], ...]:
        """The structures and their weights, without those kept only as a reference."""
        found = zip(self._members, self.shares().tolist(), strict=True)
        return tuple((member.model, share) for member, share in found if share > 0.0)

    def begin(self, proposal: Proposal) -> None:
        """Carry these structures from now on; a structure carried before keeps its knowledge.

        Unless the proposal begins afresh: then only the points that its next window starts from.

        Where there are several, Eq. (2) and the structures carried before are the references
        that the others have to beat.
        """
        led = self._members[0] if self._members else None
        began = None if led is None else led.knowledge.began_ns
        old = {frozenset(member.model.effects): member for member in self._members}
        carried = [(frozenset(model.effects), share) for model, share in self.weights]
        self._members, told = [], []
        for one in proposal.structures:
            member = None if one.known is not None else old.get(frozenset(one.model.effects))
            if member is None or _box(member.model) != _box(one.model):
                known = Knowledge(self._settings, self._carried, one.known, began)
                member = CarriedStructure(one.model, known)
            elif proposal.afresh:
                member.knowledge = Knowledge(self._settings, self._carried, None, began)
            member.before, member.worse = False, 0
            self._members.append(member)
            told.append(replace(one, model=member.model))
        self.proposal = replace(proposal, structures=tuple(told))
        self._log_prior = proposal.log_weights
        if len(self._members) > 1:
            for member in self._members:
                member.before = not member.model.effects
            names = {frozenset(member.model.effects) for member in self._members}
            most = structures.most_in_all(self._settings.window, self._settings.hop)
            for effects, share in carried[: structures.MOST]:
                if effects in names or len(self._members) == most:
                    continue
                stays = old[effects]
                stays.before, stays.worse = True, 0
                weight = max(structures.BEFORE * share, structures.BESIDE)
                self._members.append(stays)
                self._log_prior = np.append(self._log_prior, np.log(weight))
        self._evidence = np.zeros(len(self._members))
        self._judged_to = None

    def shares(self) -> Array:
        """Return the weights (K,) of all members; 0 for one kept only as a reference."""
        return structures.weights(self._log_prior, self._evidence)

    def weigh(self, result: WindowResult | WindowFit) -> list[Event]:
        """Update weights by the forecasts a window judged; drop structures of little weight."""
        if len(self._members) < 2 or not result.errors:
            return []
        settings, window = self._settings, result.window
        since = settings.hop
        if self._judged_to is not None:
            since = max(since, (window.end - self._judged_to) * window.record.period)
        self._judged_to = window.end
        material = self.proposal.material
        if np.isnan(material) and result.frozen is not None:
            material = structures.MATERIAL * result.frozen.noise
        memory = structures.MEMORY * settings.window
        self._evidence = structures.moved(self._evidence, result.errors, material, since, memory)
        before = self._members[0].model
        worse = self._outdone(result.errors, material)
        shares = self.shares()
        carried = np.isfinite(self._log_prior)
        order = [int(i) for i in np.argsort(-shares, kind='stable')]
        out = [i for i in order if shares[i] < structures.LEAVES]
        left = [self._members[i].model for i in out if carried[i]]
        left = [before, *left] if worse else left
        # Eq. (2) takes no time and stays as a reference for what the others add.
        self._log_prior[out] = -np.inf
        kept = [i for i in order if i not in out or self._compared(i)]
        self._members = [self._members[i] for i in kept]
        self._log_prior, self._evidence = self._log_prior[kept], self._evidence[kept]
        if not left and self._members[0].model is before:
            return []
        now = tuple((model.effects, share) for model, share in self.weights)
        said = ', '.join(f'{structure_name(name)} {share:.0%}' for name, share in now)
        gone = ', '.join(structure_name(model.effects) for model in left)
        return [
            Reweighed(
                window.number,
                window.end,
                now,
                tuple(model.effects for model in left),
                f'forecasts up to sample {window.end} weigh {said}'
                + (f'; no longer carried: {gone}' if gone else '')
                + (f'; {structure_name(before.effects)} made them worse' if worse else ''),
                worse,
                window.record.stamp_ns(len(window.record) - 1),
            )
        ]

    def _compared(self, i: int) -> bool:
        """Whether a structure of no weight stays, as a reference for the others."""
        member = self._members[i]
        return member.before and not member.model.effects

    def _outdone(self, errors: Sequence[float], material: float) -> bool:
        """Drop the leading structure if it makes forecasts worse; return whether it was dropped.

        That is if they were worse than those of the best reference, by more than what matters, in
        enough successive windows; the reference takes its place.
        """
        leading = self._members[0]
        rivals = [
            (error, i)
            for i, (member, error) in enumerate(zip(self._members, errors, strict=True))
            if i > 0 and member.before and np.isfinite(error)
        ]
        for member in self._members[1:]:
            member.worse = 0
        if not leading.model.effects or not rivals or not np.isfinite(errors[0]):
            return False
        least, best = min(rivals)
        leading.worse = leading.worse + 1 if errors[0] > least + material**2 else 0
        lasts = max(structures.WORSE, math.ceil(structures.WORSE_SECONDS / self._settings.hop))
        if leading.worse < lasts:
            return False
        self._log_prior[best] = max(self._log_prior[0], self._log_prior[best])
        self._evidence[best] = max(self._evidence[0], self._evidence[best])
        self._log_prior[0] = -np.inf
        return True


def _box(model: ModelChoice) -> dict[str, tuple[float, float]]:
    """Return the bounds of each parameter, in whatever order they come."""
    pairs = zip(model.lower, model.upper, strict=True)
    return dict(zip(model.names, pairs, strict=True))
