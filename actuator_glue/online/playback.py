"""The estimator over samples that are already there: the code that runs live, without a clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeAlias

from actuator_glue import sample_block
from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import ModelChoice, choose_model
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.job import WindowResult, fit, renew, report
from actuator_glue.online.schedule import Schedule
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Event, Failed, Preview, Rejected
from actuator_glue.online.structures import Proposal
from actuator_glue.online.window_posterior import Job, WindowFit
from actuator_glue.records import Record
from actuator_glue.sample_block import Block
from actuator_glue.setups import StreamSetup, from_message

Item: TypeAlias = StreamSetup | Block | Preview
Named: TypeAlias = tuple[str, Any]
# A window that has been sampled and is to be reported.
Sampled: TypeAlias = tuple[Job, WindowFit]


def at_once(found: Iterable[Event | Sampled]) -> Iterator[WindowResult | Event]:
    """Yield events as they are, and the report of each sampled window."""
    for thing in found:
        yield told(report(*thing)) if isinstance(thing, tuple) else thing


def told(result: WindowResult) -> WindowResult | Failed:
    """Return a result, or the event that says why there is none."""
    if not result.failure:
        return result
    return Failed(result.window.number, result.window.record.first_index, result.failure)


def replay(
    items: Iterable[Item],
    settings: EstimatorSettings,
    model: ModelChoice | Proposal | None = None,
    schedule: Schedule | None = None,
    reports: Callable[[Iterable[Event | Sampled]], Iterator[WindowResult | Event]] = at_once,
    carried: Carried | None = None,
) -> Iterator[WindowResult | Event]:
    """Run the estimator over what was streamed; yield results and events in order.

    Args:
        items: set-ups, blocks and previews as they came.
        settings: settings of the estimator.
        model: model to fit, or several structures; Eq. (2) where None.
        schedule: repeats what a live run dropped or stopped early.
        reports: computes what windows publish, perhaps beside the sampling of the next ones.
        carried: draws of an earlier calibration, for the priors that start from one.
    """
    estimator = Estimator(settings, model or choose_model(), schedule=schedule, carried=carried)
    return reports(_sampled(items, estimator))


def _sampled(items: Iterable[Item], estimator: Estimator) -> Iterator[Event | Sampled]:
    """Run the part of the estimator in which windows depend on one another."""
    for item in items:
        yield from give(estimator, item)
        while (job := estimator.next_job()) is not None:
            fitted = fit(job)
            yield from estimator.finish(fitted)
            sample_beside(estimator)
            if not fitted.failure:
                yield job, fitted


def sample_beside(estimator: Estimator) -> None:
    """Sample a less likely structure at once, which a live estimator does in parallel."""
    job = estimator.rival_job()
    if job is not None:
        estimator.finish_rival(renew(job))


def give(estimator: Estimator, item: Item) -> list[Event]:
    """Give an estimator one streamed item; return its events."""
    if isinstance(item, StreamSetup):
        return estimator.setup(item)
    if isinstance(item, Preview):
        return estimator.preview(item)
    return estimator.push(item)


def stream(record: Record, block: int = 64) -> Iterator[Item]:
    """Yield a record as it would have been streamed.

    Args:
        record: a record; its stiffness is announced with it.
        block: samples per block.
    """
    yield StreamSetup(
        record.stiffness,
        record.period,
        record.actuator,
        record.hold,
        record.first_index,
        record.source,
        record.motion,
    )
    for start in range(0, len(record), block):
        part = slice(start, start + block)
        yield Block(
            record.first_index + start,
            record.period,
            record.stamp_ns(start),
            record.command[part],
            record.measured[part],
            None if record.force is None else record.force[part],
        )


def items(messages: Iterable[Named], rejected: list[Rejected] | None = None) -> Iterator[Item]:
    """Yield what a live estimator received from (type name, message) pairs, in their order.

    Previews are left out: they decide when a forecast is published, not what it says.

    Args:
        messages: as a bag holds them.
        rejected: unusable set-ups are appended here; they were not used live either.
    """
    for name, message in messages:
        kind = name.rpartition('/')[2]
        if kind == 'SampleBlock':
            yield sample_block.from_message(message)
        elif kind == 'TestSetup':
            try:
                yield from_message(message)
            except InputError as error:
                if rejected is not None:
                    rejected.append(Rejected(str(error)))
