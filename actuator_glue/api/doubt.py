"""Doubts about a diagnosis that explained everything: what its own numbers say against it."""

from __future__ import annotations

from collections.abc import Sequence

from actuator_glue.diagnosis.telling.result import DiagnosisData
from actuator_glue.diagnosis.verdict.rules import excused
from actuator_glue.hygiene.suspicions import suspicions
from actuator_glue.hygiene.unlike_rest import unlike_rest
from actuator_glue.inference.convergence import APART
from actuator_glue.records import Record

# Share of the held-out samples in the 95 % band below which that is no 95 % band: a noise that is
# twice as large there still leaves 67 to 80 %.
COVERED = 0.8


def doubts(found: DiagnosisData, records: Sequence[Record]) -> tuple[str, ...]:
    """Return why the answer is not complete, a sentence each; none where nothing says so.

    Args:
        found: the diagnosis.
        records: all that it was asked about.
    """
    told = []
    inside = found.coverage[1]
    if inside < COVERED and not excused(found.error, found.alarm.threshold):
        told.append(
            f'{100.0 * inside:.0f} % of what was held out lies in the 95 % band: it is not as '
            'sure as it says, and intervals are too narrow'
        )
    if found.rhat > APART:
        told.append(
            f'no posterior was reached: chains have not met (R-hat {found.rhat:.3g}, above '
            f'{APART}); give more --effort, or another test'
        )
    return (*suspicions(records), *unlike_rest(records, found.error.noise_floor), *told)
