"""Results that a live estimator put into a bag, compared with replayed ones, bit by bit."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping
from copy import copy
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.online import conversion
from actuator_glue.online.job import WindowResult
from actuator_glue.online.schedule import Begun, ReplayPosition, Schedule
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.structures import Proposal
from actuator_glue.online.window_posterior import ARCHIVE, joined
from actuator_glue.records import Array, check_period
from actuator_glue.sample_block import stamp_ns

_THINNED = 200  # draws in a message, however many the next window began with


@dataclass(slots=True)
class Published:
    """What one run of a live estimator put into a bag.

    An estimator that is activated again, or started again, begins a run: its windows are numbered
    from 0 and it knows nothing of those before.

    Attributes:
        settings: its settings; None where the bag has no EstimatorSetup of the run.
        models: what is carried from each window number on.
        carried: draws that its priors began with; None where they began from the box.
        posteriors: PosteriorMoments by window number.
        draws: points that each window ended with, by its number, with their names.
        scored: scored PredictionBands by window number, index and kind, shortened by `_brief`: a
            long bag's bands do not fit into memory.
        until: number of sample blocks recorded before its last result; the next run has had none
            of them.
        later: samples stand before it in the bag: another run's, or none's.
    """

    settings: EstimatorSettings | None = None
    models: list[tuple[int, ModelChoice | Proposal]] = field(default_factory=list)
    carried: Carried | None = None
    posteriors: dict[int, Any] = field(default_factory=dict)
    draws: dict[int, tuple[tuple[str, ...], Array]] = field(default_factory=dict)
    scored: dict[tuple[int, int, str], Any] = field(default_factory=dict)
    until: int = 0
    later: bool = False

    @property
    def repeatable(self) -> bool:
        """Whether it has posteriors, and the bag says with which settings and model."""
        return bool(self.posteriors and self.models) and self.settings is not None

    @property
    def stop(self) -> int:
        """Running index behind the last sample that a posterior is of."""
        last = self.posteriors[max(self.posteriors)]
        return int(last.index) + int(last.samples)

    @property
    def span(self) -> str:
        """Its first and last window, for people."""
        return f'windows {min(self.posteriors)} to {max(self.posteriors)}'

    def take(self, late: Published) -> None:
        """Take results that were recorded after the next run's setup."""
        self.posteriors |= late.posteriors
        self.draws |= late.draws
        self.scored |= late.scored
        self.until = late.until

    def schedule(self) -> Schedule | None:
        """What was dropped and stopped early; None where nothing was published."""
        if not self.posteriors:
            return None
        done = {
            (int(message.index), _start_ns(message)): (number, _spent(message))
            for number, message in self.posteriors.items()
        }
        models = tuple(sorted(self.models, key=lambda m: m[0]))
        return Schedule(done, models, self.begun(), self._formed_ns() if self.later else None)

    def _formed_ns(self) -> int | None:
        """Return when window 0 began, unless a gap broke windows before the first posterior."""
        if self.settings is None:
            return None
        number = min(self.posteriors)
        hop = self.settings.hop
        # Half a hop less: stamps are rounded.
        return _start_ns(self.posteriors[number]) - round((number + 0.5) * hop * 1e9)

    def begun(self) -> dict[int, Begun]:
        """Return where each window began, by its number: where the one before it ended."""
        found: dict[int, Begun] = {}
        numbers = sorted(self.posteriors)
        first = self.posteriors[numbers[0]] if numbers else None
        usual = self.settings.evaluations if self.settings is not None else 0
        if first is not None and first.window > 0 and first.evaluations <= usual:
            # It had points to start from: the window before it was not recorded.
            found[numbers[0]] = Begun(int(first.window) - 1, None, False)
        for before, number in pairwise(numbers):
            ended, begins = self.posteriors[before], self.posteriors[number]
            if ended.header.frame_id != begins.header.frame_id:
                continue  # a posterior of one actuator says nothing about the next
            names, archive = self.draws.get(before, ((), None))
            # All points that the window gave, unless an older version thinned them.
            whole = archive is not None and len(archive) != _THINNED
            older = found.get(before)
            if archive is not None and len(archive) < ARCHIVE and older is not None:
                # A window that was cut short hands on points of the window before it, too.
                whole = whole and older.whole
                archive = archive if older.archive is None else joined(archive, older.archive)
            if len(spent := _spent(begins)) > 1 or tuple(begins.parameter_names) != names:
                whole = (
                    False  # of less likely structures, and of another model, no points are kept
                )
                archive = archive if len(spent) == 1 else None
            if getattr(self.settings, 'prior', 'box') != 'box':
                whole = False  # the window's prior is not kept either
            found[number] = Begun(before, archive, whole)
        return found


