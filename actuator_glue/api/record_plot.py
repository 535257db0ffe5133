"""A record as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actuator_glue.api.given import OneRecord, one_record_given

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot(record: OneRecord) -> Figure:
    """Return a figure of a record: command, displacement, their difference and the force.

    Axes and title have the unit of its motion: mm, or degrees, counts, volts.

    Args:
        record: the record, or the file it is in.

    Raises:
        InputError: no record, or a file that holds several.

    Example:
        >>> plot(Record.from_arrays([0.0, 0.1], [0, 1], [0, 1], unit='deg')).axes[0].get_ylabel()
        'displacement [deg]'
    """
    from actuator_glue.report.records import record_figure

    return record_figure(one_record_given(record))
