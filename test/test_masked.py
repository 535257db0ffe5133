"""Masked arrays: what is masked was not measured, whatever number lies beneath the mask."""

import warnings
from collections.abc import Callable

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.errors import InputError
from actuator_glue.hybrid.ground_motion import GroundMotion
from actuator_glue.hybrid.indicators import energy_error
from actuator_glue.model.plant import command_block
from actuator_glue.sample_block import Block, check_block

WAVE = 1e-3 * np.sin(0.1 * np.arange(50))
MASKED = np.ma.masked_array(WAVE, np.arange(50) == 17)
WHOLE = np.ma.masked_array(WAVE)


@pytest.mark.parametrize(
    'use',
    [
        lambda a: ag.Record(a, WAVE, 1e-3),
        lambda a: ag.Record(WAVE, a, 1e-3),
        lambda a: ag.Record(WAVE, 2 * WAVE, 1e-3, force=a),
        lambda a: check_block(Block(0, 1e-3, 0, a, WAVE)),
        lambda a: check_block(Block(0, 1e-3, 0, WAVE, WAVE, a)),
        lambda a: command_block(a),
        lambda a: GroundMotion(a, 1e-2),
        lambda a: energy_error(a, 2 * WAVE, WAVE, 1e5),
        lambda a: energy_error(WAVE, 2 * WAVE, a, 1e5),
    ],
)
def test_a_masked_sample_is_a_missing_one(use: Callable[[object], object]) -> None:
    """Refused as a NaN is; a mask that hides nothing hides nothing."""
    use(WHOLE)
    with pytest.raises(InputError, match=r'finite|infinite'):
        use(MASKED)


@pytest.mark.parametrize('kind', [float, np.float32, int])
def test_a_record_tells_where_a_sample_is_masked(kind: type) -> None:
    """Of any type of number."""
    values = np.ma.masked_array(np.arange(50), np.arange(50) == 17).astype(kind) * kind(1)
    with pytest.raises(InputError, match=r'command has 1 NaN .* at sample 17;'):
        ag.Record(1e-3 * values, WAVE, 1e-3)


def test_a_masked_record_is_kept_as_a_plain_one() -> None:
    """Nothing of the mask goes on."""
    record = ag.Record(WHOLE, 2 * WHOLE, 1e-3)
    assert type(record.command) is np.ndarray and np.array_equal(record.command, WAVE)


@pytest.mark.parametrize('values', [WAVE + 1j, WAVE.astype('timedelta64[s]')])
def test_what_is_no_real_number_is_refused(values: np.ndarray) -> None:
    """NumPy would drop the imaginary part with a warning, and count seconds."""
    with warnings.catch_warnings(action='error'), pytest.raises(InputError, match='command'):
        ag.Record(values, WAVE, 1e-3)