def published(messages: Iterable[tuple[str, Any]]) -> list[Published]:
    """Collect what a live estimator published from (type name, message) pairs, run by run.

    Args:
        messages: as a bag holds them; of a SampleBlock only the place counts.

    Returns:
        The runs in order, one where nothing was published; those without a posterior are left
        out where there are others.

    Raises:
        InputError: impossible settings, model or posterior.
    """
    runs, blocks = [Published()], 0
    for name, message in messages:
        kind, now = name.rpartition('/')[2], runs[-1]
        if kind == 'SampleBlock':
            blocks += 1
        elif kind == 'EstimatorSetup':
            if _begins(message, now):
                runs.append(now := Published(later=True))
            if now.settings is None:
                # The recorder may have started before the estimator.
                now.later = now.later or blocks > 0
            now.settings = conversion.estimator_settings(message)
            now.carried = conversion.carried(message)
            now.models.append((int(message.window), conversion.proposal(message)))
        elif kind == 'PosteriorMoments':
            check_period(message.period, f'posterior of window {message.window}')
            if now.posteriors and int(message.window) <= max(now.posteriors):
                now = _another(runs)
            now.posteriors[int(message.window)] = message
            now.until = blocks
        elif kind == 'PosteriorDraws' and len(message.parameter_names):
            names = tuple(message.parameter_names)
            values = np.asarray(message.values, dtype=np.float64)
            now.draws[int(message.window)] = names, values.reshape(-1, len(names))
        elif kind == 'PredictionBand' and message.scored:
            key = (int(message.window), int(message.index), str(message.kind))
            now.scored[key] = _brief(message)
    return [run for run in runs if run.posteriors] or runs[-1:]


def _begins(setup: Any, now: Published) -> bool:
    """Whether an EstimatorSetup is of another run than the one collected now."""
    if now.settings is None or int(setup.window) != 0:
        return False
    # A model that was asked for before the first window is announced with the window's actuator;
    # what an activation announces has none yet.
    return bool(now.posteriors) or not setup.header.frame_id


def _another(runs: list[Published]) -> Published:
    """Return the run of a posterior whose number is not above those of the last run."""
    now, before = runs[-1], runs[-2] if len(runs) > 1 else None
    if before is not None and before.posteriors and max(before.posteriors) < min(now.posteriors):
        # A recorder may take the setup of a run before the last results of the one before it.
        before.take(now)
        runs[-1] = Published(now.settings, now.models, now.carried, later=True)
    else:
        runs.append(Published(later=True))  # its EstimatorSetup is not in the bag
    return runs[-1]


def _start_ns(message: Any) -> int:
    """Return the acquisition time of the first sample that a PosteriorMoments is of [ns]."""
    length = round((int(message.samples) - 1) * float(message.period) * 1e9)
    return int(stamp_ns(message.header)) - length


def _spent(message: Any) -> tuple[int, ...]:
    """Return the evaluations of each structure of a PosteriorMoments, the likeliest first."""
    # Older bags know of one structure only.
    spent = tuple(int(count) for count in getattr(message, 'structure_evaluations', ()))
    return spent or (int(message.evaluations),)


@dataclass(slots=True)
class ReplayComparison:
    """Replayed numbers compared with the published ones, bit by bit.

    Attributes:
        windows: posteriors compared.
        bands: scored bands compared.
        differing: one line per window or band that differs or is missing.
        unrepeatable: one line per window whose inputs are not all in the bag.
    """

    windows: int = 0
    bands: int = 0
    differing: list[str] = field(default_factory=list)
    unrepeatable: list[str] = field(default_factory=list)

    @property
    def identical(self) -> bool | None:
        """Whether all repeatable windows are equal; None where no window is repeatable."""
        if not self.windows and self.unrepeatable and not self.differing:
            return None
        return self.windows > 0 and not self.differing

    def add(self, other: ReplayComparison, run: str = '') -> None:
        """Take in the comparison of another run; `run` names it before each line."""
        self.windows += other.windows
        self.bands += other.bands
        self.differing += [run + line for line in other.differing]
        self.unrepeatable += [run + line for line in other.unrepeatable]


