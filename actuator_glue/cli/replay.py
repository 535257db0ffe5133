"""Run the online estimator over a recorded bag; compare bit by bit with what it published live."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from actuator_glue.cli._output import add_json, note, progress, say, write_json
from actuator_glue.cli._parser import number
from actuator_glue.cli._records import add_reading, load
from actuator_glue.cli._windows import numbers, show
from actuator_glue.errors import InputError

if TYPE_CHECKING:
    from actuator_glue.io.bag_reader import Summary
    from actuator_glue.online.job import WindowResult
    from actuator_glue.online.published import Comparison, Published
    from actuator_glue.online.replay import Item
    from actuator_glue.online.settings import EstimatorSettings
    from actuator_glue.online.stream import Block

INPUTS = ('SampleBlock', 'TestSetup')
RESULTS = ('EstimatorSetup', 'PosteriorMoments', 'PredictionBand')
OVERRIDES = ('window', 'hop', 'settle', 'shaping_factor', 'evaluations', 'seed')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('bag', metavar='BAG', help='bag folder, .mcap, or a laboratory file')
    add_reading(parser)
    parser.add_argument(
        '--namespace', metavar='/NS', help='whose samples, where a bag has several actuators'
    )
    group = parser.add_argument_group(
        'settings', 'for what was not estimated live, or to estimate it differently'
    )
    group.add_argument('--window', type=number, metavar='S', help='length of a window')
    group.add_argument('--hop', type=number, metavar='S', help='time between windows')
    group.add_argument('--settle', type=number, metavar='S', help='uncounted start of a window')
    group.add_argument('--shaping-factor', type=number, metavar='G', help='G of Eq. (4)')
    group.add_argument('--evaluations', type=int, metavar='N', help='evaluations per window')
    group.add_argument('--seed', type=int, metavar='S', help='seed of the sampler')
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Replay; 1 where the bag holds a live estimate and the replay differs from it.

    Raises:
        InputError: the bag or a setting cannot be used.
    """
    from actuator_glue.io.bag_reader import is_bag, summarise
    from actuator_glue.online.published import published

    live: Published | None = None
    asked = {n: v for n in OVERRIDES if (v := getattr(args, n)) is not None}
    total = 0
    if is_bag(args.bag) and args.stiffness is None and args.hold is None:
        summary = summarise(args.bag)
        topics = _topics(summary, args)
        total = sum(t.count for t in summary.topics.values() if t.name in topics)
        if not asked and any(t.type.endswith('PosteriorMoments') for t in _of(summary, topics)):
            live = published(_messages(args.bag, RESULTS, topics))
        items = _bag_items(args.bag, topics)
    else:
        items = _record_items(args)
    if live is not None and (live.settings is None or not live.models):
        note('the bag has posteriors but no EstimatorSetup: there is nothing to compare with')
        live = None
    started = time.perf_counter()
    settings = _settings(live, asked)
    windows, events, comparison, seconds_of_data = _replay(items, live, settings, total)
    seconds = time.perf_counter() - started
    show(windows, args)
    for line in list(dict.fromkeys(events))[:20]:
        note(line)
    if not windows:
        raise InputError(f'{args.bag}: not one window could be estimated')
    _verdict(comparison, args)
    rate = seconds_of_data / seconds if seconds > 0.0 else 0.0
    say(
        f'{len(windows)} windows over {seconds_of_data:.1f} s of data in {seconds:.2f} s '
        f'({rate:.0f} x real time)',
        args,
    )
    write_json(_content(args, settings, windows, events, comparison, seconds, rate), args.json)
    return 0 if comparison is None or comparison.identical else 1


def _topics(summary: Summary, args: argparse.Namespace) -> list[str]:
    """Return the topics of one actuator; all of them where the bag has only one."""
    samples = [t.name for t in summary.topics.values() if t.type.endswith('/SampleBlock')]
    spaces = [name.rpartition('/')[0] for name in samples]
    if args.namespace is not None:
        wanted = '/' + args.namespace.strip('/') if args.namespace.strip('/') else ''
        if wanted not in spaces:
            raise InputError(
                f'{args.bag}: no samples under {args.namespace!r}; there are samples under '
                f'{", ".join(s or "/" for s in spaces) or "nothing"}'
            )
    elif len(samples) > 1:
        raise InputError(
            f'{args.bag}: samples of {len(samples)} actuators ({", ".join(samples)}); choose one '
            'with --namespace'
        )
    else:
        wanted = spaces[0] if spaces else ''
    return [t for t in summary.topics if t.rpartition('/')[0] == wanted]


