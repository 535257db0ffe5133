"""Whether an effect of a simulated actuator can be seen in a command at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.api.simulation import NOISE, Command, Sensors, samples_of, sizes
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Hold, Record


def unseen(
    command: Command | Record,
    stiffnesses: Sequence[float],
    effects: Mapping[str, Mapping[str, float]],
    *,
    theta: ArrayLike | None = None,
    sensors: Sensors | None = None,
    hold: Hold = 'zoh',
) -> list[str]:
    """Return a line for each effect that changes every test by less than the sensor shows.

    Each test is simulated with all effects and with all but one, without sensor noise.

    Args:
        command: the command of all tests.
        stiffnesses: specimen stiffness of each test [N/m].
        effects: the effects, with the parameters given.
        theta: parameters of Eq. (2), shape (4,); None for Table 2.
        sensors: noise and resolution of the channels.
        hold: how the command runs between its samples.

    Raises:
        InputError: as `sizes`.
    """
    samples = samples_of(command)
    changes: dict[str, float] = {}
    structure, values = sizes(effects, theta)
    for stiffness in stiffnesses:
        known = dict(zip(structure.names, values, strict=True))

        def response(model: Structure, at: Array, k: float = stiffness) -> Array:
            # Timing jitter draws the same numbers each time.
            rng = np.random.default_rng(0)
            period = 1.0 / command.rate
            return Stream(model, at, stiffness=k, period=period, hold=hold, rng=rng).step(samples)[
                0
            ]

        whole = response(structure, values)
        for name in structure.effects:
            rest = Structure(e for e in structure.effects if e != name)
            off = whole - response(rest, np.array([known[n] for n in rest.names]))
            changes[name] = max(changes.get(name, 0.0), float(np.sqrt(np.mean(off**2))))
    sensors = sensors or Sensors()
    noise = NOISE if sensors.noise is None else sensors.noise
    span = 2.0 * float(np.abs(samples).max())
    step = 0.0 if sensors.bits is None else 2.0 * span / 2**sensors.bits
    shown = float(np.hypot(noise, step / np.sqrt(12.0)))
    return [
        f'effect {name} changes the displacement by {1e6 * change:.2g} um rms, no more than noise '
        f'and resolution of the sensor ({1e6 * shown:.2g} um rms): it cannot be seen in this '
        'command; give a larger value or another command'
        for name, change in changes.items()
        if change <= shown
    ]
