"""Previewed commands, windows of samples, and the events that an estimator reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from actuator_glue.errors import InputError
from actuator_glue.records import Array, Record

_PLAIN, _BESIDE = 'Eq. (2)', ' + '
Reason: TypeAlias = Literal['gap', 'stream', 'clock', 'setup', 'bad-input']


@dataclass(frozen=True, slots=True, eq=False)
class Preview:
    """Commands that will be acted on: sample i of `command` gets running index `index` + i."""

    index: int
    period: float
    command: Array


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """Samples that are fitted together.

    Attributes:
        number: running number, dropped windows counted.
        record: the samples, those in which the initial state decays included.
        epoch: counts the actuators; a posterior of one says nothing about the next.
        segment: counts the restarts; samples of one segment are contiguous.
        recent: the record, preceded by earlier samples of the last two hops if it is shorter: all
            samples that judge the forecast of the window two hops before.
        stretch: samples that show whether the channels can be what they are said to be, with their
            force; None of most windows, so that no sample is in two of them.
    """

    number: int
    record: Record
    epoch: int
    segment: int
    recent: Record
    stretch: Record | None = None

    @property
    def end(self) -> int:
        """Running index one past the last sample."""
        return self.record.first_index + len(self.record)


@dataclass(frozen=True, slots=True)
class Restarted:
    """The window begins anew at a sample, for a reason."""

    index: int
    reason: Reason
    message: str


@dataclass(frozen=True, slots=True)
class Rejected:
    """Input that was not used."""

    message: str


@dataclass(frozen=True, slots=True)
class Dropped:
    """A window that was not computed because those before it took too long."""

    number: int
    index: int


@dataclass(frozen=True, slots=True)
class Failed:
    """A window that gave no posterior, and why."""

    number: int
    index: int
    message: str


@dataclass(frozen=True, slots=True)
class Contradicted:
    """Samples contradict what was known of the parameters.

    Attributes:
        number: window that gave the alarm.
        since: running index from which on samples contradict.
        p_value: prior predictive p-value of that window.
        message: for people.
    """

    number: int
    since: int
    p_value: float
    message: str


@dataclass(frozen=True, slots=True)
class Reweighed:
    """Another structure has become the likeliest, or some have left.

    Attributes:
        number: window whose samples decided it.
        index: running index one past its last sample.
        weights: effects of each structure that is carried, and its weight, the likeliest first.
        left: effects of those that left.
        message: for people.
        worse: the likeliest has left because it made forecasts worse.
        stamp_ns: acquisition time of the last sample that decided it [ns].
    """

    number: int
    index: int
    weights: tuple[tuple[tuple[str, ...], float], ...]
    left: tuple[tuple[str, ...], ...]
    message: str
    worse: bool = False
    stamp_ns: int = 0


def structure_name(effects: Sequence[str]) -> str:
    """Return the name of a structure, made of its effects."""
    return _BESIDE.join(effects) or _PLAIN


def structure_effects(name: str) -> tuple[str, ...]:
    """Return the effects in a structure's name."""
    return () if name == _PLAIN else tuple(name.split(_BESIDE))


def structure_weights(posterior: Any) -> list[tuple[str, float]]:
    """Return name and weight of each structure of a PosteriorMoments; older ones know of one.

    Raises:
        InputError: not as many weights as structures.
    """
    names = list(getattr(posterior, 'structures', ())) or [structure_name(posterior.effects)]
    shares = list(getattr(posterior, 'weights', ())) or [1.0]
    if len(names) != len(shares):
        raise InputError(
            f'posterior of window {posterior.window}: {len(shares)} weights of {len(names)} '
            'structures; whoever publishes it must give each structure its weight'
        )
    return [(str(name), float(share)) for name, share in zip(names, shares, strict=True)]


Event: TypeAlias = Restarted | Rejected | Dropped | Failed | Contradicted | Reweighed
