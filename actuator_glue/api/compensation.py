"""Which compensator a hybrid test should use, and what it buys."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_glue.api.bar import shown
from actuator_glue.api.calibration_given import calibration_given
from actuator_glue.api.calibration_result import Calibration
from actuator_glue.api.given import seed_given
from actuator_glue.api.partition_given import partition_given
from actuator_glue.api.rths import DRAWS, rths
from actuator_glue.api.shown import Shown
from actuator_glue.api.stability import StabilityResult
from actuator_glue.api.tracking import FREQUENCIES
from actuator_glue.hybrid.compensator import KINDS
from actuator_glue.hybrid.ground_motion import GroundMotion
from actuator_glue.hybrid.partition import Partition

if TYPE_CHECKING:
    from actuator_glue.report import html

HEADER = ('compensator', 'P(unstable)', 'upper 95 %', 'J1 [ms]', 'J2 median', 'J2 at 95 %')


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Comparison(Shown):
    """The same hybrid test with every compensator.

    Attributes:
        found: one result for each kind, 'none' first.
        best: the one to use: smallest upper bound of P(unstable), then smallest 95th percentile
            of J2.
    """

    more = '`to_json()` has them'

    found: dict[str, StabilityResult]
    best: str

    def summary(self) -> str:
        """Return which to use and what it buys, in one line."""
        without, chosen = self.found['none'], self.found[self.best]
        if chosen.p_unstable.value > 0.5:
            return (
                'no compensator is likely to keep this test stable: the least P(unstable) is '
                f'{chosen.p_unstable.value:.3g}, with {self.best}'
            )
        if self.best == 'none':
            return 'use no compensator: none of them makes the test safer or closer'
        return (
            f'use {self.best}: J2 at the 95th percentile {_share(_worst(chosen))} instead of '
            f'{_share(_worst(without))}, P(unstable) {chosen.p_unstable.value:.3g} instead of '
            f'{without.p_unstable.value:.3g}'
        )

    def brief(self) -> list[html.Block]:
        """Return why the posterior must not be used, which compensator to use, and the table."""
        from actuator_glue.report import html

        return [
            *(html.Note(line) for line in self.found[self.best].problems),
            html.Text(self.summary()),
            html.Table(HEADER, self.rows(), 'Compensators'),
        ]

    def rows(self) -> list[tuple[str, ...]]:
        """Return a row of text for each compensator, under HEADER."""
        out: list[tuple[str, ...]] = []
        for kind, found in self.found.items():
            p, of = found.p_unstable, found.virtual.indicators if found.virtual else {}
            j1 = f'{1e3 * of["J1_s"].median:.2f}' if of else '-'
            j2 = _share(of['J2'].median) if of else '-'
            out.append((kind, f'{p.value:.3g}', f'{p.upper:.3g}', j1, j2, _share(_worst(found))))
        return out

    def to_json(self) -> dict[str, Any]:
        """Return what tells the compensators apart."""
        return {
            'use': self.best,
            'compensators': {
                kind: {
                    'p_unstable': found.to_json()['p_unstable'],
                    'J2': found.to_json()['indicators'].get('J2'),
                    'j2_percentile_95': _worst(found),
                }
                for kind, found in self.found.items()
            },
        }


def compare_compensators(
    partition: Partition | Path | str,
    calibration: Calibration | Path | str,
    ground_motion: GroundMotion | Path | str = 'artificial',
    *,
    draws: int = DRAWS,
    frequencies: Sequence[float] | float = FREQUENCIES,
    criteria: Mapping[str, float] | None = None,
    seed: int | None = 1,
    progress: Callable[[float], object] | bool | None = None,
) -> Comparison:
    """Return a hybrid test with every compensator, and which of them to use.

    Args:
        partition: as `rths` takes it.
        calibration: posterior of the actuator, or the file it was saved to.
        ground_motion: as `rths` takes it.
        draws: how many draws run the record with each.
        frequencies: where the actuator's delay and amplitude are told [Hz].
        criteria: peaks that must not be exceeded, as `rths` takes them.
        seed: of specimens and noise, the same for each; None for a fresh one.
        progress: called with the share that is done, in [0, 1]; True for a bar, False for none;
            None for a bar in a notebook only. A callback that fails is not called again.

    Raises:
        InputError: as `rths`.
    """
    seed, partition = seed_given(seed), partition_given(partition)
    calibration = calibration_given(calibration)
    found: dict[str, StabilityResult] = {}
    with shown('compensators', 1.0, progress) as done:
        for kind in KINDS:
            found[kind] = rths(
                partition,
                calibration,
                compensator=kind,
                ground_motion=ground_motion,
                draws=draws,
                frequencies=frequencies,
                criteria=criteria,
                seed=seed,
                progress=partial(_within, done, len(found)),
            )
            done(len(found) / len(KINDS))

    def rank(kind: str) -> tuple[float, float]:
        worst = _worst(found[kind])
        return found[kind].p_unstable.upper, float('inf') if worst is None else worst

    return Comparison(found, min(found, key=rank))


def _within(done: Callable[[float], object], before: int, share: float) -> None:
    """Tell the share of all compensators that is done, from that of one."""
    done((before + share) / len(KINDS))


def _worst(found: StabilityResult) -> float | None:
    return None if found.virtual is None else found.virtual.j2_percentile_95


def _share(value: float | None) -> str:
    return 'diverged' if value is None else f'{100.0 * value:.3g} %'
