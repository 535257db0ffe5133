"""Messages to the estimator's types and back, for live nodes and for bags alike.

Nothing here imports ROS: rclpy's messages and those read from a bag have the same attributes.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import FEWEST, Carried
from actuator_glue.inference.choice import ModelChoice, choose_model
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.online.forecast import WindowPrediction
from actuator_glue.online.job import WindowResult
from actuator_glue.online.knowledge import Known
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import (
    Preview,
    structure_effects,
    structure_name,
    structure_weights,
)
from actuator_glue.online.structures import Proposal
from actuator_glue.online.window_posterior import ARCHIVE, spread
from actuator_glue.records import Array
from actuator_glue.sample_block import stamp_ns

Fields = dict[str, Any]
Weights: TypeAlias = tuple[tuple[frozenset[str], float], ...]
_NAN = float('nan')
# Draws of a window's posterior in a message: those that the next window begins with, so that a
# replay can continue after missing samples.
DRAWS = ARCHIVE


class Head(NamedTuple):
    """What goes into a std_msgs/Header."""

    stamp_ns: int
    frame_id: str


def preview(message: Any) -> Preview:
    """Return the commands of a CommandPreview, unchecked."""
    return Preview(int(message.index), float(message.period), _array(message.command))


def proposal(message: Any) -> ModelChoice | Proposal:
    """Return what is carried by an EstimatorSetup; registers the effects that it defines.

    Raises:
        InputError: settings that cannot be read, or a model that the catalogue does not have.
    """
    leading = model_choice(message)
    try:
        carries = json.loads(message.settings).get('structures')
    except (ValueError, AttributeError) as error:
        raise InputError(f'EstimatorSetup: the model cannot be read ({error})') from error
    return leading if carries is None else Proposal.from_json(carries, 'EstimatorSetup')


def model_choice(message: Any) -> ModelChoice:
    """Return the model whose parameters an EstimatorSetup lists.

    Raises:
        InputError: its fields contradict each other, or are not JSON.
    """
    try:
        values = json.loads(message.settings)
        start, defined = values.get('start') or (), values.get('definitions')
        names = list(message.parameter_names)
        box = {
            name: (float(lower), float(upper))
            for name, lower, upper in zip(names, message.lower, message.upper, strict=True)
        }
        places = zip(names, start, strict=True) if start else ()
        begin = {name: _NAN if value is None else float(value) for name, value in places}
    except (ValueError, TypeError, AttributeError) as error:
        raise InputError(f'EstimatorSetup: the model cannot be read ({error})') from error
    if defined:
        CATALOGUE.define(defined, 'EstimatorSetup')
    return choose_model(list(message.effects), box, begin)


def estimator_settings(message: Any) -> EstimatorSettings:
    """Return the settings of an EstimatorSetup.

    Raises:
        InputError: they cannot be read.
    """
    return EstimatorSettings.from_json(message.settings, 'EstimatorSetup')


def carried(message: Any) -> Carried | None:
    """Return the draws that the priors of an EstimatorSetup began with, if any.

    Raises:
        InputError: they cannot be read.
    """
    try:
        value = json.loads(message.settings).get('carried')
    except (ValueError, AttributeError) as error:
        raise InputError(f'EstimatorSetup: the prior cannot be read ({error})') from error
    return None if value is None else Carried.from_json(value, 'EstimatorSetup')


def estimator_setup(
    settings: EstimatorSettings,
    model: ModelChoice | Proposal,
    window: int,
    index: int,
    carried: Carried | None = None,
) -> Fields:
    """Return the fields of an EstimatorSetup but its header.

    Args:
        settings: settings of the estimator.
        model: model it goes on with, or several structures.
        window: number of the first window it holds for.
        index: running index of that window's first sample.
        carried: draws that the priors begin with, where there are any.
    """
    # Definitions of the user's own effects go along: the bag alone is enough for a replay.
    proposed = Proposal.of(model)
    model = proposed.structures[0].model
    names = dict.fromkeys(n for one in proposed.structures for n in one.model.effects)
    more = CATALOGUE.definitions(tuple(names))
    if carried is not None:
        more = {**more, 'carried': carried.to_json()}
    if not proposed.plain:
        more = {**more, 'structures': proposed.to_json()}
    start = [None if np.isnan(v) else v for v in model.start]
    return {
        'index': index,
        'window': window,
        'window_length': settings.window,
        'hop': settings.hop,
        'shaping_factor': settings.shaping_factor if settings.likelihood == 'glue' else _NAN,
        'seed': settings.seed,
        'effects': list(model.effects),
        'parameter_names': list(model.names),
        'units': list(model.units),
        'lower': list(model.lower),
        'upper': list(model.upper),
        'settings': json.dumps({**asdict(settings), 'start': start, **more}),
    }


def posterior(result: WindowResult, seconds: float) -> tuple[Head, Fields]:
    """Return header and fields of a PosteriorMoments.

    Args:
        result: a result that has a posterior.
        seconds: time the window took [s].
    """
    moments, record = result.moments, result.window.record
    assert moments is not None and result.rhat is not None and result.ess is not None
    assert result.best is not None
    fields: Fields = {
        'window': result.window.number,
        'index': record.first_index,
        'samples': len(record),
        'period': record.period,
        'effects': list(result.model.effects),
        'parameter_names': list(result.model.names),
        'units': list(result.model.units),
        'mean': moments.mean,
        'stddev': moments.stddev,
        'skewness': moments.skewness,
        'cov': moments.cov,
        'best': result.best,
        'rhat': result.rhat,
        'ess': result.ess,
        'prior_dominated': [bool(flag) for flag in result.prior_dominated],
        'rhat_max': float(result.rhat.max()),
        'ess_min': float(result.ess.min()),
        'rms_error': result.rms_error,
        'nrmse': result.nrmse,
        'shaping_factor': result.shaping_factor,
        'evaluations': result.evaluations,
        'seconds': seconds,
        'converged': result.converged,
        'stopped_early': result.stopped_early,
        'structures': [structure_name(effects) for effects in result.structures],
        'weights': list(result.weights),
        'structure_evaluations': list(result.spent),
        **_if_true(result),
    }
    for name, mean, stddev in zip(result.model.names, moments.mean, moments.stddev, strict=True):
        if name in ('beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3'):
            fields[f'{name}_mean'] = float(mean)
            fields[f'{name}_stddev'] = float(stddev)
    return Head(record.stamp_ns(len(record) - 1), record.actuator), fields


def _if_true(result: WindowResult) -> Fields:
    """Return the fields of each structure's own posterior; empty for a structure without one."""
    parts = [part for part in result.parts if part is not None]
    empty = np.empty(0)
    return {
        'structure_sizes': [0 if part is None else len(part[0].names) for part in result.parts],
        'structure_parameter_names': [name for model, _ in parts for name in model.names],
        'structure_units': [unit for model, _ in parts for unit in model.units],
        'structure_mean': np.concatenate([empty, *(one.mean for _, one in parts)]),
        'structure_stddev': np.concatenate([empty, *(one.stddev for _, one in parts)]),
    }


