"""What a diagnosis of a stream starts from: its records, and what was known before they began."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace

from actuator_glue.inference.carried import Carried, Drift
from actuator_glue.inference.choice import choose_model
from actuator_glue.inference.moments import moments
from actuator_glue.online.collect import Collector
from actuator_glue.online.knowledge import Known
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.records import Record


class Memory:
    """Prior knowledge of Eq. (2)'s parameters for records, from an estimator; bounded.

    Each sample counts once: the prior of records is the calibration that the estimator began
    with, or its posterior of windows that ended before the records begin. Without a calibration,
    only parameters that windows inform are kept: along the others the posterior is the box, whose
    mean is a statement about the bounds. An effect that informs such a parameter a little would be
    found with the size that goes with that mean.

    Attributes:
        settings: of the estimator; None before they are known.
    """

    def __init__(self) -> None:
        self.settings: EstimatorSettings | None = None
        self._carried: Carried | None = None
        self._began_ns: int | None = None
        self._known: deque[Known] = deque()

    def setup(self, settings: EstimatorSettings, carried: Carried | None) -> None:
        """Take what the estimator works with."""
        if settings != self.settings or carried != self._carried:
            self._known.clear()
        self.settings, self._carried = settings, carried

    def forget(self) -> None:
        """Drop the posteriors: they are of another actuator."""
        self._known.clear()
        self._began_ns = None

    def began(self, stamp_ns: int) -> None:
        """Note when the stream began [ns]."""
        if self._began_ns is None:
            self._began_ns = stamp_ns

    def learn(self, known: Known, first_ns: int | None) -> None:
        """Take a posterior that nothing speaks against.

        One that ends before the newest came after the clock went back: the others are of times
        that say no longer what was earlier, and are dropped.

        Args:
            known: the posterior.
            first_ns: when the records that are kept begin [ns]: of posteriors before that, only
                the newest can still be needed.
        """
        if self.settings is None or self.settings.prior != 'sequential':
            return
        if self._known and known.last_ns < self._known[-1].last_ns:
            self._known.clear()
        if self._known and known.last_ns < self._known[-1].last_ns + 1_000_000_000:
            return
        told = known.carried.names if self._carried is not None else _told(known.carried)
        if not told:
            return
        self._known.append(replace(known, carried=known.carried.only(told)))
        # Records that seem to begin after it are of before the clock went back.
        if first_ns is None or first_ns > known.last_ns:
            return
        while len(self._known) > 1 and self._known[1].last_ns < first_ns:
            self._known.popleft()

    def before(self, first_ns: int) -> tuple[Carried, Drift, float] | None:
        """Return the prior of records that begin at a time [ns].

        Returns:
            Draws that have drifted to that time, by how much they drift, and their age [s]; None
            where nothing was known.
        """
        if self.settings is None:
            return None
        drift = self.settings.drifts()
        earlier = [one for one in self._known if one.last_ns < first_ns]
        if earlier:
            known = earlier[-1]
            age = (first_ns - known.middle_ns) * 1e-9
            return known.carried.drifted(drift, age).later(age), drift, age
        if self._carried is None:
            return None
        since = 0 if self._began_ns is None else max(first_ns - self._began_ns, 0)
        age = self.settings.prior_age + since * 1e-9
        return self._carried.drifted(drift, age), drift, age


def _told(carried: Carried) -> tuple[str, ...]:
    """Return the parameters of Eq. (2) that draws fix more narrowly than the usual bounds do."""
    plain = choose_model()
    base = carried.only(plain.names)
    wide = moments(base.draws, *plain.bounds).prior_dominated
    return tuple(name for name, open_ in zip(plain.names, wide, strict=True) if not open_)


def looked_at(
    collector: Collector, memory: Memory, since: float
) -> tuple[list[Record], tuple[Carried, Drift, float] | None]:
    """Return the records to diagnose, and their prior as `Memory.before`.

    The records are those after `since` seconds of data; all where these are too short.
    """
    records = collector.records(since=since) or collector.records()
    return records, memory.before(earliest(records)) if records else None


def earliest(records: Sequence[Record]) -> int:
    """Return the time before which no sample of records was taken, whatever the clock did [ns].

    The first record need not have it: where the clock went back, those after it seem earlier, and
    a posterior that seems to precede the first may hold their samples.
    """
    return min(record.start_ns for record in records)
