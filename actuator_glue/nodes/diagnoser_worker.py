"""What the diagnoser's worker does, and the Diagnosis message of what it finds."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from dataclasses import fields as dataclass_fields
from typing import Any

import numpy as np
from actuator_glue_msgs.msg import Candidate, Effect, ModelProposal
from actuator_glue_msgs.srv import SetModel

from actuator_glue.api.diagnosis import Diagnosis, diagnose
from actuator_glue.api.live import EFFORT, concluded, given
from actuator_glue.diagnosis.finding import Finding
from actuator_glue.diagnosis.remembered import Remembered
from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried, Drift
from actuator_glue.io.load import load_records
from actuator_glue.model.commands import noise
from actuator_glue.model.structure import Structure
from actuator_glue.nodes import own_effects
from actuator_glue.nodes.messages import fill
from actuator_glue.nodes.parameters import Spec
from actuator_glue.online.conversion import Fields, Head
from actuator_glue.online.structures import MATERIALS, Proposal, Proposed, spreads
from actuator_glue.online.when_to_diagnose import Concluded, LiveSettings
from actuator_glue.records import Record
from actuator_glue.setups import known_stiffness
from actuator_glue.workers.worker import Tell

SPECS = (
    Spec('automatic', True, 'diagnose when the coverage breaks'),
    Spec('apply', False, 'have the estimator go on with the augmented model'),
    Spec('coverage_limit', 0.8, 'coverage of the noise band that raises the alarm', '1', 0.0, 1.0),
    Spec('coverage_windows', 5, 'windows the coverage is averaged over', '1', 1, 1000, True),
    Spec('minimum', 15.0, 'data needed before a diagnosis by itself', 's', 5.0, 3600.0),
    Spec('pause', 10.0, 'least new data between diagnoses by itself', 's', 0.0, 86_400.0),
    Spec('keep', 180.0, 'samples kept for a diagnosis', 's', 10.0, 3600.0, True),
    Spec('seed', 1, 'seed of diagnoses by itself', '1', 0, 2**53),
    own_effects.SPEC,
    Spec('estimator', 'estimator', 'name of the estimator node', read_only=True),
)


@dataclass(frozen=True, slots=True)
class Request:
    """What is to be diagnosed.

    Attributes:
        records: records that are at hand.
        paths: bags or laboratory files to read, where there are none.
        stiffness: specimen stiffness of each path [N/m]; empty for what they say.
        holdout: path of the held-out record, empty for none.
        holdout_stiffness: its specimen stiffness [N/m], None for what it says.
        seed: seed of the random numbers.
        apply: the estimator is to go on with the augmented model.
        known: what the estimator knew before the records: draws, drift and age [s].
        reason: why the stream is diagnosed; empty where it was asked for.
        remembered: what the previous diagnosis of the stream left.
    """

    records: tuple[Record, ...] = ()
    paths: tuple[str, ...] = ()
    stiffness: tuple[float, ...] = ()
    holdout: str = ''
    holdout_stiffness: float | None = None
    seed: int = 1
    apply: bool = False
    known: tuple[Carried, Drift, float] | None = None
    reason: str = ''
    remembered: Remembered = field(default_factory=Remembered)


@dataclass(slots=True)
class Outcome:
    """What came of a request; `diagnosis` is None where `message` says why not.

    `concluded` is what it means for the estimator, `reason` why the stream was diagnosed,
    `remembered` what the next diagnosis begins with.
    """

    diagnosis: Diagnosis | None = None
    message: str = ''
    sources: tuple[str, ...] = ()
    actuator: str = ''
    applied: bool = False
    concluded: Concluded = field(default_factory=Concluded)
    reason: str = ''
    remembered: Remembered = field(default_factory=Remembered)


def asked(goal: Any, live: tuple[Record, ...], unused: str = '') -> Request:
    """Return the request of a Diagnose goal.

    Args:
        goal: the goal.
        live: the samples received so far, used where the goal names no records.
        unused: why samples that are received cannot be used; empty where they can.

    Raises:
        InputError: nothing to diagnose.
    """
    if not goal.records and not live:
        reason = unused or 'no stretch of 5 s without a gap has been received'
        raise InputError(f'{reason}, and the goal names no records')
    return Request(
        records=live,
        paths=tuple(goal.records),
        stiffness=tuple(goal.stiffness),
        holdout=goal.holdout,
        holdout_stiffness=known_stiffness(goal.holdout_stiffness),
        seed=int(goal.seed),
        apply=bool(goal.apply),
    )


def work(request: Request, tell: Tell) -> Outcome:
    """Diagnose; runs in the worker."""
    try:
        records, holdout = list(request.records), None
        if request.paths:
            records = load_records(list(request.paths), stiffness=list(request.stiffness) or None)
        if request.holdout:
            holdout = load_records(request.holdout, stiffness=request.holdout_stiffness)
        found = diagnose(
            records,
            holdout=holdout,
            seed=request.seed,
            jobs=1,
            effort=1.0 if request.paths else EFFORT,
            prior=given(request.known),
            progress=lambda stage, fraction: tell((stage, fraction)),
            remembered=request.remembered,
        )
    except InputError as error:
        return Outcome(message=str(error))
    return Outcome(
        diagnosis=replace(found, traces=()),  # curves are for the report, not for the wire
        message=found.summary(),
        sources=tuple(r.source for r in records),
        actuator=records[0].actuator,
        concluded=concluded(found, records, request.apply),
        reason=request.reason,
        remembered=request.remembered,
    )


def warm_up() -> None:
    """Compile what a diagnosis needs: a minute or more on a machine that has never done one."""
    rate, theta = 100.0, np.array([134.0, 1.1e9, 2.5e5, 0.5])
    command = noise(rate, 8.0, 0.2, 8.0, seed=1)
    lacking = Structure(('backlash',))
    record = Record(command, command, 1.0 / rate, 2.5e5)
    clean = lacking.simulate([*theta, 2e-4], record)
    measured = clean + 1e-5 * np.random.default_rng(1).standard_normal(len(clean))
    work(Request(records=(replace(record, measured=measured),)), lambda _: None)


def requested(proposal: Proposal) -> Any:
    """Return the SetModel request that has an estimator carry structures."""
    return SetModel.Request(
        structures=[_structure(one) for one in proposal.structures],
        material=_material(proposal.material),
    )


def _material(value: float) -> float:
    """Return a material error as a request has it [m]: a simulated record may lack any noise."""
    least, most = MATERIALS
    return min(max(value, least), most) if value > 0.0 else 0.0


def _structure(one: Proposed) -> Any:
    model, known = one.model, one.known
    message = ModelProposal(
        effects=list(model.effects),
        weight=one.weight,
        parameter_names=list(model.names),
        lower=list(model.lower),
        upper=list(model.upper),
        start=list(model.start),
    )
    if known is not None:
        names, draws = known.carried.names, known.carried.draws
        # Where all draws ended at a bound, they say nothing of how well a parameter is known.
        differ = [i for i, column in enumerate(draws.T) if spreads(column)]
        message.known_names = [names[i] for i in differ]
        message.known = draws[:, differ].ravel().tolist()
        message.known_middle, message.known_last = known.middle_ns, known.last_ns
    return message


def settings(values: Mapping[str, Any]) -> LiveSettings:
    """Return the settings of the loop among the node's parameters."""
    return LiveSettings(**{f.name: values[f.name] for f in dataclass_fields(LiveSettings)})


