"""Replay: the online estimator over a bag or records, held against what it published live."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, fields
from os import PathLike
from typing import Any, Literal, TypedDict, Unpack

from actuator_glue.api.bar import shown
from actuator_glue.api.given import Records, records_given
from actuator_glue.api.options import chosen, takes
from actuator_glue.api.replay_data import (
    Compared,
    ScoredBand,
    WindowError,
    WindowEstimate,
    WindowExplanation,
    WindowParameter,
)
from actuator_glue.api.replay_result import Replay
from actuator_glue.api.tracking import window_tracking
from actuator_glue.errors import InputError
from actuator_glue.given import path as path_given
from actuator_glue.given import take_numbers
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.inference.moments import Moments
from actuator_glue.io.bag_publishers import Publishers
from actuator_glue.io.bag_reader import decoded, is_bag, summarise
from actuator_glue.io.bag_records import check_order
from actuator_glue.io.bag_samples import topics_of_actuator
from actuator_glue.motion import METRES
from actuator_glue.online.job import WindowResult
from actuator_glue.online.playback import Item, items, stream
from actuator_glue.online.playback import replay as replayed
from actuator_glue.online.replay_comparison import Published, ReplayComparison, compare, published
from actuator_glue.online.runs import shares
from actuator_glue.online.settings import AUTOMATIC, EstimatorSettings
from actuator_glue.online.stream import Rejected, structure_name
from actuator_glue.sample_block import Block, check_block
from actuator_glue.setups import StreamSetup
from actuator_glue.workers.reports import Reports

INPUTS = ('SampleBlock', 'TestSetup')
RESULTS = ('EstimatorSetup', 'PosteriorMoments', 'PosteriorDraws', 'PredictionBand')

Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """What of the estimator's settings a replay may change; None for those of the live run.

    Attributes:
        window: length of a window [s].
        hop: time from one window to the next [s].
        settle: start of a window that only lets the initial state be forgotten [s].
        shaping_factor: G of Eq. (4); 'auto' takes each window's from its own residual.
        evaluations: likelihood evaluations of a window of Eq. (2), at most.
        seed: seed of the sampler.
    """

    window: float | None = None
    hop: float | None = None
    settle: float | None = None
    shaping_factor: float | Literal['auto'] | None = None
    evaluations: int | None = None
    seed: int | None = None

    def __post_init__(self) -> None:
        take_numbers(self)

    def asked(self) -> dict[str, Any]:
        """Return what is changed, as settings of the estimator.

        Raises:
            InputError: a shaping factor that is a word but 'auto'.
        """
        found = {n: v for n in OVERRIDES if (v := getattr(self, n)) is not None}
        factor = found.get('shaping_factor')
        if isinstance(factor, str) and factor != 'auto':
            raise InputError(f"shaping_factor {factor!r} is no number, nor 'auto'")
        return found | ({'shaping_factor': AUTOMATIC} if factor == 'auto' else {})


OVERRIDES = tuple(f.name for f in fields(ReplayOptions))


class ReplayChanges(TypedDict, total=False):
    """The options by name, for type checkers; a test holds them to `ReplayOptions`."""

    window: float | None
    hop: float | None
    settle: float | None
    shaping_factor: float | Literal['auto'] | None
    evaluations: int | None
    seed: int | None


@dataclass(slots=True)
class _Run:
    """A replay under way: where samples come from, what was published, what is known so far."""

    source: str
    items: Iterator[Item]
    total: int = 0
    runs: list[Published] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    windows: list[WindowEstimate] = field(default_factory=list)
    events: list[str] = field(default_factory=list)
    effects: tuple[str, ...] = ()
    data_seconds: float = 0.0
    tracking: bool = False
    motion: str = METRES
    # Running indices of the first sample of each stretch without a gap, and of the one after it.
    stretches: list[tuple[int, int]] = field(default_factory=list)
    publishers: Publishers = field(default_factory=Publishers)
    # The first set-up with a stiffness, or else the last one; and why one cannot be used.
    setup: StreamSetup | None = None
    refused: str = ''

    @property
    def no_window(self) -> str:
        """Why there is no window at all, behind a colon; empty where no reason is known."""
        if not self.stretches:
            return ': it has no samples'
        if self.publishers.told:
            return f': {self.publishers.told}'
        give = 'give the specimen stiffness with --stiffness N/m, 0 for a free actuator'
        if self.setup is None:
            refused = f' that can be used ({self.refused})' if self.refused else ''
            return f': it has samples, but nothing on test_setup{refused}; {give}'
        if self.setup.stiffness is None:
            return f': the specimen stiffness of {self.setup.actuator!r} is not known; {give}'
        return ''

    def took(self, block: Block) -> None:
        """Count the samples of a block."""
        seconds = _usable_seconds(block)
        self.data_seconds += seconds
        if seconds:
            self.publishers.take(block)
        first, stop = block.index, block.index + len(block)
        if self.stretches and self.stretches[-1][1] == first:
            first = self.stretches.pop()[0]
        self.stretches.append((first, stop))

    def missing(self, first: int, stop: int) -> str:
        """Return what is missing of the samples first to stop - 1; empty where nothing is."""
        if any(begin <= first and stop <= end for begin, end in self.stretches):
            return ''
        held = sum(max(0, min(stop, e) - max(first, b)) for b, e in self.stretches)
        return f'{max(stop - first - held, 1)} of its samples {first} to {stop - 1} are missing'


@takes(ReplayOptions)
def replay(
    source: Records,
    *,
    namespace: str | None = None,
    tracking: bool = False,
    progress: Progress | bool | None = None,
    **changes: Unpack[ReplayChanges],
) -> Replay:
    """Run the online estimator over recorded samples: the code that runs live, without a clock.

    Args:
        source: a bag, laboratory files, or records; where a bag holds what a live estimator
            published and no setting is given, both are compared bit by bit.
        namespace: whose samples, where a bag has several actuators.
        tracking: whether each window tells how the actuator followed its command.
        progress: called with the share of the messages read; True for a bar, False for none; None
            for a bar in a notebook.
        changes: settings of the estimator by name; None for those of the live run.

    Raises:
        InputError: unusable bag, record or setting, or not one window could be estimated.
    """
    asked = chosen(ReplayOptions, None, changes, 'replay').asked()
    under_way = _open(source, namespace, compare_live=not asked)
    under_way.tracking = tracking
    started = time.perf_counter()
    used = _settings(under_way.runs, asked)
    with shown('replay', 1.0, progress) as done:
        comparison = _estimate(under_way, used, done)
    if not under_way.windows:
        reason = under_way.no_window
        raise InputError(f'{under_way.source}: not one window could be estimated{reason}')
    if under_way.publishers.told:
        under_way.notes.append(f'topic of the samples: {under_way.publishers.told}')
    return Replay(
        bag=under_way.source,
        settings={name: getattr(used, name) for name in OVERRIDES},
        effects=under_way.effects,
        windows=tuple(under_way.windows),
        events=tuple(under_way.events),
        identical=None if comparison is None else comparison.identical,
        compared=None
        if comparison is None
        else Compared(
            comparison.windows,
            comparison.bands,
            tuple(comparison.differing),
            tuple(comparison.unrepeatable),
        ),
        data_seconds=under_way.data_seconds,
        seconds=time.perf_counter() - started,
        notes=tuple(under_way.notes),
        motion=under_way.motion,
    )


def _open(source: Records, namespace: str | None, compare_live: bool) -> _Run:
    if isinstance(source, (str, PathLike)) and is_bag(path_given(source)):
        return _open_bag(str(path_given(source)), namespace, compare_live)
    if namespace is not None:
        raise InputError(
            f'namespace {namespace!r} says whose samples of a bag are meant, and what is replayed '
            'here are records (a file, or a bag with another stiffness or hold); take it out'
        )
    records = records_given(source, name='source')
    for record in records:
        record.known_stiffness()
    name = records[0].source or 'records' if records else 'no record'
    return _Run(name, (item for record in records for item in stream(record)))


def _open_bag(bag: str, namespace: str | None, compare_live: bool) -> _Run:
    summary = summarise(bag)
    check_order(bag)
    names = topics_of_actuator(bag, summary, namespace)
    topics = [summary.topics[name] for name in names]
    rejected: list[Rejected] = []
    out = _Run(bag, iter(()), sum(t.count for t in topics))

    def told() -> Iterator[Item]:
        for item in items(decoded(bag, INPUTS, topics=names), rejected):
            out.notes += [r.message for r in rejected]
            out.refused = out.refused or (rejected[0].message if rejected else '')
            rejected.clear()
            yield item

    out.items = told()
    if compare_live and any(t.type.endswith('PosteriorMoments') and t.count for t in topics):
        found = published(decoded(bag, RESULTS, counted=('SampleBlock',), topics=names))
        out.runs = found if any(run.repeatable for run in found) else []
        if not out.runs:
            out.notes.append(
                'the bag has posteriors but no EstimatorSetup: there is nothing to compare with'
            )
        elif len(found) > 1:
            spans = ', '.join(run.span for run in found)
            out.notes.append(
                f'the estimator began {len(found)} times in this bag ({spans}): each run is '
                'repeated and compared by itself'
            )
            if len({repr(run.settings) for run in found if run.repeatable}) > 1:
                out.notes.append('its settings changed between runs; told are those of the last')
    return out


def _settings(runs: list[Published], asked: dict[str, Any]) -> EstimatorSettings:
    for run in reversed(runs):
        if run.repeatable and run.settings is not None:
            return run.settings
    # No clock runs here, so a budget of time says nothing; it must only fit the hop.
    if 'hop' in asked:
        asked = {**asked, 'time_budget': min(0.5, asked['hop'])}
    return EstimatorSettings.from_mapping(asked, 'options')


def _estimate(out: _Run, settings: EstimatorSettings, done: Progress) -> ReplayComparison | None:
    """Run the estimator, filling in what is told of windows; compare with the live runs."""

    def counted() -> Iterator[Item]:
        for place, item in enumerate(out.items):
            done(place / out.total if out.total else 0.0)
            yield item

    def taken(share: Iterable[Item]) -> Iterator[Item]:
        out.stretches.clear()
        for item in share:
            if isinstance(item, Block):
                out.took(item)
            elif isinstance(item, StreamSetup):
                out.motion = item.motion
                if out.setup is None or out.setup.stiffness is None:
                    out.setup = item
            yield item

    def results(share: Iterable[Item], live: Published | None, run: int) -> Iterator[WindowResult]:
        found = (
            replayed(taken(share), settings, reports=reports)
            if live is None or live.settings is None
            else replayed(
                taken(share),
                live.settings,
                live.models[0][1],
                live.schedule(),
                reports,
                live.carried,
            )
        )
        for told in found:
            if isinstance(told, WindowResult):
                # Not the result itself: its samples and bands are many.
                out.windows.append(_window(told, out.tracking, run))
                out.effects = told.model.effects
                yield told
            else:
                out.events.append(getattr(told, 'message', str(told)))

    # Without a live run to compare with, the limits of bands are not needed.
    with Reports(limits=bool(out.runs)) as reports:
        if not out.runs:
            for _ in results(counted(), None, 1):
                pass
            return None
        comparison = ReplayComparison()
        numbers = {id(run): number for number, run in enumerate(out.runs, 1)}
        for live, share in shares(counted(), [run for run in out.runs if run.repeatable]):
            number = numbers[id(live)]
            found = compare(results(share, live, number), live, out.missing)
            comparison.add(found, f'run {number}, ' if len(out.runs) > 1 else '')
    for number, run in enumerate(out.runs, 1):
        if not run.repeatable:
            comparison.unrepeatable += [
                f'run {number}, window {window}: not estimated: the EstimatorSetup of its run is '
                'not in the bag'
                for window in sorted(run.posteriors)
            ]
    return comparison


def _usable_seconds(block: Block) -> float:
    try:
        return len(block) * check_block(block).period
    except InputError:
        return 0.0  # told by the estimator


def _window(r: WindowResult, tracking: bool, run: int) -> WindowEstimate:
    assert r.moments is not None and r.rhat is not None and r.ess is not None
    record, m = r.window.record, r.moments
    columns = (m.mean, m.stddev, m.skewness, m.cov, r.rhat, r.ess)
    return WindowEstimate(
        window=r.window.number,
        index=record.first_index,
        samples=len(record),
        end_s=(record.first_index + len(record)) * record.period,
        parameters={
            name: WindowParameter(*(float(values[i]) for values in columns))
            for i, name in enumerate(r.model.names)
        },
        evaluations=r.evaluations,
        converged=r.converged,
        error=WindowError(float(r.rms_error), float(r.nrmse)),
        bands=tuple(
            ScoredBand(
                p.kind,
                p.index,
                tuple(map(float, p.band.levels)),
                tuple(map(float, () if p.coverage is None else p.coverage)),
                tuple(map(float, p.width)),
            )
            for p in r.scored
        ),
        tracking=window_tracking(r) if tracking else None,
        explanations=tuple(map(_explanation, r.structures, r.weights, r.parts)),
        run=run,
    )


def _explanation(
    effects: tuple[str, ...], weight: float, part: tuple[ModelChoice, Moments] | None
) -> WindowExplanation:
    name = structure_name(effects)
    if part is None:
        return WindowExplanation(name, float(weight), {}, {})
    model, found = part
    mean, stddev = (
        dict(zip(model.names, map(float, of), strict=True)) for of in (found.mean, found.stddev)
    )
    return WindowExplanation(name, float(weight), mean, stddev)
