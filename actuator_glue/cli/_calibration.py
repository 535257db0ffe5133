"""Joint calibration of several records, as `calibrate` runs it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from actuator_glue.cli._output import progress
from actuator_glue.errors import InputError
from actuator_glue.records import Array, Record

if TYPE_CHECKING:
    from actuator_glue.inference.chains import Chains
    from actuator_glue.inference.evaluate import LogDensity
    from actuator_glue.model.exact import Initial
    from actuator_glue.online.settings import ModelChoice


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
    import numpy as np

    from actuator_glue.inference import dream
    from actuator_glue.inference.likelihood import (
        Ar1Likelihood,
        GaussianLikelihood,
        GlueLikelihood,
    )
    from actuator_glue.model.fast import FastErrors
    from actuator_glue.model.structure import Structure
    from actuator_glue.online.coordinates import Coordinates

    counts = [round(settle / r.period) for r in records]
    errors = Structure(model.effects).errors(records, counts, initial)
    sums = errors if model.effects else FastErrors(records, counts, initial)
    density: LogDensity
    if args.likelihood == 'glue':
        density = GlueLikelihood(sums, args.shaping_factor)
    elif args.likelihood == 'gaussian':
        density = GaussianLikelihood(sums)
    else:
        density = Ar1Likelihood(errors)
    lower, upper = model.bounds
    stiffnesses = {r.known_stiffness() for r in records}
    # One stiffness alone leaves a bent ridge, on which no sampler moves in physical parameters.
    single = Coordinates(model, stiffnesses.pop()) if len(stiffnesses) == 1 else None
    settings, archive = dream.Settings(), None
    if single is not None:
        settings, archive = single.cold(np.random.default_rng((args.seed, 1)), settings)
    with progress('calibrating', args.evaluations) as done:
        chains = dream.sample(
            np.random.default_rng(args.seed),
            density if single is None else single.density(density),
            lower if single is None else single.lower,
            upper if single is None else single.upper,
            evaluations=args.evaluations,
            settings=settings,
            archive=archive,
            progress=lambda made, _: done(made),
        )
    return chains if single is None else single.chains(chains)


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
    from actuator_glue.inference.likelihood import PHI
    from actuator_glue.model.structure import Structure
    from actuator_glue.online.fitting import choose_model

    for parameter in Structure(effects).parameters:
        least = bounds.get(parameter.name, (0.0, 0.0))[0]
        if parameter.lower == 0.0 and least < 0.0:
            raise InputError(f'{parameter.name} cannot be negative; --bounds starts at {least:g}')
    model = choose_model(effects, bounds)
    if likelihood != 'ar1':
        return model
    return replace(
        model,
        names=(*model.names, PHI.name),
        units=(*model.units, PHI.unit),
        lower=(*model.lower, PHI.lower),
        upper=(*model.upper, PHI.upper),
    )


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
