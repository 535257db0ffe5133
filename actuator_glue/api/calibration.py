"""Calibration: the joint posterior of Eq. (2) and effects from one or several records."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Unpack

from actuator_glue.api import judgement
from actuator_glue.api.bar import shown
from actuator_glue.api.calibration_error import fit_error, force_errors, residuals
from actuator_glue.api.calibration_options import CalibrationChanges, CalibrationOptions
from actuator_glue.api.calibration_parts import CalibratedRecord, RecordForce, marginals
from actuator_glue.api.calibration_result import Calibration
from actuator_glue.api.calibration_shaping import sampled
from actuator_glue.api.compilation import compilation
from actuator_glue.api.ensemble import residual_of
from actuator_glue.api.given import Records, Stiffness, records_given
from actuator_glue.api.options import chosen, takes
from actuator_glue.api.prior import given_prior
from actuator_glue.api.tracking import records_tracking
from actuator_glue.diagnosis.samples.force import check_forces
from actuator_glue.diagnosis.verdict.residual_structure import residual_structure
from actuator_glue.errors import InputError
from actuator_glue.hygiene.clean import clean, common_initial
from actuator_glue.hygiene.impulse_removal import despiked
from actuator_glue.hygiene.repeats import refuse_known, sketch
from actuator_glue.hygiene.suspicions import suspicions
from actuator_glue.hygiene.unlike_rest import unlike_rest
from actuator_glue.inference.at_bound import pressed
from actuator_glue.inference.choice import ModelChoice, choose_model
from actuator_glue.inference.least_squares.data import SETTLE
from actuator_glue.inference.posterior import Problem
from actuator_glue.inference.prior_conflict import conflict
from actuator_glue.model.structure import Structure
from actuator_glue.records import source_names

Progress = Callable[[float], None]


@takes(CalibrationOptions)
def calibrate(
    records: Records,
    options: CalibrationOptions | None = None,
    *,
    stiffness: Stiffness = None,
    progress: Progress | bool | None = None,
    **changes: Unpack[CalibrationChanges],
) -> Calibration:
    """Draw from the joint posterior of Eq. (2) and effects given records (DREAM(ZS), GLUE).

    Args:
        records: one or several tests of one actuator, each with its specimen stiffness, or the
            files they are in.
        options: those below as one object; None for their defaults.
        stiffness: specimen stiffness [N/m], one for all or one for each; None for what records
            and files say.
        progress: called with the evaluations made so far; True for a bar, False for none; None for
            a bar in a notebook.
        changes: options by name.

    Returns:
        The posterior: moments, draws, error of the best draw, and what forbids or limits its use.

    Raises:
        InputError: a record that cannot be fitted, or an option that cannot be used.

    Example:
        >>> posterior = calibrate([free, clamped], seed=3)  # doctest: +SKIP
        >>> posterior.parameters['beta_1'].mean  # doctest: +SKIP
    """
    options = chosen(CalibrationOptions, options, changes, 'calibrate')
    tests = records_given(records, stiffness)
    model = sampled_model(options)
    cleaned, notes = clean(tests)
    if options.use_force:
        check_forces(cleaned)
    initial = common_initial(cleaned) if options.initial == 'auto' else options.initial
    cleaned, found, near = despiked(cleaned, [initial] * len(cleaned))
    notes += found
    settle = options.settle
    if settle is None:
        settle = SETTLE if initial == 'measured' else 0.0
    given_before = given_prior(options.prior, options.drift, options.prior_age)
    if given_before is not None:
        refuse_known(tests, given_before.sketches, given_before.source)
    started = time.perf_counter()
    with (
        shown('calibrate', options.evaluations, progress) as done,
        compilation() as compiled,
    ):
        problem = Problem(
            records=cleaned,
            model=model,
            likelihood=options.likelihood,
            initial=initial,
            settle=settle,
            prior=None if given_before is None else given_before.carried,
        )
        problem, target, chains, remark = sampled(problem, options, near, done)
    seconds = time.perf_counter() - started - sum(compiled)
    if not chains.annealed:
        raise InputError(
            f'{options.evaluations} evaluations ended on the way from the prior: no posterior was '
            'reached; give more --evaluations'
        )
    structure = Structure(model.effects)
    errors = residuals(structure, chains.best, cleaned, initial, settle)
    fit = fit_error(cleaned, errors)
    units = dict(zip(model.names, model.units, strict=True))
    parameters = marginals(chains.kept, chains.best, units, list(zip(*model.bounds, strict=True)))
    at_bound = pressed(chains.posterior(), model.names, *model.bounds)
    prior = None
    if target.prior is not None and given_before is not None:
        prior = given_before.used(
            len(target.prior.mixture.log_weights),
            target.prior.quality(),
            conflict(target.prior, chains.posterior()).p_value,
        )
    converged = judgement.converged(parameters)
    best = chains.best[: len(structure.names)]
    left = residual_structure(cleaned, initial, settle, structure, best)
    doubtful = suspicions(tests)
    if left is not None:
        doubtful += unlike_rest(tests, left.noise_m)
    called = source_names(r.source for r in cleaned)
    forces: tuple[RecordForce, ...] = ()
    if options.use_force:
        forces = force_errors(structure, chains.best, cleaned, initial, settle)
    return Calibration(
        parameters=parameters,
        draws=chains.kept,
        best=chains.best,
        log_density=chains.log_density[chains.burn :],
        error=fit,
        structure=left,
        at_bound=at_bound,
        problems=tuple(judgement.problems(at_bound, parameters, fit, prior, left, doubtful)),
        notes=(
            *judgement.remarks(
                cleaned, parameters, chains.posterior(), converged, at_bound, prior
            ),
            *notes,
            *remark,
            *(f.remark(called[f.source]) for f in forces),
        ),
        converged=converged,
        effects=model.effects,
        likelihood=options.likelihood,
        shaping_factor=problem.shaping_factor if options.likelihood == 'glue' else None,
        automatic_shaping=bool(remark),
        force=forces,
        seed=options.seed,
        sampler=options.sampler,
        initial=initial,
        settle=settle,
        evaluations=chains.evaluations,
        seconds=seconds,
        compile_seconds=sum(compiled),
        sources=tuple(CalibratedRecord.of(r) for r in cleaned),
        prior=prior,
        records=tuple(cleaned),
        tracking=records_tracking(chains.posterior(), model.names, structure, cleaned),
        residual=residual_of(errors, len(structure.names)),
        sketches=tuple(sketch(r) for r in tests),
    )


def sampled_model(options: CalibrationOptions) -> ModelChoice:
    """Return what is sampled: the model's parameters, and the errors' where they have one.

    Raises:
        InputError: unknown effect or parameter, or bounds that leave nothing between them or
            reach below zero where a parameter cannot.
    """
    for parameter in Structure(options.effects).parameters:
        least = options.bounds.get(parameter.name, (0.0, 0.0))[0]
        if parameter.lower == 0.0 and least < 0.0:
            raise InputError(f'{parameter.name} cannot be negative; its bounds start at {least:g}')
    model = choose_model(options.effects, options.bounds)
    return model.with_autocorrelation() if options.likelihood == 'ar1' else model
