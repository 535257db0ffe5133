"""The samples a diagnosis fits: records with a mask of counted samples, simulated in one go."""

from __future__ import annotations

import bisect
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.least_squares.base_prior import BasePrior
from actuator_glue.inference.least_squares.decimate import decimated
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.free_run import Model, ObservedChannel, parts
from actuator_glue.model.effects.run import sample_steps, turning
from actuator_glue.model.exact import Initial
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Hold, Record

SETTLE = 1.0  # s in which an unknown initial state is forgotten

Mask = NDArray[np.bool_]

# Numbers of a block that is worked on at a time, unless that is fewer rows than `LANES`.
_BLOCK = 1 << 21
LANES = 32  # parameter sets of the kernels, which take as long for fewer
# A record that is simulated finer has so many times its samples at most, and so many in all.
_FINER, _LONGEST = 8, 600_000


def chunks(rows: int, columns: int, block: int = _BLOCK, least: int = LANES) -> Iterator[slice]:
    """Yield slices of rows, of so few that their columns stay within a block.

    Args:
        rows: of a table.
        columns: of it.
        block: numbers that are held at a time.
        least: rows of a slice, of which all others are multiples.
    """
    size = max(1, block // max(columns, 1) // least) * least
    for begin in range(0, rows, size):
        yield slice(begin, begin + size)


def lanes(rows: int) -> Iterator[slice]:
    """Return slices of as many rows as the kernels work on at once."""
    return chunks(rows, _BLOCK)


def _times(whole: Record, period: float, most: int = 1) -> int:
    """Return how many simulated samples are averaged into one: the kernel's steps, or `most`."""
    count = round(period / whole.period)
    divisors = [k for k in range(1, count + 1) if count % k == 0]
    steps = next((k for k in divisors if sample_steps(period / k) == 1), count)
    return max([steps, *(k for k in divisors if k <= most)])


def _stepped(record: Record, whole: Record) -> Record:
    """Return a decimated record with the kernel's steps as samples.

    Simulated from decimated samples, the piston sticks, slips or saturates at other moments: a
    linear actuator answers the same, but with friction of 300 N at 1 kHz the truth was hundreds of
    nats from the fit, outside of nearly every interval. With steps as samples a run takes as long.
    """
    count = round(record.period / whole.period)
    return decimated(whole, count // _times(whole, record.period))


@dataclass(frozen=True)
class Data:
    """Records and the samples of each that count.

    Attributes:
        records: the records, simulated whole.
        masks: per record, which samples count, (n,) bool.
        initials: per record, the state it starts from: 'rest' or 'measured'.
        recorded: the records at the rate they were sampled with; the same where that was kept.
        origins: per record, time of its first sample since the test began [s].
        prior: what was known of Eq. (2)'s parameters before; None for nothing.
        finer: whether records are simulated as they were sampled, or nearly, and decimated then.
        steps: the records with the kernel's steps as samples, where it takes several for one;
            empty to derive them from `recorded`.
        each: simulates the records, several at a time if it can.
    """

    records: tuple[Record, ...]
    masks: tuple[Mask, ...]
    initials: tuple[Initial, ...]
    recorded: tuple[Record, ...]
    origins: tuple[float, ...]
    prior: BasePrior | None = None
    finer: bool = False
    steps: tuple[Record, ...] = ()
    each: Each = map

    def __post_init__(self) -> None:
        if not self.steps:
            pairs = zip(self.records, self.recorded, strict=True)
            steps = tuple(_stepped(record, whole) for record, whole in pairs)
            object.__setattr__(self, 'steps', steps)

    @classmethod
    def whole(cls, records: Sequence[Record]) -> Data:
        """Count all samples; every record starts from rest."""
        ones = tuple(np.ones(len(r), dtype=np.bool_) for r in records)
        initials: list[Initial] = ['rest' for _ in ones]
        return cls(tuple(records), ones, tuple(initials), tuple(records), (0.0,) * len(ones))

    @cached_property
    def periods(self) -> tuple[float, ...]:
        """Time between samples of each record [s]."""
        return tuple(r.period for r in self.records)

    @property
    def duration(self) -> float:
        """Duration of the longest record [s]."""
        return max(r.duration for r in self.records)

    @cached_property
    def factors(self) -> tuple[int, ...]:
        """How many recorded samples became one of each record."""
        pairs = zip(self.records, self.recorded, strict=True)
        return tuple(round(r.period / whole.period) for r, whole in pairs)

    @property
    def as_recorded(self) -> Data:
        """The same stretches at the rate they were sampled with."""
        masks = [
            np.repeat(mask, count)[: len(record)]
            for record, mask, count in zip(self.recorded, self.masks, self.factors, strict=True)
        ]
        return replace(self, records=self.recorded, masks=tuple(masks))

    def with_setup(
        self, *, stiffness: Sequence[float] | None = None, hold: Hold | None = None
    ) -> Data:
        """Return the same samples under another set-up.

        Args:
            stiffness: specimen stiffness of each record [N/m]; as they are if not given.
            hold: how the commands run between their samples; as they do if not given.
        """
        given = stiffness or [r.known_stiffness() for r in self.records]
        whole = tuple(
            replace(r, stiffness=k, hold=hold or r.hold)
            for r, k in zip(self.recorded, given, strict=True)
        )
        rows = zip(whole, self.factors, self.records, strict=True)
        records = tuple(replace(decimated(r, n), measured=d.measured) for r, n, d in rows)
        return replace(self, records=records, recorded=whole, steps=())

    @cached_property
    def times(self) -> tuple[Array, ...]:
        """Times of the counted samples of each record [s]."""
        return tuple(r.time[m] for r, m in zip(self.records, self.masks, strict=True))

    @cached_property
    def target(self) -> Array:
        """Measured displacement of the counted samples, records joined, (N,) [m]."""
        pairs = zip(self.records, self.masks, strict=True)
        return np.concatenate([record.measured[mask] for record, mask in pairs])

    @cached_property
    def parts(self) -> tuple[slice, ...]:
        """Where each record's counted samples lie in the joined vectors."""
        ends = np.cumsum([int(mask.sum()) for mask in self.masks])
        return tuple(
            slice(int(e) - int(m.sum()), int(e)) for e, m in zip(ends, self.masks, strict=True)
        )

    def velocity(self, motion: Array) -> Array:
        """Return the derivative of joined counted samples (N,) by time [1/s], run by run.

        Zero in runs of a single sample.
        """
        out = np.zeros_like(motion)
        for runs, period in zip(self.runs, self.periods, strict=True):
            for _, run in runs:
                if run.stop - run.start > 1:
                    out[run] = np.gradient(motion[run], period)
        return out

    @cached_property
    def runs(self) -> tuple[list[tuple[slice, slice]], ...]:
        """Where each record's counted samples lie, run by run, and where in the joined vectors.

        A few runs are copied several times as quickly as a mask is gone through.
        """
        out = []
        for mask, part in zip(self.masks, self.parts, strict=True):
            edges = np.flatnonzero(np.diff(mask, prepend=False, append=False)).reshape(-1, 2)
            ends = part.start + np.cumsum(edges[:, 1] - edges[:, 0])
            out.append(
                [
                    (slice(a, b), slice(end - (b - a), end))
                    for (a, b), end in zip(edges.tolist(), ends.tolist(), strict=True)
                ]
            )
        return tuple(out)

    def simulate(self, model: Model, theta: Array, each: Each | None = None) -> Array:
        """Simulate all records free-run and return the counted samples (m, N) [m].

        Args:
            model: what simulates them.
            theta: parameters, (m, p).
            each: simulates the records in place of `Data.each`.
        """
        table = np.atleast_2d(theta)
        out = np.empty((len(table), self.target.size))
        tests = self._repeats if isinstance(model, Structure) else self._singles
        for _ in (each or self.each)(lambda same: self._simulate(model, table, same, out), tests):
            pass
        return out

    def _simulate(self, model: Model, table: Array, same: list[int], out: Array) -> None:
        """Simulate records that share one motion into their columns of `out` (m, N).

        Few parameter sets at a time, for what is not simulated part by part: beyond some 20 MB
        the memory of a simulation goes back to the system each time, and asking for it anew costs
        time; but no fewer than the kernels work on at once.
        """
        i = same[0]
        record, count = self._runs_as(model, i)
        initial, origin = self.initials[i], self.origins[i]
        for some in chunks(len(table), len(record)):
            part = out[some]
            for which, at, y in parts(model, table[some], record, initial, origin, count):
                for j in same:
                    for run, to in self._overlaps(j, at, at + len(y)):
                        part[which, to] = y[run].T

    def _overlaps(self, i: int, begin: int, end: int) -> Iterator[tuple[slice, slice]]:
        """Yield where counted samples of a record's stretch lie in it, and in joined vectors."""
        runs = self.runs[i]
        first = bisect.bisect_right(runs, begin, key=lambda run: run[0].stop)
        for run, to in itertools.islice(runs, first, None):
            a, b = max(run.start, begin), min(run.stop, end)
            if a >= b:
                return
            shift = to.start - run.start
            yield slice(a - begin, b - begin), slice(a + shift, b + shift)

    def _runs_as(self, model: Model, i: int) -> tuple[Record, int]:
        """A record as a model simulates it, and how many of its samples are averaged into one."""
        record = self.records[i]
        if self.factors[i] == 1 or isinstance(record, ObservedChannel):
            return record, 1
        if not isinstance(model, Structure) or model.linear:
            return record, 1
        run = self._finer[i] if self.finer else self.steps[i]
        return run, round(record.period / run.period)

    @cached_property
    def _finer(self) -> tuple[Record, ...]:
        out = []
        rows = zip(self.records, self.recorded, self.factors, self.steps, strict=True)
        for record, whole, count, steps in rows:
            most = min(_FINER, _LONGEST // len(record))
            times = _times(whole, record.period, most)
            same = times == round(record.period / steps.period)
            out.append(steps if same else decimated(whole, count // times))
        return tuple(out)

    def simulated(self, model: Model) -> int:
        """How many samples a structure simulates of one parameter set."""
        return sum(map(len, self._as_simulated(model)))

    def sub_steps(self, model: Model) -> int:
        """How many sub-steps the kernels take over all records, however many sets at a time."""
        if not isinstance(model, Structure) or model.linear:
            return self.simulated(model)
        return sum(
            len(run) * sample_steps(run.period, turning(model.program, run.hold))
            for run in self._as_simulated(model)
        )

    def _as_simulated(self, model: Model) -> Iterator[Record]:
        return (self._runs_as(model, same[0])[0] for same in self._repeats)

    @property
    def _singles(self) -> list[list[int]]:
        return [[i] for i in range(len(self.records))]

    @cached_property
    def _repeats(self) -> list[list[int]]:
        """Records that a structure answers with the same motion: the same test, from rest."""
        out: list[list[int]] = []
        for i, record in enumerate(self.records):
            known = next((same for same in out if self._repeated(same[0], i)), None)
            if known is None or isinstance(record, ObservedChannel):
                out.append([i])
            else:
                known.append(i)
        return out

    def _repeated(self, i: int, j: int) -> bool:
        a, b = self.records[i], self.records[j]
        same = (a.period, a.stiffness, a.hold, self.initials[i], self.origins[i]) == (
            b.period, b.stiffness, b.hold, 'rest', self.origins[j]
        )  # fmt: skip
        return same and self.initials[j] == 'rest' and np.array_equal(a.command, b.command)

    def split(self, errors: Array) -> list[Array]:
        """Cut a joined vector (N,) back into records."""
        return [errors[part] for part in self.parts]
