"""What does not forbid to fit a record, and forbids to believe the result before it is checked."""

from __future__ import annotations

from collections.abc import Sequence

from actuator_glue.hygiene.checks import most_push, where
from actuator_glue.hygiene.slow_gain import slow_gain, told
from actuator_glue.records import Record

# Times a force must fall short of what the stated stiffness asks for, as where a force contradicts
# it: a specimen that yields is off by a factor of 2 or 3.
_SHORT = 5.0
# Amplitudes of slow motion that a specimen, leakage and a transducer's factor give together.
_LEAST, _MOST = 0.6, 1.6


def suspicions(records: Sequence[Record]) -> tuple[str, ...]:
    """Return a sentence on each record whose set-up is doubtful, and what to check.

    Where a free record follows slow motion all the way, the units are right: what less another
    follows against its specimen is leakage.

    Args:
        records: as they were measured, with the stiffness that was given.
    """
    out, gains = [], [slow_gain(r) for r in records]
    free = (g for r, g in zip(records, gains, strict=True) if g is not None and not r.stiffness)
    least = 0.0 if any(_LEAST < g < _MOST for g in free) else _LEAST
    for i, (record, gain) in enumerate(zip(records, gains, strict=True)):
        low = least if record.stiffness else _LEAST
        if gain is not None and not low < gain < _MOST:
            out.append(
                f'{where(record, i + 1)}: {told(gain)}; check the units and the calibration of '
                'both channels'
            )
        most = most_push(record)
        if record.stiffness and most is not None and _SHORT * most < record.stiffness:
            out.append(
                f'{where(record, i + 1)}: the specimen stiffness is given as '
                f'{record.stiffness:.3g} N/m, and the force channel shows no specimen: of force '
                f'that follows the displacement there are at most {most:.2g} N/m; check whether '
                'the test was free (stiffness 0), the load cell connected, and the unit of its '
                'channel'
            )
    return tuple(out)
