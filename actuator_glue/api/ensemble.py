"""Draws of a posterior as many simulated tests: for bands, predictions and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.api.given import one_record_given
from actuator_glue.api.simulation import Command
from actuator_glue.errors import InputError
from actuator_glue.given import number, vector
from actuator_glue.hybrid.actuator import table_of
from actuator_glue.inference.predictive import ResidualModel, fit_residual
from actuator_glue.model.exact import Initial
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Hold, Record, check_stiffness

GivenCommand: TypeAlias = Command | Record | PathLike[str] | str | ArrayLike


def simulated(
    draws: Array,
    names: Sequence[str],
    structure: Structure,
    record: Record,
    initial: Initial = 'rest',
) -> Array:
    """Return the displacements that draws expect in a test, (k, n) [m]; diverging ones left out.

    Args:
        draws: shape (m, p), SI units.
        names: parameter of each column; those of a likelihood are passed over.
        structure: the model.
        record: the test; its stiffness must be known.
        initial: state at its first sample.

    Raises:
        InputError: fewer than two draws stay finite.
    """
    moved = structure.simulate(table_of(draws, names, structure), record, initial=initial)
    finite = moved[np.isfinite(moved).all(axis=1)]
    if len(finite) < 2:
        raise InputError(
            f'{len(draws) - len(finite)} of {len(draws)} draws diverge under this command; give '
            'a smaller one, or calibrate with records that are like it'
        )
    return finite


def residual_of(parts: Sequence[Array], parameters: int) -> ResidualModel | None:
    """Return the residual of a model, measured less simulated [m]; None for too few samples.

    Args:
        parts: one residual for each stretch without a gap, (n,) each.
        parameters: how many were fitted.
    """
    try:
        return fit_residual(parts, parameters=parameters)
    except InputError:
        return None


def commanded(
    command: GivenCommand,
    stiffness: float | None,
    rate: float | None,
    hold: Hold | None,
    motion: str,
) -> tuple[Record, bool]:
    """Return a test that is to be simulated, and whether its displacement was measured.

    What was measured under another stiffness is none of this test.

    Args:
        command: a shape, a record or a file of one, or samples [m].
        stiffness: specimen stiffness [N/m]; None for what the record says.
        rate: of samples [Hz]; shapes and records have their own.
        hold: how samples run from one to the next; None for what the record says, else 'zoh'.
        motion: what the draws were fitted to, which a record must move in.

    Raises:
        InputError: a record that moves in another unit, samples without a rate or with an
            impossible one, no stiffness, or what is no command.
    """
    if isinstance(command, Command):
        samples, period = command.samples(), 1.0 / command.rate
    elif isinstance(command, (Record, str, PathLike)):
        record = one_record_given(command)
        if record.motion != motion:
            raise InputError(
                f'the command moves in {record.motion}, and what was fitted moves in {motion}'
            )
        k = record.known_stiffness() if stiffness is None else check_stiffness(stiffness)
        measured = record.stiffness in (None, k)
        return replace(record, stiffness=k, hold=hold or record.hold), measured
    else:
        samples = vector(command, 'command')
        if samples.ndim != 1:
            raise InputError(
                f'command: {type(command).__name__} is none; give one Command or record, the file '
                'of a record, or samples [m], shape (n,)'
            )
        if rate is None:
            raise InputError('the command is samples: give their rate [Hz], as rate=1000.0')
        period = 1.0 / _rate(rate)
    if stiffness is None:
        raise InputError('give the specimen stiffness [N/m], 0 for a free actuator')
    nothing, k = np.zeros(np.shape(samples)), check_stiffness(stiffness)
    return Record(samples, nothing, period, k, hold=hold or 'zoh'), False


def _rate(rate: float) -> float:
    """Return samples per second.

    Raises:
        InputError: no number, or none that samples can come at.
    """
    found = number(rate, 'rate')
    if not 0.0 < found < np.inf:
        raise InputError(
            f'rate is {found:g}; give the samples per second [Hz], more than 0, as rate=1000.0'
        )
    return found