def _of(summary: Summary, topics: list[str]) -> list[Any]:
    return [t for t in summary.topics.values() if t.name in topics and t.count]


def _messages(bag: str, names: tuple[str, ...], topics: list[str]) -> Iterator[tuple[str, Any]]:
    from actuator_glue.io.bag_reader import decoded

    return decoded(bag, names, topics=topics)


def _bag_items(bag: str, topics: list[str]) -> Iterator[Item]:
    from actuator_glue.online.replay import items
    from actuator_glue.online.stream import Rejected

    rejected: list[Rejected] = []
    for item in items(_messages(bag, INPUTS, topics), rejected):
        while rejected:
            note(rejected.pop().message)
        yield item


def _record_items(args: argparse.Namespace) -> Iterator[Item]:
    from actuator_glue.online.replay import stream

    args.records = [args.bag]
    for record in load(args):
        record.known_stiffness()
        yield from stream(record)


def _settings(live: Published | None, asked: dict[str, Any]) -> EstimatorSettings:
    from actuator_glue.online.settings import EstimatorSettings

    if live is not None and live.settings is not None:
        return live.settings
    # No clock runs here, so a budget of time says nothing; it must only fit the hop.
    if 'hop' in asked:
        asked = {**asked, 'time_budget': min(0.5, asked['hop'])}
    return EstimatorSettings.from_mapping(asked, 'options')


def _replay(
    items: Iterator[Item], live: Published | None, settings: EstimatorSettings, total: int
) -> tuple[list[dict[str, Any]], list[str], Comparison | None, float]:
    """Return what is told of each window, what happened besides, the verdict, seconds of data."""
    from actuator_glue.online.job import WindowResult
    from actuator_glue.online.published import compare
    from actuator_glue.online.replay import replay
    from actuator_glue.online.stream import Block
    from actuator_glue.workers.reports import Reports

    windows: list[dict[str, Any]] = []
    events: list[str] = []
    seconds = 0.0
    # Without a live run to hold them against, nobody sees the limits of bands.
    with progress('replaying', total or 1) as done, Reports(limits=live is not None) as reports:

        def counted() -> Iterator[Item]:
            nonlocal seconds
            for place, item in enumerate(items):
                if isinstance(item, Block):
                    seconds += _usable_seconds(item)
                done(place if total else 0)
                yield item

        def results() -> Iterator[WindowResult]:
            model = live.models[0][1] if live is not None else None
            schedule = live.schedule() if live is not None else None
            for told in replay(counted(), settings, model, schedule, reports):
                if isinstance(told, WindowResult):
                    # Not the result itself: its samples and bands are many.
                    windows.append(numbers(told))
                    yield told
                else:
                    events.append(getattr(told, 'message', str(told)))

        found = results()
        comparison = None if live is None else compare(found, live)
        for _ in found:  # all of them, where nothing was compared
            pass
    return windows, events, comparison, seconds


def _usable_seconds(block: Block) -> float:
    from actuator_glue.online.stream import check_block

    try:
        return len(block) * check_block(block).period
    except InputError:
        return 0.0  # told by the estimator


def _verdict(comparison: Comparison | None, args: argparse.Namespace) -> None:
    if comparison is None:
        say('nothing published live with these settings: nothing to compare with', args)
        return
    verdict = 'identical, bit for bit' if comparison.identical else 'NOT identical'
    say(
        f'replay against live: {verdict} ({comparison.windows} posteriors, '
        f'{comparison.bands} bands)',
        args,
    )
    for line in comparison.differing[:10]:
        say(f'  {line}', args)


def _content(
    args: argparse.Namespace,
    settings: EstimatorSettings,
    windows: list[dict[str, Any]],
    events: list[str],
    comparison: Comparison | None,
    seconds: float,
    rate: float,
) -> dict[str, Any]:
    return {
        'schema': 'actuator_glue.replay/1',
        'bag': str(args.bag),
        'settings': {name: getattr(settings, name) for name in OVERRIDES},
        'identical': None if comparison is None else comparison.identical,
        'compared': None
        if comparison is None
        else {
            'posteriors': comparison.windows,
            'bands': comparison.bands,
            'differing': comparison.differing,
        },
        'windows': windows,
        'events': events,
        'seconds': seconds,
        'times_real_time': rate,
    }
