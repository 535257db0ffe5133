"""Arguments that command lines share: numbers, and outputs that overwrite only with --force."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Literal

from actuator_glue.errors import InputError

_SECONDS = {'s': 1.0, 'min': 60.0, 'h': 3600.0, 'd': 86400.0}


def is_number(text: str) -> bool:
    """Whether a text is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def number(text: str) -> float:
    """Return a finite number."""
    if not is_number(text):
        raise argparse.ArgumentTypeError(f'{text!r} is not a number')
    if not math.isfinite(float(text)):
        raise argparse.ArgumentTypeError(f'{text!r} is not finite')
    return float(text) + 0.0  # -0 is 0


def duration(text: str) -> float:
    """Return a time with its unit, as in 90s, 30min, 24h or 2d, in seconds."""
    value = text.strip()
    unit = next((u for u in sorted(_SECONDS, key=len, reverse=True) if value.endswith(u)), '')
    amount = value.removesuffix(unit).strip()
    if not unit or not is_number(amount):
        raise argparse.ArgumentTypeError(
            f'{text!r} is no time with its unit; give 90s, 30min, 24h or 2d'
        )
    return _SECONDS[unit] * number(amount)


def number_or_auto(text: str) -> float | Literal['auto']:
    """Return a finite number, or 'auto'."""
    return 'auto' if text == 'auto' else number(text)


def stiffness(text: str) -> float | Literal['unknown']:
    """Return a stiffness, or 'unknown'."""
    return 'unknown' if text == 'unknown' else number(text)


def only_with(args: argparse.Namespace, options: str, *needed: str) -> None:
    """Refuse options that do nothing without another one.

    Args:
        args: as parsed; what was not given is None there.
        options: some that need one of these, as '--drift --prior-age'.
        needed: the others, any of which is enough.

    Raises:
        InputError: one was given, and none of the others.
    """
    if any(given(args, name) for name in needed):
        return
    for option in options.split():
        if given(args, option):
            raise InputError(
                f'{option} does nothing without {" or ".join(needed)}; add that, or take {option} '
                'out'
            )


def given(args: argparse.Namespace, option: str) -> bool:
    """Return whether an option was given, as '--drift'; None, False and [] are what is not."""
    value = getattr(args, option.lstrip('-').replace('-', '_'))
    return value is not None and value is not False and value != []


class Output(str):
    """A file or bag that a command writes; `-` is standard output."""


class Folder(Output):
    """A folder that a command fills."""


def add_force(parser: argparse.ArgumentParser) -> None:
    """Add `--force`."""
    parser.add_argument('--force', action='store_true', help='write over what is there already')


def claim(path: Path | str, args: argparse.Namespace) -> Path:
    """Return a path that may be written: nothing is there, or it may be overwritten.

    Raises:
        InputError: something is there and `--force` was not given.
    """
    out = Path(path)
    if isinstance(path, Folder):
        taken = out.is_file() or (out.is_dir() and any(out.iterdir()))
    else:
        taken = str(path) != '-' and (out.is_file() or out.is_dir())  # a device is written to
    if taken and not args.force:
        raise InputError(f'{out} exists already; choose another name, or add --force')
    return out


def claim_outputs(args: argparse.Namespace) -> None:
    """Refuse what would be overwritten, before any long work is done for it.

    Raises:
        InputError: as `claim`.
    """
    for value in vars(args).values():
        if isinstance(value, Output):
            claim(value, args)
