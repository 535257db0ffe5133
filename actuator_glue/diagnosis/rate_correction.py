"""What fewer samples change of a simulation, made up for before a posterior is drawn.

Records that were sampled faster than they need are decimated (decimate.py). A linear actuator
answers the same; one that sticks, slips or saturates does so at other moments between the fewer
samples. Of friction of 300 N that is micrometres, less than what is material, but hundreds of nats
over minutes: truth lay outside of nearly every interval.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.data import Data, simulated
from actuator_glue.diagnosis.decimate import means
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array


def corrected(data: Data, model: Structure, theta: Array) -> Data:
    """Return data whose simulation at theta leaves what the records as sampled leave.

    To first order, as in deferred correction: near theta the difference hardly depends on it.

    Args:
        data: records, decimated or not.
        model: what simulates them.
        theta: its parameters, (p,).
    """
    if max(data.factors) == 1:
        return data
    records = []
    rows = zip(data.records, data.recorded, data.factors, data.initials, data.origins, strict=True)
    for record, whole, count, initial, origin in rows:
        if count > 1:
            fewer, every = (
                simulated(model, theta[np.newaxis], r, initial, origin)[0] for r in (record, whole)
            )
            record = replace(record, measured=record.measured - means(every, count) + fewer)
        records.append(record)
    return replace(data, records=tuple(records))