def draws(result: WindowResult) -> tuple[Head, Fields]:
    """Return header and fields of a PosteriorDraws: some draws, evenly spread over the posterior.

    Args:
        result: a result that has a posterior.
    """
    assert result.draws is not None and result.ess is not None
    record, posterior = result.window.record, result.draws
    rows = spread(len(posterior), DRAWS)
    fields: Fields = {
        'window': result.window.number,
        'effects': list(result.model.effects),
        'parameter_names': list(result.model.names),
        'values': posterior[rows].ravel(),
        'ess_min': float(result.ess.min()),
        'converged': result.converged,
    }
    return Head(record.stamp_ns(len(record) - 1), record.actuator), fields


def weights(message: Any) -> Weights:
    """Return effects and weight of each structure of a PosteriorMoments, the likeliest first.

    Raises:
        InputError: not as many weights as structures.
    """
    return tuple(
        (frozenset(structure_effects(name)), weight) for name, weight in structure_weights(message)
    )


def weighed(found: Weights) -> str:
    """Return structures and their weights as text."""
    return ', '.join(f'{structure_name(sorted(name))} {weight:.0%}' for name, weight in found)


def known(message: Any, settings: EstimatorSettings) -> Known | None:
    """Return the posterior of a PosteriorDraws, and when its samples were taken.

    None for a window that was cut so short that its draws say nothing.

    Raises:
        InputError: the draws cannot be used.
    """
    names = tuple(message.parameter_names)
    draws = _array(message.values).reshape(-1, max(len(names), 1))
    if len(draws) < FEWEST:
        return None
    last = stamp_ns(message.header)
    middle = last - round(0.5e9 * (settings.window - settings.settle))
    since = settings.window - 1e-9 * (last - middle)
    return Known(Carried(names, draws).later(since), middle, last)


def prediction(result: WindowPrediction, actuator: str) -> tuple[Head, Fields]:
    """Return header and fields of a PredictionBand."""
    band, scored = result.band, result.coverage is not None
    fields: Fields = {
        'window': result.number,
        'index': result.index,
        'period': result.period,
        'kind': result.kind,
        # Parameters are always frozen before the samples they are compared with.
        'forecast': True,
        'scored': scored,
        'levels': band.levels,
        'lower': band.lower.ravel(),
        'median': band.median,
        'upper': band.upper.ravel(),
        'coverage': result.coverage if result.coverage is not None else np.empty(0),
        'width': result.width,
        'widest_level': float(band.levels[-1]),
        'widest_coverage': float(result.coverage[-1]) if result.coverage is not None else _NAN,
        'widest_width': float(result.width[-1]),
        'rms_error': result.rms_error,
        'first_lower': float(band.lower[-1, 0]),
        'first_median': float(band.median[0]),
        'first_upper': float(band.upper[-1, 0]),
    }
    return Head(result.stamp_ns, actuator), fields


def response(result: WindowResult) -> tuple[Head, Fields]:
    """Return header and fields of a FrequencyResponseBand."""
    found, record = result.response, result.window.record
    assert found is not None
    head, amplitude, phase, delay = found.headline
    fields: Fields = {
        'window': result.window.number,
        'frequency': found.frequency,
        'levels': found.amplitude.levels,
        'amplitude_lower': found.amplitude.lower.ravel(),
        'amplitude_median': found.amplitude.median,
        'amplitude_upper': found.amplitude.upper.ravel(),
        'phase_lower': found.phase.lower.ravel(),
        'phase_median': found.phase.median,
        'phase_upper': found.phase.upper.ravel(),
        'headline_frequency': head,
        'headline_amplitude': amplitude,
        'headline_phase': phase,
        'headline_delay': delay,
    }
    return Head(record.stamp_ns(len(record) - 1), record.actuator), fields


def _array(values: Iterable[float]) -> Array:
    return np.asarray(values, dtype=np.float64)
