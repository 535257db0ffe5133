"""A calibrated actuator as python-control objects."""

from __future__ import annotations

from typing import Any

import numpy as np

from actuator_glue.api.drawn import Drawn
from actuator_glue.errors import InputError
from actuator_glue.given import whole
from actuator_glue.hybrid.actuator import actuator
from actuator_glue.records import Array, check_stiffness


def chosen_draw(of: Drawn, draw: str | int) -> Array:
    """Return the parameters of the mean, the best, or a numbered draw, (p,).

    Raises:
        InputError: no such draw.
    """
    draws = of.draws
    if draw == 'mean':
        return np.asarray(draws.mean(axis=0))
    if draw == 'best':
        return of.best
    draw = whole(draw, 'draw') if not isinstance(draw, str) else draw
    if isinstance(draw, int) and -len(draws) <= draw < len(draws):
        return np.asarray(draws[draw])
    raise InputError(f"draw {draw!r}: use 'mean', 'best', or a number below {len(draws)}")


_DUST = 1e-9  # of a polynomial's largest term at its own frequency: less is rounding error


def transfer_function(of: Drawn, stiffness: float, draw: str | int) -> Any:
    """Return x/u under a specimen stiffness [N/m] as `control.TransferFunction`.

    Raises:
        InputError: as `state_space`.
    """
    import control

    found = control.ss2tf(state_space(of, stiffness, draw))
    (num,), (den,) = found.num[0], found.den[0]
    natural = abs(den[-1] / den[0]) ** (1.0 / (len(den) - 1))
    sizes = np.abs(num) * natural ** np.arange(len(num) - 1, -1, -1)
    num = np.where(sizes > _DUST * sizes.max(), num, 0.0)
    return control.tf(num, den, inputs='command', outputs='displacement')


def state_space(of: Drawn, stiffness: float, draw: str | int) -> Any:
    """Return x/u under a specimen stiffness [N/m] as `control.StateSpace`.

    Raises:
        InputError: no such draw, or effects that are no rational transfer function.
    """
    import control

    curved = [e.name for e in of.structure.entries if not e.linear]
    if curved:
        raise InputError(f'the model has {", ".join(curved)}, which no transfer function has')
    row = chosen_draw(of, draw)[None]
    k = np.array([check_stiffness(stiffness)])
    model = actuator(row, of.names, of.structure.entries, k)
    if {'delay', 'lead'} & set(of.structure.effects):
        raise InputError(
            f'the model has a delay of {1e3 * float(model.delay[0]):.3g} ms, which is no rational '
            'function; calibrate without it, or build the delay on top with control.pade'
        )
    A, B, C, D = (part[0] for part in model.system)
    return control.ss(A, B[:, None], C[None], [[D]], inputs='command', outputs='displacement')
