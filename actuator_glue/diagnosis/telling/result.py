"""What a diagnosis says, and its JSON form `actuator_glue.diagnosis/1`."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.finding import Candidate, Finding
from actuator_glue.diagnosis.learned.term import LearnedTerm
from actuator_glue.diagnosis.posterior.mixed_draws import shares
from actuator_glue.diagnosis.scopes.hold_and_stiffness import WrongSetup
from actuator_glue.diagnosis.scopes.onset import Onset
from actuator_glue.diagnosis.search.table import Row
from actuator_glue.diagnosis.selection import SearchStep
from actuator_glue.diagnosis.telling.headline import headline
from actuator_glue.diagnosis.telling.next_experiment import Experiment
from actuator_glue.diagnosis.telling.response import Response
from actuator_glue.diagnosis.verdict.alarm import Alarm
from actuator_glue.diagnosis.verdict.held_out import HeldOutError
from actuator_glue.diagnosis.verdict.traces import Trace
from actuator_glue.diagnosis.verdicts import COMPLETE, Verdict
from actuator_glue.inference.at_bound import Pressed
from actuator_glue.inference.prior_use import PriorUse
from actuator_glue.json_value import Json, json_value
from actuator_glue.model.effects import CATALOGUE, Effect
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

SCHEMA = 'actuator_glue.diagnosis/1'


@dataclass(frozen=True, slots=True)
class DiagnosisData:
    """Verdict, evidence and the augmented model.

    Attributes:
        verdict: 'none' (the model is enough), 'missing-effect' (what was added is all),
            'unexplained' (material structure remains) or 'undecided' (the held-out part does not
            bear out what the fitting part says).
        effects: additions that are supported, in the order of what they remove; whatever remains
            beside them they are part of the model, less probable the more of it does.
        error: held-out error before and after.
        candidates: all effects tried first, best first.
        coverage: share of held-out samples in the 95 % band, before and after.
        alarm: detection statistics.
        advice: what to do next, and last what was done to the records, for people.
        base: posterior of the base parameters in the augmented model.
        structure: effect names of the augmented model.
        names: parameter names of the columns of `posterior`.
        posterior: draws of base and effect parameters over all plausible structures, shape
            (m, p): reported intervals are their quantiles. Parameters that these records leave
            open are spread over all that is open, one parameter at a time.
        which: structure of each of these draws, index in `mixture`, shape (m,).
        mixture: effects of these structures.
        joint: draws under the reported structure alone, shape (n, p), to simulate with.
        rhat: largest R-hat of chains; NaN where the draws are not of chains.
        sampler: what drew them (`method`: 'importance', 'dream', 'laplace') and how well.
        best: best-fit parameters, shape (p,).
        traces: curves for the report.
        surrogate: a generic regression of equal flexibility and what it leaves out of sample.
        remaining: where in frequency, amplitude, velocity and time the unexplained residual lies.
        seconds: wall time; NaN where it was not measured.
        at_bound: parameters pressed against their bounds.
        sampling: per record its source, its rate as recorded and as fitted [Hz].
        preparation: the lines of `advice` that say what was done to the records.
        learned: terms among the effects that were learned from these records.
        base_before: posterior of Eq. (2)'s parameters without any addition.
        responses: frequency response of the augmented model at each stiffness.
        experiments: tests that would tell tied names apart, best first; none where none are tied.
        provenance: how it was made: command line, seed, version, hashes, date.
        onset: when the effects appeared, where they were not there from the beginning; sizes and
            errors are then those of the data since.
        prior: what was known of Eq. (2)'s parameters before, beside the bounds; None for nothing.
        setup: another set-up of the records that explains them far better than the one given.
        structures: all structures that were refitted on the way to the answer, greatest weight
            first.
        history: the steps that led to the answer, in order; the last one is the answer.
        effort: share of the effort that the search spent; at 1 and more it ended early.
        doubts: why an answer that explains the records must not be used as it stands, a sentence
            each: in the records themselves, in coverage, in the chains.
    """

    verdict: Verdict
    effects: tuple[Finding, ...]
    error: HeldOutError
    candidates: tuple[Candidate, ...]
    coverage: tuple[float, float]
    alarm: Alarm
    advice: tuple[str, ...]
    base: dict[str, Estimate]
    structure: tuple[str, ...]
    names: tuple[str, ...]
    posterior: Array
    rhat: float
    best: Array
    traces: tuple[Trace, ...]
    surrogate: Json
    remaining: Json
    seconds: float = math.nan
    at_bound: tuple[Pressed, ...] = ()
    sampling: tuple[Json, ...] = ()
    preparation: tuple[str, ...] = ()
    learned: tuple[LearnedTerm, ...] = ()
    base_before: dict[str, Estimate] = field(default_factory=dict)
    responses: tuple[Response, ...] = ()
    experiments: tuple[Experiment, ...] = ()
    provenance: dict[str, str] = field(default_factory=dict)
    onset: Onset | None = None
    prior: PriorUse | None = None
    setup: WrongSetup | None = None
    structures: tuple[Row, ...] = ()
    history: tuple[SearchStep, ...] = ()
    effort: float = 0.0
    doubts: tuple[str, ...] = ()
    sampler: Json = field(default_factory=dict)
    which: NDArray[np.intp] = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    mixture: tuple[tuple[str, ...], ...] = ()
    joint: Array = field(default_factory=lambda: np.empty((0, 0)))

    def to_json(self) -> Json:
        """Return the object of schema `actuator_glue.diagnosis/1` (curves and draws left out)."""
        return {
            'schema': SCHEMA,
            'verdict': self.verdict,
            'summary': self.summary(),
            'complete': self.complete,
            'doubts': list(self.doubts),
            'effects': [e.to_json() for e in self.effects],
            'error': self.error.to_json(),
            'searched': [name for name, entry in CATALOGUE.items() if entry.searched],
            'candidates': [c.to_json() for c in self.candidates],
            'coverage': {
                'before': json_value(self.coverage[0]),
                'after': json_value(self.coverage[1]),
            },
            'alarm': self.alarm.to_json(),
            'base': {name: p.to_json() for name, p in self.base.items()},
            'base_before': {name: p.to_json() for name, p in self.base_before.items()},
            'responses': [r.to_json() for r in self.responses],
            'experiments': [e.to_json() for e in self.experiments],
            'rhat': json_value(self.rhat),
            'sampler': self.sampler,
            'mixture': [
                {'effects': list(effects), 'weight': weight}
                for effects, weight in shares(self.which, self.mixture)
            ],
            'sampling': list(self.sampling),
            'at_bound': [p.to_json() for p in self.at_bound],
            'structure': list(self.structure),
            'learned': [term.to_json() for term in self.learned],
            'onset': self.onset.to_json() if self.onset else None,
            'prior': asdict(self.prior) if self.prior else None,
            'setup': self.setup.to_json() if self.setup else None,
            'structures': [row.to_json() for row in self.structures],
            'history': [step.to_json() for step in self.history],
            'surrogate': self.surrogate,
            'remaining': self.remaining,
            'advice': list(self.advice),
            'effort': self.effort,
            'seconds': json_value(self.seconds),
            'provenance': self.provenance,
        }

    def entry(self, name: str) -> Effect:
        """Return the effect of that name, learned here or of the catalogue."""
        own = {term.name: term.effect for term in self.learned}
        return own[name] if name in own else CATALOGUE[name]

    @property
    def model(self) -> Structure:
        """The augmented model, learned terms included."""
        return Structure(self.entry(name) for name in self.structure)

    @property
    def complete(self) -> bool:
        """Whether nothing material remains, in either part, and nothing speaks against that."""
        return self.verdict in COMPLETE and not self.doubts

    @property
    def outcome(self) -> Verdict:
        """The verdict for whoever reads one word only: 'unexplained' where there are doubts."""
        return 'unexplained' if self.doubts else self.verdict

    def summary(self) -> str:
        """Return the verdict in one line."""
        return headline(self)
