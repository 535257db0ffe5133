"""Joint calibration of several records, as `calibrate` runs it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from actuator_glue.cli._output import progress
from actuator_glue.errors import InputError
from actuator_glue.records import Array, Record

if TYPE_CHECKING:
    from actuator_glue.inference.chains import Chains
    from actuator_glue.inference.choice import ModelChoice
    from actuator_glue.model.exact import Initial


def initial_state(asked: str, records: list[Record]) -> Initial:
    """Return 'rest' or 'measured'; 'auto' is rest where every record starts at rest at zero."""
    from actuator_glue.residual import hygiene

    if asked != 'auto':
        return 'rest' if asked == 'rest' else 'measured'
    return 'rest' if all(hygiene.initial_state(r) == 'rest' for r in records) else 'measured'


def sample(
    args: argparse.Namespace,
    model: ModelChoice,
    records: list[Record],
    initial: Initial,
    settle: float,
) -> Chains:
    """Draw from the joint posterior of all records.

    Args:
        args: likelihood, shaping factor, evaluations and seed.
        model: what is sampled, see `sampled_model`.
        records: the tests, each with its stiffness.
        initial: state at each record's first sample.
        settle: uncounted start of each record [s].

    Raises:
        InputError: settings or records that cannot be used.
    """
    from actuator_glue.inference.posterior import Problem
    from actuator_glue.inference.posterior import sample as sample_posterior

    problem = Problem(
        records=records,
        model=model,
        likelihood=args.likelihood,
        shaping_factor=args.shaping_factor,
        initial=initial,
        settle=settle,
    )
    with progress('calibrating', args.evaluations) as done:
        chains = sample_posterior(
            problem.target(), (args.seed,), args.evaluations, progress=lambda made, _: done(made)
        )
    if not chains.annealed:
        raise InputError(
            f'{args.evaluations} evaluations ended on the way from the prior: no posterior was '
            'reached; give more --evaluations'
        )
    return chains


def sampled_model(
    effects: Sequence[str], likelihood: str, bounds: Mapping[str, tuple[float, float]]
) -> ModelChoice:
    """Return what is sampled: the model's parameters, and the errors' where they have one.

    Args:
        effects: effects of the catalogue.
        likelihood: ar1 has a parameter of its own.
        bounds: prior bounds by parameter that replace those of Table 3 and the catalogue.

    Raises:
        InputError: unknown effect or parameter, or bounds that leave nothing between them or
            reach below zero where a parameter cannot.
    """
    from actuator_glue.inference.choice import choose_model
    from actuator_glue.model.structure import Structure

    for parameter in Structure(effects).parameters:
        least = bounds.get(parameter.name, (0.0, 0.0))[0]
        if parameter.lower == 0.0 and least < 0.0:
            raise InputError(f'{parameter.name} cannot be negative; --bounds starts at {least:g}')
    model = choose_model(effects, bounds)
    return model.with_autocorrelation() if likelihood == 'ar1' else model


def fit_error(residuals: list[Array], records: list[Record], settle: float) -> dict[str, Any]:
    """Return the error of the best draw over all records and of each."""
    import numpy as np

    measured = [r.measured[round(settle / r.period) :] for r in records]
    every, spread = np.concatenate(residuals), np.concatenate(measured).std()
    rms = float(np.sqrt(np.mean(every**2)))
    return {
        'rms_m': rms,
        'nrmse': rms / float(spread) if spread > 0.0 else None,
        'records': [
            {
                'source': r.source,
                'rms_m': float(np.sqrt(np.mean(e**2))),
                'offset_m': float(np.mean(e)),
                'nrmse': float(np.sqrt(np.mean(e**2)) / y.std()) if y.std() > 0.0 else None,
            }
            for r, e, y in zip(records, residuals, measured, strict=True)
        ],
    }
