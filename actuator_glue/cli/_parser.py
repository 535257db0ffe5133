"""How every command reads its arguments: one order-free syntax, two-line errors, one epilog."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from actuator_glue.errors import InputError

EPILOG = (
    'Exit codes: 0 done; 1 the answer is no, where a command asks a question; 2 the input '
    'cannot be used; 3 a fault of this program.'
)


class Parser(argparse.ArgumentParser):
    """Arguments of the program or of one command, in any order."""

    def __init__(self, **options: Any) -> None:
        super().__init__(epilog=EPILOG, **options)
        self._within = False

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse; a command takes its positional arguments from between its options, too."""
        if self._within or self._subparsers is not None or args is None:
            return super().parse_known_args(args, namespace)
        self._within = True
        try:
            found, unknown = self.parse_known_intermixed_args(self._spread(args), namespace)
        finally:
            self._within = False
        if unknown:
            self.error(f'unrecognized arguments: {" ".join(unknown)}')
        return found, []

    def _spread(self, args: Sequence[str]) -> list[str]:
        """Give every number of `--stiffness 0 250e3 FILE` the option's name; FILE is none."""
        many = {
            name
            for action in self._actions
            if isinstance(action, argparse._AppendAction) and action.type is number
            for name in action.option_strings
        }
        spread: list[str] = []
        option = ''
        for text in args:
            if option and is_number(text):
                if spread[-1] == option:
                    spread.pop()
                spread.append(f'{option}={text}')
                continue
            option = text if text in many else ''
            spread.append(text)
        return spread

    def error(self, message: str) -> NoReturn:
        """Tell usage and error in a line each; exit with 2."""
        places = [str(a.metavar or a.dest) for a in self._get_positional_actions()]
        many = [a.nargs in ('+', '*') for a in self._get_positional_actions()]
        usage = [f'{p}...' if m else p for p, m in zip(places, many, strict=True)]
        text = InputError(f'{message} ({self.prog} --help tells more)')
        self.exit(2, f'usage: {" ".join([self.prog, *usage])} [options]\nactuator-glue: {text}\n')


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
    return float(text)


class Output(str):
    """A file or bag that a command writes; `-` is standard output."""


class Folder(Output):
    """A folder that a command fills."""


def add_force(parser: argparse.ArgumentParser) -> None:
    """Add `--force`."""
    parser.add_argument(
        '--force', action='store_true', help='write over what is there already'
    )  # fmt: skip


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
