"""`--prior` and its age and drift, for commands that can begin with what a calibration knew."""

from __future__ import annotations

import argparse
from typing import Any

from actuator_glue.arguments import Input, duration, number, only_with


def add_prior(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        '--prior',
        type=Input,
        metavar='FILE',
        help='what an earlier `calibrate --save FILE` of this actuator knew',
    )
    parser.add_argument(
        '--drift',
        type=number,
        metavar='RATE',
        help='how far the logarithm of each parameter may wander in an hour since, standard '
        'deviation (default 0.02)',
    )
    parser.add_argument(
        '--prior-age',
        type=duration,
        metavar='TIME',
        help='time since that calibration with its unit, as 90s, 30min, 24h or 2d (default 0)',
    )


def prior_options(args: argparse.Namespace) -> dict[str, Any]:
    """Return the arguments that were given as options of `calibrate` and `diagnose`.

    Raises:
        InputError: age or drift of no prior.
    """
    only_with(args, '--drift --prior-age', '--prior')
    given = {'prior': args.prior, 'drift': args.drift, 'prior_age': args.prior_age}
    return {name: value for name, value in given.items() if value is not None}
