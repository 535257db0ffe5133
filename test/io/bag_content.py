"""Messages of a record, as a recorder finds them."""

import numpy as np

from actuator_glue.io import messages
from actuator_glue.records import Record


def samples(record: Record, start: int, stop: int) -> object:
    """Return samples start:stop of a record as a SampleBlock."""
    return messages.message(
        'SampleBlock',
        header=messages.header(record.stamp_ns(start), record.actuator),
        period=record.period,
        index=record.first_index + start,
        command=record.command[start:stop],
        measured=record.measured[start:stop],
        force=np.empty(0),
    )


def setup(record: Record, at: int, stiffness: float) -> object:
    """Return a TestSetup that holds from a sample on."""
    return messages.message(
        'TestSetup',
        header=messages.header(record.stamp_ns(at), record.actuator),
        actuator=record.actuator,
        specimen_stiffness=stiffness,
        rate=record.rate,
        hold=record.hold,
        index=at,
        source='',
        motion=record.motion,
    )
