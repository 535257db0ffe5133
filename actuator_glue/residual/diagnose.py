"""Decide whether Eq. (2) is enough for given records and, if not, which effect it lacks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from actuator_glue.records import Record
from actuator_glue.residual.diagnosis import Diagnosis

Progress = Callable[[str, float], None]


def diagnose(
    records: Sequence[Record],
    holdout: Sequence[Record] | Record | None = None,
    *,
    seed: int = 0,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnose records whose specimen stiffness is known.

    Args:
        records: fitting records of one actuator.
        holdout: record(s) that decide nothing and give the error before and after; without
            one, a quarter of each record is set aside in blocks before any look.
        seed: seed of every random step; the same seed gives the same diagnosis.
        jobs: worker threads for the refits of candidates.
        progress: called with (stage, share done in [0, 1]).

    Raises:
        InputError: stiffness not known, records too short, or nothing moves.
    """
    raise NotImplementedError
