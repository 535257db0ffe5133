"""Calibrate the servo-hydraulic model from one or several records jointly (GLUE, DREAM(ZS)).

Exit code 0: a posterior to go on with. 1: the model does not fit, or a bound holds a parameter;
the first line says so. 2: the input cannot be used.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_glue.cli._calibration import fit_error, initial_state, sample, sampled_model
from actuator_glue.cli._compilation import compilation
from actuator_glue.cli._effects_file import add_effects_file, definitions, load_effects
from actuator_glue.cli._judgement import CONVERGED, bounds, problems, remarks
from actuator_glue.cli._output import add_json, note, say, table, write_json
from actuator_glue.cli._parser import Output, number
from actuator_glue.cli._records import add_records, load
from actuator_glue.errors import InputError
from actuator_glue.records import Record

if TYPE_CHECKING:
    from actuator_glue.inference.chains import Chains
    from actuator_glue.inference.choice import ModelChoice


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_records(parser)
    parser.add_argument(
        '--shaping-factor',
        type=number,
        default=256.0,
        metavar='G',
        help='G of L = -G ln Var[E], Eq. (4) (default 256)',
    )
    parser.add_argument(
        '--likelihood',
        choices=('glue', 'gaussian', 'ar1'),
        default='glue',
        help='glue is Eq. (4); gaussian and ar1 are formal ones (default glue)',
    )
    parser.add_argument(
        '--evaluations',
        type=int,
        default=60_000,
        metavar='N',
        help='likelihood evaluations (default 60000)',
    )
    parser.add_argument('--seed', type=int, default=1, metavar='S', help='seed (default 1)')
    parser.add_argument(
        '--effect',
        action='append',
        default=[],
        metavar='NAME',
        help='calibrate Eq. (2) with this effect of the catalogue as well; repeatable',
    )
    add_effects_file(parser)
    parser.add_argument(
        '--initial',
        choices=('auto', 'rest', 'measured'),
        default='auto',
        help='state at the first sample: at rest at zero, or from the first measured samples '
        '(auto: by looking)',
    )
    parser.add_argument(
        '--settle',
        type=number,
        metavar='SECONDS',
        help='start of each record that only lets the initial state be forgotten '
        '(default 0 from rest, else 1 s)',
    )
    parser.add_argument(
        '--draws',
        type=Output,
        metavar='OUT.npz',
        help='save the posterior draws (arrays draws, names, units, best, effects, initial) for '
        '`plot --draws` and for others',
    )
    parser.add_argument(
        '--bounds',
        action='append',
        default=[],
        metavar='NAME=LO:HI',
        help='prior bounds of a parameter in the unit of the table, as in beta_1=0:800, in place '
        'of those of Table 3 or the catalogue; repeatable',
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Calibrate and print the posterior moments, first what forbids their use.

    Raises:
        InputError: a record, option or output cannot be used.
    """
    if args.seed < 0:
        raise InputError(f'--seed {args.seed} is negative')
    load_effects(args)
    model = sampled_model(args.effect, args.likelihood, bounds(args.bounds))

    from actuator_glue.inference.at_bound import pressed
    from actuator_glue.model.structure import Structure
    from actuator_glue.residual.hygiene import SETTLE, clean

    records, notes = clean(load(args))
    initial = initial_state(args.initial, records)
    settle = args.settle if args.settle is not None else (SETTLE if initial == 'measured' else 0.0)
    if settle < 0.0:
        raise InputError(f'--settle {settle:g} s is negative')
    structure = Structure(args.effect)
    started = time.perf_counter()
    with compilation() as compiled:
        chains = sample(args, model, records, initial, settle)
    seconds = time.perf_counter() - started - sum(compiled)
    errors = structure.errors(records, [round(settle / r.period) for r in records], initial)
    fit = fit_error(errors.residuals(chains.best[: len(structure.names)]), records, settle)
    parameters = _parameters(model, chains)
    converged = all(p['rhat'] is not None and p['rhat'] <= CONVERGED for p in parameters.values())
    at_bound = pressed(chains.posterior(), model.names, *model.bounds)
    wrong = problems(at_bound, dict(zip(model.names, model.units, strict=True)), fit)
    for line in wrong:
        say(line, args)
    _show(args, records, parameters, chains, fit, seconds)
    if sum(compiled) > 0.5:
        say(f'{sum(compiled):.1f} s of compilation besides, once per installation', args)
    notes = [*remarks(records, parameters, chains, converged, at_bound), *notes]
    for line in notes:
        note(line)
    if args.draws is not None:
        _save_draws(args.draws, chains, parameters, args.effect, initial)
    content = {
        'schema': 'actuator_glue.calibration/1',
        'parameters': parameters,
        'evaluations': chains.evaluations,
        'seconds': seconds,
        'compile_seconds': sum(compiled),
        'error': fit,
        'problems': wrong,
        'at_bound': [p.to_json() for p in at_bound],
        'notes': notes,
        'converged': converged,
        'effects': list(structure.effects),
        **definitions(structure.effects),
        'likelihood': args.likelihood,
        'shaping_factor': args.shaping_factor if args.likelihood == 'glue' else None,
        'seed': args.seed,
        'initial': initial,
        'settle_s': settle,
        'records': [
            {
                'source': r.source,
                'samples': len(r),
                'rate_hz': r.rate,
                'stiffness_n_per_m': r.stiffness,
                'hold': r.hold,
            }
            for r in records
        ],
    }
    write_json(content, args.json)
    return 1 if wrong else 0


