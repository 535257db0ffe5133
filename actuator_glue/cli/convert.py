"""Convert between laboratory files and bags: CSV, .mat or mapped text to a bag, and back."""

from __future__ import annotations

import argparse

from actuator_glue.cli._records import add_records, load
from actuator_glue.cli._save import add_out, save

EXAMPLES = (
    'convert test.csv bag_of_test --stiffness 250e3',
    'convert bag_of_test test.csv',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_records(parser)
    add_out(parser)


def run(args: argparse.Namespace) -> int:
    """Convert; several records become one bag, or one numbered file each.

    Raises:
        InputError: a record cannot be used, or the output exists or cannot be written.
    """
    save(load(args), args)
    return 0