def fields(outcome: Outcome) -> Fields:
    """Return the fields of a Diagnosis message but its header; none without a diagnosis."""
    found = outcome.diagnosis
    if found is None:
        return {}
    error = found.error
    return {
        'verdict': found.outcome,
        'summary': outcome.message,
        'reason': outcome.reason,
        'records': list(outcome.sources),
        'effects': [effect_message(effect) for effect in found.effects],
        'candidates': [
            Candidate(name=c.name, score=float(c.score), error=float(c.error))
            for c in found.candidates
        ],
        'advice': list(found.advice),
        'split': error.split,
        'error_before': float(error.before),
        'error_before_lower': float(error.before_ci[0]),
        'error_before_upper': float(error.before_ci[1]),
        'error_after': float(error.after),
        'error_after_lower': float(error.after_ci[0]),
        'error_after_upper': float(error.after_ci[1]),
        'noise_floor': float(error.noise_floor),
        'removable_removed': float(error.removable_removed),
        'coverage_before': float(found.coverage[0]),
        'coverage_after': float(found.coverage[1]),
        'seconds': float(found.seconds),
        'json': json.dumps(found.to_json()),
    }


def fill_message(message: Any, head: Head, outcome: Outcome) -> Any:
    """Return a Diagnosis message with everything set, all numbers NaN without a diagnosis."""
    return fill(message, head, fields(outcome))


def effect_message(effect: Finding) -> Any:
    """Return an Effect message: sizes with 95 % limits, and whether the records fix them."""
    parameters = effect.parameters
    numbers = ('mean', 'stddev', 'lower', 'upper')
    return Effect(
        name=effect.name,
        alternatives=list(effect.alternatives),
        probability=float(effect.probability),
        place=effect.place,
        parameter_names=list(parameters),
        units=[p.unit for p in parameters.values()],
        identified=[bool(p.identified) for p in parameters.values()],
        **{n: [float(getattr(p, n)) for p in parameters.values()] for n in numbers},
    )
