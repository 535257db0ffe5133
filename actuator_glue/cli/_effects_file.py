"""The option --effects-file: effects of the user's own."""

from __future__ import annotations

import argparse

from actuator_glue.arguments import Input


def add_effects_file(parser: argparse._ActionsContainer) -> None:
    """Add --effects-file."""
    parser.add_argument(
        '--effects-file',
        action='append',
        default=[],
        type=Input,
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
