"""Effects that `simulate` switches on: their sizes, and whether they can be seen at all."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from actuator_glue.errors import InputError
from actuator_glue.records import Array, Record

if TYPE_CHECKING:
    from actuator_glue.model.structure import Structure

NOISE = 1e-5  # m, of the displacement sensor where nothing else is asked for


def chosen(
    args: argparse.Namespace, stiffness: float, command: Array, rate: float
) -> tuple[Structure, Array]:
    """Return the structure and its parameters, typical ones where no value is given.

    Raises:
        InputError: an unknown effect or parameter, or a value outside the catalogue's bounds.
    """
    import numpy as np

    from actuator_glue.model.effects import scale
    from actuator_glue.model.parameters import TABLE_2
    from actuator_glue.model.structure import Structure

    asked = dict(_parse(text) for text in args.effect)
    structure = Structure(asked)
    base = TABLE_2 if args.theta is None else np.array(args.theta)
    theta = structure.neutral(base)
    test = scale([Record(command, command, 1.0 / rate, stiffness)], base)
    for entry in structure.entries:
        columns = structure.columns(entry.name)
        sizes = list(entry.starts(test))
        theta[columns] = sizes[len(sizes) // 2]
        known = {p.name: p for p in entry.parameters}
        for name, value in asked[entry.name].items():
            if name not in known:
                raise InputError(
                    f'effect {entry.name} has no parameter {name!r}; it has {", ".join(known)}'
                )
            low, high, unit = known[name].lower, known[name].upper, known[name].unit
            if not low <= value <= high:
                raise InputError(
                    f'effect {entry.name}: {name} = {value:g} {unit} is outside the bounds of the '
                    f'catalogue, [{low:g}, {high:g}] {unit}; give it in SI units'
                )
            theta[columns.start + list(known).index(name)] = value
    return structure, theta


def unseen(
    args: argparse.Namespace, stiffnesses: list[float], command: Array, rate: float
) -> list[str]:
    """Return a line for each effect that changes every test by less than the sensor shows.

    Each test is simulated with all effects and with all but one, without sensor noise.
    """
    import numpy as np

    from actuator_glue.model.structure import Structure

    changes: dict[str, float] = {}
    for stiffness in stiffnesses:
        structure, theta = chosen(args, stiffness, command, rate)
        values = dict(zip(structure.names, theta, strict=True))
        whole = _response(args, structure, theta, stiffness, command, rate)
        for name in structure.effects:
            rest = Structure(e for e in structure.effects if e != name)
            less = np.array([values[n] for n in rest.names])
            off = whole - _response(args, rest, less, stiffness, command, rate)
            changes[name] = max(changes.get(name, 0.0), float(np.sqrt(np.mean(off**2))))
    noise = NOISE if args.noise_mm is None else args.noise_mm * 1e-3
    span = 2.0 * float(np.abs(command).max())
    step = 0.0 if args.bits is None else 2.0 * span / 2**args.bits
    shown = float(np.hypot(noise, step / np.sqrt(12.0)))
    return [
        f'effect {name} changes the displacement by {1e6 * change:.2g} um rms, no more than noise '
        f'and resolution of the sensor ({1e6 * shown:.2g} um rms): it cannot be seen in this '
        'command; give a larger value or another command'
        for name, change in changes.items()
        if change <= shown
    ]


def _response(
    args: argparse.Namespace,
    structure: Structure,
    theta: Array,
    stiffness: float,
    command: Array,
    rate: float,
) -> Array:
    import numpy as np

    from actuator_glue.model.stream import Stream

    # Timing jitter draws the same numbers each time.
    rng = np.random.default_rng(args.seed)
    period = 1.0 / rate
    stream = Stream(structure, theta, stiffness=stiffness, period=period, hold=args.hold, rng=rng)
    return stream.step(command)[0]


def _parse(text: str) -> tuple[str, dict[str, float]]:
    name, _, rest = text.partition(':')
    values = {}
    for item in filter(None, rest.split(',')):
        key, sign, value = item.partition('=')
        try:
            values[key.strip()] = float(value)
        except ValueError:
            sign = ''
        if not sign:
            raise InputError(f'--effect {text}: {item!r} is not PARAMETER=VALUE')
    return name.strip(), values
