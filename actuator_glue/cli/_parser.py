"""How every command reads its arguments: one order-free syntax, two-line errors, one epilog."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any, NoReturn

from actuator_glue.arguments import is_number, number, stiffness
from actuator_glue.errors import InputError

EPILOG = (
    'Exit codes: 0 done; 1 the answer is no, where a command asks a question; 2 the input\n'
    'cannot be used; 3 a fault of this program.'
)


def examples(epilog: str, commands: Sequence[str]) -> str:
    """Return the end of a command's help with what is typed for instance, a line each."""
    lines = [f'  actuator-glue {command}'.replace('%', '%%') for command in commands]
    return '\n'.join([epilog, '', 'Examples:', *lines])


def _without_dashes(args: list[str]) -> list[str]:
    """Return arguments without `--`: names with a dash behind it are files of this folder.

    Where positional arguments stand among options, argparse loses those behind it.
    """
    if '--' not in args:
        return args
    at = args.index('--')
    names = [f'./{name}' if name.startswith('-') else name for name in args[at + 1 :]]
    return [*args[:at], *names]


class Parser(argparse.ArgumentParser):
    """Arguments of the program or of one command, in any order."""

    def __init__(self, **options: Any) -> None:
        # Lines of the epilog stay as they are: examples are copied.
        super().__init__(
            epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter, **options
        )
        self._within = False

    def parse_known_args(  # type: ignore[override]  # an overload for any namespace is left out
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse; a command takes its positional arguments from between its options, too."""
        if self._within or self._subparsers is not None or args is None:
            return super().parse_known_args(args, namespace)
        self._within = True
        try:
            plain = _without_dashes(self._spread(args))
            found, unknown = self.parse_known_intermixed_args(plain, namespace)
        finally:
            self._within = False
        if unknown:
            self.error(f'unrecognized arguments: {" ".join(unknown)}')
        return found, []

    def _spread(self, args: Sequence[str]) -> list[str]:
        """Give every value of `--stiffness 0 unknown FILE` the option's name; FILE is none."""
        many = {
            name: action.type
            for action in self._actions
            if isinstance(action, argparse._AppendAction) and action.type in (number, stiffness)
            for name in action.option_strings
        }
        spread: list[str] = []
        option = ''
        for text in args:
            word = text == 'unknown' and many.get(option) is stiffness
            if option and (is_number(text) or word):
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