def compare(
    results: Iterable[WindowResult],
    live: Published,
    held: Callable[[int, int], str] = lambda first, stop: '',
) -> ReplayComparison:
    """Compare replayed results with those published live.

    Args:
        results: of the replay, in order.
        live: what was published.
        held: describes the samples missing from one index up to another; empty for none. Called
            when all results have come.
    """
    found = ReplayComparison()
    begun, course, seen = live.begun(), ReplayPosition(), set[int]()
    for result in results:
        number = result.window.number
        course.resumes(begun.get(number))
        course.done(number)
        message = live.posteriors.get(number)
        seen.add(number)
        if message is None:
            found.differing.append(f'window {number}: not published live')
        elif not course.exact:
            found.unrepeatable.append(
                f'window {number}: estimated anew, not to the bit: it began where window '
                f'{begun[number].number} ended, of which the bag does not have all'
            )
        else:
            _hold(result, message, live, found)
    for number in sorted(set(live.posteriors) - seen):
        message = live.posteriors[number]
        first, stop = int(message.index), int(message.index) + int(message.samples)
        lacks = held(first, stop)
        lost = number in begun and begun[number].archive is None
        lines = found.unrepeatable if lacks or lost else found.differing
        lines.append(f'window {number}: {lacks or "not reproduced"}')
    return found


def _hold(result: WindowResult, message: Any, live: Published, found: ReplayComparison) -> None:
    """Compare one result with what was published of it."""
    number = result.window.number
    found.windows += 1
    names = differences(conversion.posterior(result, float('nan'))[1], message)
    if names:
        found.differing.append(f'window {number}: posterior differs in {", ".join(names)}')
    lacking = 0
    for prediction in result.scored:
        key = (prediction.number, prediction.index, prediction.kind)
        if key not in live.scored and number == max(live.posteriors):
            lacking += 1  # published after the posterior: the run may have been killed between
            continue
        if key not in live.scored:
            found.differing.append(f'window {number}: band {key} was not published live')
            continue
        found.bands += 1
        fields = conversion.prediction(prediction, '')[1]
        names = differences(fields, live.scored[key])
        if names:
            found.differing.append(f'band {key} differs in {", ".join(names)}')
    if lacking:
        found.unrepeatable.append(
            f'window {number}: {lacking} of its bands are not compared: the run, or the bag, '
            'ended before they were recorded'
        )


class _Digest(NamedTuple):
    """Stands for an array of numbers where only equality is asked for."""

    shape: tuple[int, ...]
    code: bytes


def _digest(values: Any) -> _Digest:
    numbers = np.asarray(values, np.float64)
    return _Digest(numbers.shape, hashlib.blake2b(numbers.tobytes(), digest_size=16).digest())


def _brief(band: Any) -> Any:
    """Return a small PredictionBand, its limits replaced by digests for `differences`."""
    small = copy(band)
    for name in ('lower', 'median', 'upper'):
        setattr(small, name, _digest(getattr(band, name)))
    return small


def differences(fields: Mapping[str, Any], message: Any) -> list[str]:
    """Return the names of the fields that differ from a message's in any bit.

    `seconds` is not compared: it is how long the computer took.
    """
    return [
        name
        for name, value in fields.items()
        if name != 'seconds' and not _same(value, getattr(message, name))
    ]


def _same(ours: Any, theirs: Any) -> bool:
    if isinstance(theirs, _Digest):
        return _digest(ours) == theirs
    if isinstance(ours, str | bool | int):
        return bool(ours == theirs)
    if isinstance(ours, list) and ours and isinstance(ours[0], str):
        return list(ours) == list(theirs)
    left, right = np.asarray(ours, np.float64), np.asarray(theirs, np.float64)
    return left.shape == right.shape and left.tobytes() == right.tobytes()
