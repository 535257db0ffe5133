"""Columns of a file that nobody has described yet: ranges, rates, what moves and what counts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import is_bag
from actuator_glue.io.bag_topics import Stamps, TopicSeries, topic_series
from actuator_glue.io.channel_map import Channel, ChannelMap
from actuator_glue.io.formats import Column, format_of, formats
from actuator_glue.io.laboratory import stated_period
from actuator_glue.io.signature import refuse_pipe
from actuator_glue.io.text_layout import SampleRows, text_layout
from actuator_glue.io.units import symbol, written_unit
from actuator_glue.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class ColumnLook:
    """What one column looks like.

    Attributes:
        name: as a channel map calls it.
        label: its name without the place where it lies.
        unit: what the file gives as its unit, beside the name or in it; empty where none is.
        values: shape (n,), unscaled.
        times: stamps of a topic's messages [s]; None in a file, where all rows are samples.
    """

    name: str | int
    label: str
    unit: str
    values: Array
    times: Array | None = None

    @property
    def steps(self) -> Array | None:
        """Steps of a column, or of a topic's stamps, that goes up all the time, shape (n - 1,)."""
        clock = self.times if self.times is not None else self.values
        steps: Array = np.diff(clock)
        ascends = len(steps) > 1 and np.isfinite(clock).all() and steps.min() > 0.0
        return steps if ascends else None

    @property
    def rate(self) -> float | None:
        """Messages per second of a topic, or rows per unit of a column that goes up evenly."""
        steps = self.steps
        if steps is None:
            return None
        typical = float(np.median(steps))
        if self.times is None and float(np.abs(steps - typical).max()) > typical:
            return None
        return len(steps) / float(steps.sum())

    @property
    def counts(self) -> bool:
        """Whether it is a running number of samples."""
        steps = np.diff(self.values)
        return len(steps) > 1 and bool((steps == 1.0).all())

    @property
    def missing(self) -> int:
        """How many of its values are no number."""
        return int(np.count_nonzero(~np.isfinite(self.values)))

    @property
    def moves(self) -> bool:
        """Whether it has numbers, and not always the same."""
        low, high = self.range()
        return self.missing < 0.1 * len(self.values) and low < high

    def range(self) -> tuple[float, float]:
        """Return the least and the greatest number; NaN where there is none."""
        finite = self.values[np.isfinite(self.values)]
        return (float(finite.min()), float(finite.max())) if len(finite) else (np.nan, np.nan)


@dataclass(frozen=True, slots=True)
class FileLook:
    """A file with all its columns of numbers.

    Attributes:
        path: the file or bag.
        columns: in the order of the file.
        layout: entries of a channel map that say how text is laid out.
        period: time between samples [s] where the file states one.
        what: kind of file, for people.
        blocks: of samples in a text, of which the longest is looked at.
    """

    path: Path
    columns: list[ColumnLook]
    layout: dict[str, object]
    period: float | None
    what: str
    blocks: tuple[SampleRows, ...] = ()


def look(path: Path | str) -> FileLook:
    """Return the columns of any file that can be read.

    Raises:
        InputError: it cannot be read, or holds no column of numbers.
    """
    path = Path(path)
    refuse_pipe(path)
    if is_bag(path):
        columns = [c for topic in topic_series(path).values() for c in _of_topic(topic)]
        found = FileLook(path, columns, {}, None, 'bag')
    else:
        if not path.is_file():
            raise InputError(f'{path}: there is no such file or bag')
        found = _file(path)
    if not found.columns:
        raise InputError(f'{path}: no column of numbers was found')
    return found


def _of_topic(topic: TopicSeries) -> list[ColumnLook]:
    stamped = min(topic.times['header']) > 0
    kind: Stamps = 'header' if stamped else 'published'
    times = topic.seconds(kind, topic.times[kind][0])
    alone = len(topic.columns) == 1
    return [
        ColumnLook(
            topic.topic if alone else f'{topic.topic}.{path}',
            f'{topic.topic} {path}',
            '',
            np.array(values),
            times,
        )
        for path, values in topic.columns.items()
    ]


def _file(path: Path) -> FileLook:
    chosen = format_of(path)
    layout: dict[str, Any] = {}
    channels, places = None, None
    blocks: list[SampleRows] = []
    if chosen is formats()['.csv']:
        layout, places, blocks = text_layout(path)
        # With times comments among the rows are passed over; without, the layout ends there.
        unknown = ChannelMap(Channel(1, 'm'), Channel(2, 'm'), time=Channel(1, 's'))
        channels = replace(unknown, **layout)
    table = chosen.read(path, channels)
    columns = table.columns
    if places is None:
        places = list(range(len(columns)))
    # Names may be fewer than columns, or none at all.
    named = [columns[i] if i < len(columns) else Column('', '') for i in places]
    names = [column.name for column in columns]
    looks = [
        ColumnLook(
            c.name if c.name and names.count(c.name) == 1 else i + 1,
            c.label,
            symbol(c.unit) or written_unit(c.label),
            v,
        )
        for c, i, v in zip(named, places, table.values(places), strict=True)
        if len(v) > 1
    ]
    return FileLook(path, looks, layout, stated_period(table), chosen.name, tuple(blocks))