def _parameters(model: ModelChoice, chains: Chains) -> dict[str, dict[str, Any]]:
    import arviz as az
    import numpy as np

    from actuator_glue.inference.moments import moments

    lower, upper = model.bounds
    found = moments(chains.posterior(), lower, upper)
    # arviz wants (chain, draw, parameter).
    kept = np.swapaxes(chains.kept, 0, 1)
    data = az.convert_to_dataset({'theta': kept})
    rhat, ess = az.rhat(data)['theta'].values, az.ess(data)['theta'].values
    return {
        name: {
            'mean': float(found.mean[i]),
            'stddev': float(found.stddev[i]),
            'skewness': float(found.skewness[i]),
            'cov': float(found.cov[i]),
            'rhat': float(rhat[i]),
            'ess': float(ess[i]),
            'best': float(chains.best[i]),
            'unit': unit,
            'bounds': [float(lower[i]), float(upper[i])],
            'prior_dominated': bool(found.prior_dominated[i]),
        }
        for i, (name, unit) in enumerate(zip(model.names, model.units, strict=True))
    }


def _show(
    args: argparse.Namespace,
    records: list[Record],
    parameters: dict[str, dict[str, Any]],
    chains: Chains,
    fit: dict[str, Any],
    seconds: float,
) -> None:
    prior = any(p['prior_dominated'] for p in parameters.values())
    rows = [
        (
            name,
            p['unit'],
            f'{p["mean"]:.5g}',
            f'{p["stddev"]:.3g}',
            f'{p["skewness"]:.2f}',
            f'{p["cov"]:.3g}',
            f'{p["rhat"]:.4f}',
            f'{p["ess"]:.0f}',
            *(['prior' if p['prior_dominated'] else ''] if prior else []),
        )
        for name, p in parameters.items()
    ]
    columns = ['parameter', 'unit', 'mean', 'sd', 'skew', 'COV', 'R-hat', 'ESS']
    columns += ['mostly'] * prior
    how = f'G = {args.shaping_factor:g}' if args.likelihood == 'glue' else args.likelihood
    table(f'Posterior moments, {len(records)} record(s), {how}', columns, rows, args)
    percent = '-' if fit['nrmse'] is None else f'{100 * fit["nrmse"]:.2f} %'
    say(
        f'error of the best draw: {1e3 * fit["rms_m"]:.4g} mm rms, {percent} of the spread '
        'measured',
        args,
    )
    say(f'{chains.evaluations} evaluations in {seconds:.1f} s', args)


def _save_draws(
    out: str, chains: Chains, parameters: dict[str, dict[str, Any]], effects: list[str], how: str
) -> None:
    import numpy as np

    try:
        with Path(out).open('wb') as file:
            np.savez_compressed(
                file,
                draws=chains.posterior(),
                best=chains.best,
                names=np.array(list(parameters)),
                units=np.array([p['unit'] for p in parameters.values()]),
                effects=np.array(effects, dtype=np.str_),
                definitions=np.array(json.dumps(definitions(effects).get('definitions', {}))),
                initial=np.array(how),
            )
    except OSError as error:
        raise InputError(f'{out}: cannot be written ({error.strerror or error})') from error
