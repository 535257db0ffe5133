"""Arguments that command lines share: numbers, and outputs that overwrite only with --force."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, Self

from actuator_glue.errors import InputError
from actuator_glue.given import at_home

# What a campaign keeps in its folder of the kind that others write there as summaries.
CAMPAIGN_FILES = ('campaign.json', 'progress.json')
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


def whole(text: str) -> int:
    """Return a whole number; 6e4 is one."""
    if not number(text).is_integer():
        raise argparse.ArgumentTypeError(f'{text!r} is not a whole number')
    return int(text) if text.strip().lstrip('+-').isdecimal() else int(float(text))


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


class _Path(str):
    """A path; of `--out=~/a.csv` shells leave the home folder to the program."""

    def __new__(cls, given: str) -> Self:
        """Return the path with the home folder in full."""
        return super().__new__(cls, at_home(given))


class Input(_Path):
    """A file, bag or folder that a command reads."""


class Output(_Path):
    """A file or bag that a command writes; `-` is standard output."""


class Folder(Output):
    """A folder that a command fills."""


def add_force(parser: argparse.ArgumentParser) -> None:
    """Add `--force`."""
    parser.add_argument('--force', action='store_true', help='write over what is there already')


def claim(path: Path | str, args: argparse.Namespace) -> Path:
    """Return a path that may be written: nothing is there, or it may be overwritten.

    Raises:
        InputError: the command reads what is there, or something is there and `--force` was not
            given.
    """
    out = Path(path)
    if str(path) == '-':
        return out
    for read in _inputs(args):
        if _takes_place_of(path, read):
            which = 'it' if out == read else f'{read}'
            raise InputError(
                f'{out}: this command reads {which}, and writing there would destroy it; choose '
                'another name for the output'
            )
    if isinstance(path, Folder):
        taken = out.is_file() or (out.is_dir() and any(out.iterdir()))
    else:
        taken = out.is_file() or out.is_dir()  # a device is written to
    if taken and not args.force:
        raise InputError(f'{out} exists already; choose another name, or add --force')
    return out


def claim_outputs(args: argparse.Namespace) -> None:
    """Refuse outputs that cannot stand where they are to go, before any long work is done.

    Folders that are not there will be made, see `make_room`; that they can be is looked at here.

    Raises:
        InputError: as `claim`; two outputs of one name, one that is a folder above another, or no
            folder can be made for one.
    """
    before: list[tuple[str, Output]] = []
    for name, value in vars(args).items():
        if not isinstance(value, Output):
            continue
        if value == '-' and name != 'json':
            raise InputError(
                "'-' is standard output, where only --json can go; give the name of a file"
            )
        out = claim(value, args)
        if value == '-' or (out.exists() and not out.is_file() and not out.is_dir()):
            continue  # a stream or device takes what comes
        _check_room(out)
        option = f'--{name.replace("_", "-")}'
        for other in before:
            _check_apart(other, (option, value))
        before.append((option, value))


def make_room(out: Path | str) -> None:
    """Make the folder of an output where it is not there.

    Raises:
        InputError: it cannot be made.
    """
    folder = Path(out).parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f'{out}: its folder cannot be made ({error.strerror or error}); choose another one'
        ) from error


def _check_apart(one: tuple[str, Output], other: tuple[str, Output]) -> None:
    """Refuse two outputs, with their options, that cannot both be written."""
    places = [Path(value).resolve() for _, value in (one, other)]
    filled = [isinstance(value, Folder) for _, value in (one, other)]  # with files of many names
    if places[0] == places[1] and not all(filled):
        raise InputError(
            f'{one[0]} and {other[0]} would both write {Path(other[1])}; give each a name of its '
            'own'
        )
    for above, below in ((0, 1), (1, 0)):
        if places[above] in places[below].parents and not filled[above]:
            (outer, folder), (inner, file) = (one, other)[above], (one, other)[below]
            raise InputError(
                f'{inner} {file} would lie in {folder}, which {outer} writes; give each a place '
                'of its own'
            )


def _check_room(out: Path) -> None:
    """Refuse an output whose folder is not there and cannot be made."""
    if out.exists():
        return
    there = next(folder for folder in out.absolute().parents if os.path.lexists(folder))
    if not there.is_dir():
        raise InputError(f'{out}: {there} is no folder; choose another name')
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f'{out}: nothing may be written in {there}; choose another folder')


def _inputs(args: argparse.Namespace) -> Iterator[Path]:
    """Yield what a command reads, as far as it is there; names of what comes with us are not."""
    for value in vars(args).values():
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, (Input, Path)) and Path(one).exists():
                yield Path(one)


def _takes_place_of(path: Path | str, read: Path) -> bool:
    """Whether writing an output would destroy an input, under whatever names both are known."""
    out = Path(path).resolve()
    if out.exists() and out.samefile(read):
        # A folder that is filled keeps what it holds; a device stays what it is.
        return not isinstance(path, Folder) and (out.is_file() or out.is_dir())
    if read.is_dir():
        # No record is called so, and summaries of a folder may lie in it.
        folder = read.resolve()
        summary = out.suffix in ('.json', '.html') and out.parent == folder
        own = out.name in CAMPAIGN_FILES
        return out.is_file() and folder in out.parents and (own or not summary)
    return not isinstance(path, Folder) and out in read.resolve().parents
