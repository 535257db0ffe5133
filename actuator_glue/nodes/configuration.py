"""Parameters and requests of the estimator node as settings and models."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.api.calibration_result import Calibration
from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import ModelChoice, choose_model
from actuator_glue.inference.informative_prior import informative_prior
from actuator_glue.nodes import own_effects
from actuator_glue.nodes.parameters import Spec
from actuator_glue.online.knowledge import Known
from actuator_glue.online.settings import CHOICES, LIMITS, EstimatorSettings
from actuator_glue.online.structures import MATERIALS, Proposal, Proposed, spreads


def _specs() -> list[Spec]:
    """Parameters from the settings' own table, so that neither can drift from the other."""
    defaults = EstimatorSettings()
    specs = []
    for field in fields(EstimatorSettings):
        limit = LIMITS.get(field.name)
        if limit is None:
            continue
        value = getattr(defaults, field.name)
        specs.append(
            Spec(field.name, value, limit.meaning, limit.unit, limit.lower, limit.upper, True)
        )
    return specs


SPECS = (
    *_specs(),
    Spec('likelihood', 'glue', 'likelihood', read_only=True, choices=CHOICES['likelihood']),
    Spec(
        'prior',
        'box',
        'what is known before a window: bounds only, a calibration, or all earlier samples',
        read_only=True,
        choices=CHOICES['prior'],
    ),
    Spec('calibration', '', 'file of `calibrate --save` that priors begin with', read_only=True),
    Spec('drift_of', [''], 'drift of single parameters, NAME=RATE each', read_only=True),
    Spec(
        'contradiction',
        'widen',
        'what follows when samples contradict the prior',
        read_only=True,
        choices=CHOICES['contradiction'],
    ),
    Spec('levels', list(EstimatorSettings().levels), 'probability of each band', read_only=True),
    Spec(
        'tracking_frequencies',
        [1.0, 5.0, 10.0],
        'where delay and amplitude of the actuator are told [Hz]',
        read_only=True,
    ),
    Spec('effects', [''], 'effects of the catalogue beyond Eq. (2)', read_only=True),
    own_effects.SPEC,
)


def effects(values: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the effects that are asked for."""
    # ROS cannot declare an empty list of strings with its type, so an empty word stands for it.
    return tuple(name for name in values['effects'] if name)


def tracking_frequencies(values: Mapping[str, Any]) -> tuple[float, ...]:
    """Return the frequencies at which delay and amplitude are told [Hz].

    Raises:
        InputError: there is none, or one that is not positive and finite.
    """
    found = tuple(float(f) for f in values['tracking_frequencies'])
    if not found or not all(0.0 < f < math.inf for f in found):
        raise InputError(
            f'tracking_frequencies {list(found)} must be positive and finite [Hz]; give at least '
            'one'
        )
    return found


def settings(values: Mapping[str, Any]) -> EstimatorSettings:
    """Return the settings among a node's parameters.

    Raises:
        InputError: they contradict each other.
    """
    known = {f.name for f in fields(EstimatorSettings)}
    return EstimatorSettings.from_mapping({n: v for n, v in values.items() if n in known})


@lru_cache(maxsize=1)
def _carried(path: str, changed_ns: int) -> Carried:
    """Return the draws of a file; parameters are checked far more often than it changes."""
    return Calibration.load(path).carried()


def carried(values: Mapping[str, Any]) -> Carried | None:
    """Return the draws that priors begin with; None where they begin with the box.

    Raises:
        InputError: a calibration that is missing or is not used, a file that holds none, or draws
            outside the bounds.
    """
    mode, path = values['prior'], values['calibration']
    if not path:
        if mode == 'calibration':
            raise InputError("prior 'calibration' needs the file: calibration:=FILE")
        return None
    if mode == 'box':
        raise InputError(f"calibration {path} is not used with prior 'box'")
    try:
        changed_ns = Path(path).stat().st_mtime_ns
    except OSError:
        changed_ns = 0  # `load` says what is wrong
    found = _carried(path, changed_ns)
    model = choose_model(effects(values))
    informative_prior(found, model.names, model.lower, model.upper, None)
    return found


def requested(request: Any) -> Proposal:
    """Return the structures that a SetModel request names.

    One without structures is a way out of whatever was carried before: it begins with what the
    node was started with.

    Raises:
        InputError: unknown effects or parameters, one that is named twice, lists that do not
            belong together, a material error no test has, draws that no prior can be made of.
    """
    if not request.structures:
        return Proposal((Proposed(_model(request)),), afresh=True)
    structures = []
    for one in request.structures:
        model, known = _model(one), _known(one)
        if known is not None:
            _check_spread(model, known)
        structures.append(Proposed(model, float(one.weight), known))
    return Proposal(tuple(structures), _material(float(request.material)))


def _material(value: float) -> float:
    """Return the smallest forecast error that matters [m]; NaN where none was given.

    Raises:
        InputError: it is outside of what a test can have.
    """
    if value == 0.0 or math.isnan(value):
        return math.nan
    least, most = MATERIALS
    if not least <= value <= most:
        raise InputError(
            f'material {value:g} m is outside [{least:g}, {most:g}] m; give 0 for half of the '
            'sensor noise'
        )
    return value


def _model(named: Any) -> ModelChoice:
    """Return the model of a SetModel request or of one of its structures."""
    names = list(named.parameter_names)
    lower, upper, start = list(named.lower), list(named.upper), list(named.start)
    if not len(names) == len(lower) == len(upper) or len(start) not in (0, len(names)):
        raise InputError(
            f'{len(names)} parameter names, {len(lower)} lower, {len(upper)} upper bounds and '
            f'{len(start)} starting values do not belong together'
        )
    _once(names, 'parameter_names')
    bounds = {n: (lo, up) for n, lo, up in zip(names, lower, upper, strict=True)}
    places = dict(zip(names, start, strict=True)) if start else None
    return choose_model(tuple(named.effects), bounds, places)


def _known(structure: Any) -> Known | None:
    """Return what a ModelProposal says is known of its parameters."""
    names = tuple(structure.known_names)
    if not names:
        return None
    _once(names, 'known_names')
    draws = np.asarray(structure.known, np.float64)
    if draws.size % len(names):
        raise InputError(f'{draws.size} numbers are no draws of {len(names)} parameters')
    carried = Carried(names, draws.reshape(-1, len(names)))
    return Known(carried, int(structure.known_middle), int(structure.known_last))


def _check_spread(model: ModelChoice, known: Known) -> None:
    """Check that the draws of each parameter differ: a prior is made of how they scatter.

    Raises:
        InputError: those of a parameter within its bounds are all the same.
    """
    names, draws = known.carried.names, known.carried.draws
    at = [i for i, name in enumerate(names) if name in model.names]
    places = [model.names.index(names[i]) for i in at]
    low, high = np.array(model.lower)[places], np.array(model.upper)[places]
    # What lies outside of the bounds is left out of the prior.
    inside = draws[((draws[:, at] >= low) & (draws[:, at] <= high)).all(axis=1)][:, at]
    if not len(inside):
        return  # refused with the bounds
    alike = [names[i] for i, column in zip(at, inside.T, strict=True) if not spreads(column)]
    if alike:
        raise InputError(
            f'the known draws of {", ".join(alike)} are all the same; give draws that say how '
            'well it is known, or leave it out'
        )


def _once(names: Sequence[str], where: str) -> None:
    """Check that no parameter is named twice: which of its numbers counts would be a guess.

    Raises:
        InputError: one is.
    """
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f'{where} holds {", ".join(twice)} more than once; name each once')
