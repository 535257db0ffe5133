"""The prior of each window, from earlier samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.prior_conflict import Conflict, SequentialTest
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Contradicted, Window

# Most posteriors kept until windows no longer overlap theirs, whatever the settings.
_MOST = 1000


@dataclass(frozen=True, slots=True)
class Known:
    """A posterior, and the time of its middle and of its last sample [ns].

    If a gain drifts, the posterior is that of a record which begins at the middle.
    """

    carried: Carried
    middle_ns: int
    last_ns: int

    def to_json(self) -> dict[str, Any]:
        """Return a JSON object from which `from_json` makes the same bits."""
        times = {'middle_ns': self.middle_ns, 'last_ns': self.last_ns}
        return {'carried': self.carried.to_json(), **times}

    @staticmethod
    def from_json(value: Any, source: str = '') -> Known:
        """Return what `to_json` wrote.

        Raises:
            InputError: it is no such object.
        """
        try:
            carried = Carried.from_json(value['carried'], source)
            return Known(carried, int(value['middle_ns']), int(value['last_ns']))
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f'{source}: what is known cannot be read ({error})') from error


class Knowledge:
    """Priors for windows, from a calibration and from the windows before; bounded.

    A window's samples are counted from `settle` on. Its sequential prior is the posterior of the
    newest window that ended before that, drifted by the time between their middles: each
    sample is counted once along the chain of windows that led there. It belongs to one model:
    posteriors of another model come from a model that was found wanting.

    Stamps tell which windows share samples only while the clock goes on; where it goes back the
    stream begins another segment, which shares none with those before. Posteriors from before
    that seem later than its windows, and are no prior of them.

    Args:
        settings: of the estimator; `prior` says which prior is wanted.
        carried: draws of the calibration, where there is one.
        handed: posterior that came with the model's proposal: the prior of windows whose samples
            it has not seen.
        began_ns: acquisition time of the stream's first counted sample [ns], where it has begun.
    """

    def __init__(
        self,
        settings: EstimatorSettings,
        carried: Carried | None,
        handed: Known | None = None,
        began_ns: int | None = None,
    ) -> None:
        self._settings = settings
        self._given = carried if settings.prior != 'box' else None
        self._first = self._given
        self._drift = settings.drifts()
        self.began_ns = began_ns
        self._learned: list[Known] = [] if handed is None else [handed]
        # Windows that share samples with the handed posterior do not begin with it.
        self._from_ns = 0 if handed is None else handed.last_ns + 1
        self._epoch: int | None = None
        self._segment: int | None = None
        # The last sample of the newest window taken, and of the newest one tested.
        self._taken_ns: int | None = None
        self._tested_ns: int | None = None
        independent = 3600.0 / max(settings.window - settings.settle, settings.hop)
        self._test = SequentialTest(independent, settings.false_alarms)

    def formed(self, window: Window) -> None:
        """Note where the stream begins: with its first window, estimated or not."""
        if self.began_ns is None:
            self.began_ns = self._times(window)[0]

    def prior(self, window: Window) -> Carried | None:
        """Return the prior of a window; None for the box alone."""
        if self._settings.prior == 'box':
            return None
        if self._epoch != window.epoch:
            if self._epoch is not None:  # another actuator
                self._first, self._learned, self._tested_ns = self._given, [], None
                self._test.restart()
            self._epoch = window.epoch
        start, middle, _ = self._times(window)
        before = [one for one in self._learned if one.last_ns < start]
        if before:
            self._learned = self._learned[self._learned.index(before[-1]) :]
            known = before[-1]
            drifted = known.carried.drifted(self._drift, (middle - known.middle_ns) * 1e-9)
            return drifted.later((window.record.start_ns - known.middle_ns) * 1e-9)
        if self._first is None:
            return None
        began = start if self.began_ns is None else self.began_ns
        elapsed = (middle - began) * 1e-9
        return self._first.drifted(self._drift, self._settings.prior_age + elapsed)

    def learn(
        self, window: Window, posterior: Carried | None, found: Conflict | None
    ) -> list[Contradicted]:
        """Take a window's posterior, and how far it contradicts the window's prior."""
        start, middle, last = self._times(window)
        if self._segment != window.segment:
            # No sample of another segment: only a clock that went back can make it seem so.
            self._segment, self._tested_ns = window.segment, None
            if self._taken_ns is not None and start < self._taken_ns:
                self._from_ns = 0
        self._taken_ns = last
        wanted = self._settings.prior == 'sequential' and start >= self._from_ns
        if wanted and posterior is not None:
            there = posterior.later((middle - window.record.start_ns) * 1e-9)
            self._learned.append(Known(there, middle, last))
            del self._learned[:-_MOST]
        # Windows that share samples share their errors: only separate ones are counted.
        if found is None or (self._tested_ns is not None and start <= self._tested_ns):
            return []
        self._tested_ns = last
        if not self._test.add(found.p_value, window.record.first_index):
            return []
        self._test.restart()
        return [self._contradicted(window, found)]

    def _contradicted(self, window: Window, found: Conflict) -> Contradicted:
        answer = self._settings.contradiction
        factor = max(found.square / max(found.directions, 1), 1.0)
        if answer == 'restart':
            self._first, self._learned = None, []
        elif answer == 'widen':
            if self._first is not None:
                self._first = self._first.widened(factor)
            self._learned = [
                Known(one.carried.widened(factor), one.middle_ns, one.last_ns)
                for one in self._learned
            ]
        what = {
            'widen': f'its variance is now {factor:.3g} times as large',
            'restart': 'estimation begins again from the box',
            'alarm': 'it is used all the same',
        }[answer]
        return Contradicted(
            window.number,
            self._test.since,
            found.p_value,
            f'window {window.number} contradicts what was known of the parameters (p = '
            f'{found.p_value:.2g}; since sample {self._test.since}): {what}',
        )

    def _times(self, window: Window) -> tuple[int, int, int]:
        """Return the stamps of the first counted, the middle and the last sample [ns]."""
        record = window.record
        settled = round(self._settings.settle / record.period)
        start, last = record.stamp_ns(settled), record.stamp_ns(len(record) - 1)
        return start, (start + last) // 2, last
