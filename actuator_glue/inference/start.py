"""Where chains start: annealed from the prior or an earlier run, if need be anew."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.errors import InputError
from actuator_glue.inference.adaptation import empty_counts
from actuator_glue.inference.anneal import (
    Points,
    Population,
    anneal,
    archive_reference,
    prior_reference,
)
from actuator_glue.inference.evaluate import LogDensity, check_values, evaluate
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.transforms.log import Log
from actuator_glue.records import Array

_STARTS = 3  # searches at most


def population(
    rng: np.random.Generator,
    log_density: LogDensity,
    box: Log,
    settings: SamplerSettings,
    archive: ArrayLike | None,
    limit: int | None,
) -> Population:
    """Return the points that become the first archive and the chains' starts.

    Args:
        rng: the only source of randomness.
        log_density: log likelihood (m,) of points (m, p) in physical units.
        box: bounds.
        settings: see `SamplerSettings`.
        archive: points (m, p) of an earlier run, for a warm start.
        limit: evaluations at most.

    Raises:
        InputError: archive or log density cannot be used.
    """
    d, old = len(box.low), None
    if archive is not None:
        old = box.forward(_check_archive(np.asarray(archive, np.float64), box))
    elif settings.start == 'prior':
        # As Vrugt (2016): only the chains' own points are evaluated.
        reference = prior_reference(rng, settings.points(d), box)
        x, _ = box.inverse(reference.points)
        values = np.full(len(x), np.nan)
        values[: settings.chains] = evaluate(log_density, x[: settings.chains])
        check_values(values, x)
        counts = empty_counts(settings)
        points = Points(reference.points, x, values)
        return Population(points, points, counts, 1.0, settings.chains)
    size, spent = settings.points(d) // (1 if old is None else 4), 0
    for left in reversed(range(_STARTS)):
        if old is None:
            reference = prior_reference(rng, size, box)
        else:
            reference = archive_reference(rng, size, old, box)
        most = None if limit is None else limit - spent
        found = anneal(rng, log_density, box, reference, settings, most, last=left == 0)
        spent += found.evaluations
        # A limit ends this only where no other start fits: a shorter run begins as a longer one.
        if not found.collapsed or (limit is not None and spent + size > limit):
            break
    return found._replace(evaluations=spent)


def _check_archive(archive: Array, box: Log) -> Array:
    if archive.ndim != 2 or archive.shape[1] != len(box.low) or len(archive) < 2:
        raise InputError(
            f'the archive for a warm start has shape {archive.shape}; '
            f'it must hold at least two points of {len(box.low)} parameters'
        )
    inside = ((archive >= box.low) & (archive <= box.low + box.width)).all(axis=1)
    if inside.sum() < 2:
        raise InputError('the archive for a warm start lies outside the prior bounds')
    return archive if inside.all() else archive[inside]
