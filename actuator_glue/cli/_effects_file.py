"""The option --effects-file: effects of the user's own."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from typing import Any


def add_effects_file(parser: argparse._ActionsContainer) -> None:
    """Add --effects-file."""
    parser.add_argument(
        '--effects-file',
        action='append',
        default=[],
        metavar='EFFECTS.yaml|.py',
        help='effects of your own as expressions, e.g. sensor: y = y + cubic*y**3; repeatable '
        '(docs/effects.md, "Your own effects")',
    )


def load_effects(args: argparse.Namespace) -> None:
    """Register the effects of all files given.

    Raises:
        InputError: a file or an effect cannot be used.
    """
    if args.effects_file:
        from actuator_glue import effects

        for path in args.effects_file:
            effects.load_effects(path)


def definitions(names: Iterable[str]) -> dict[str, Any]:
    """Return `{'definitions': ...}` of those effects that are the user's own, else nothing.

    What is saved with it can be read where the file is not at hand.
    """
    from actuator_glue.model.effects import CATALOGUE
    from actuator_glue.model.effects.terms.definition import mapping

    wanted = set(names)
    own = mapping(e for e in CATALOGUE.registered() if e.name in wanted)
    return {'definitions': own} if own else {}
