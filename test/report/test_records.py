"""The picture of a record."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.records import Record
from actuator_glue.report.records import record_figure


@pytest.mark.parametrize(
    ('samples', 'force', 'size'),
    [(2, False, 2e-3), (50, True, 2e-3), (50, True, 2e-9), (5000, True, 5.0), (5000, False, 2e-3)],
)
def test_a_record_is_drawn_whole(
    samples: int, force: bool, size: float, overlapping_texts
) -> None:
    """Command, displacement, zooms, tracking error and force, with units, nothing overlapping."""
    command = size * np.sin(np.arange(samples) * 0.02)
    record = Record(command, 0.9 * command, 1e-3, 250e3, actuator='a_long_name' * 20)
    if force:
        record = replace(record, force=250e3 * record.measured)
    figure = record_figure(record)
    labels = ' '.join(axes.get_ylabel() for axes in figure.axes)
    assert ('force [kN]' in labels) == force
    assert 'displacement [mm]' in labels
    assert {axes.get_xlabel() for axes in figure.axes} == {'time [s]'}
    assert '250 kN/m' in figure.get_suptitle()
    assert overlapping_texts(figure) == []
