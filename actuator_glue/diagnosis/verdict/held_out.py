"""The held-out error before and after."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_glue.json_value import Json, json_fields, json_value


@dataclass(frozen=True, slots=True)
class HeldOutError:
    """Free-run simulation error on data that decided nothing, one look [m].

    Attributes:
        before: rms error of Eq. (2), refitted to the fitting part.
        before_ci: 95 % block-bootstrap interval of `before`.
        after: rms error with the found effects, everything refitted.
        after_ci: 95 % block-bootstrap interval of `after`.
        noise_floor: rms of what no function of the command can explain.
        removable_removed: share of (before^2 - floor^2) removed, 1 is all.
        removed_ci: 95 % block-bootstrap interval of `removable_removed`.
        sham: rms error with a sham effect of equal parameter count, as control.
        records: rms error before and after of each held-out record.
        after_without_zero: `after` without each held-out record's own zero: an offset and a drift
            in time, which no other record tells; None where it was not computed.
        zeros: rms error of each of `records` without its own zero.
        after_without_hum: `after` with the hum that was found regressed out of the held-out part
            (frequency known, phase not); None without hum.
        split: always 'held-out': the data were set aside.
        reached: the least rms error of parameters in the 95 % region of their posterior; None
            where it was not computed.
        reached_before: the same for Eq. (2) alone; computed where additions at their best fit
            remove nothing.
    """

    before: float
    before_ci: tuple[float, float]
    after: float
    after_ci: tuple[float, float]
    noise_floor: float
    removable_removed: float
    removed_ci: tuple[float, float]
    sham: float
    records: tuple[tuple[str, float, float], ...] = ()
    after_without_zero: float | None = None
    zeros: tuple[float, ...] = ()
    after_without_hum: float | None = None
    split: str = 'held-out'
    reached: float | None = None
    reached_before: float | None = None

    @property
    def least(self) -> float:
        """The least rms error with the best fit, likely parameters, or records' own zeros [m]."""
        ways = (self.after, self.reached, self.after_without_zero)
        return min(way for way in ways if way is not None)

    def to_json(self) -> Json:
        """Return the JSON object of the held-out error."""
        records = [{'source': s, 'before': b, 'after': a} for s, b, a in self.records]
        for row, left in zip(records, self.zeros, strict=False):
            row['after_without_zero'] = left
        out = {'unit': 'm', **json_fields(self), 'records': json_value(records)}
        del out['zeros']
        return out
