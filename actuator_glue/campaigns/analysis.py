"""The row of one group of records: calibrated, diagnosed, tracked, and its hybrid test judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_glue.campaigns.first_stage import first_stage
from actuator_glue.campaigns.grouping import Task
from actuator_glue.campaigns.rows import BETWEEN, Row
from actuator_glue.errors import InputError
from actuator_glue.io.calendar_time import calendar_time
from actuator_glue.records import Array, Record, source_names
from actuator_glue.whole_file import replaced

if TYPE_CHECKING:
    from actuator_glue.api.calibration_result import Calibration
    from actuator_glue.api.diagnosis import Diagnosis
    from actuator_glue.api.spread import Spread
    from actuator_glue.api.tracking import RecordTracking


def analysed(task: Task, keep: Path, key: str) -> Row:
    """Return the numbers of one group's row.

    Depends on nothing but the files and the recipe: the same to the bit wherever it runs.

    Args:
        task: the files, and what is asked for.
        keep: folder of the campaign, for draws and reports where they are asked for.
        key: name of such files.

    Raises:
        InputError: a record or option that cannot be used.
    """
    from actuator_glue.api.calibration import calibrate

    remarks: list[str] = []
    records = [(r, m.held_out) for m in task.members for r in m.records(remarks.append)]
    fitted = [r for r, held_out in records if not held_out]
    held = [r for r, held_out in records if held_out]
    if not fitted:
        raise InputError(f'{task.group}: every record is held out; none is left to fit')
    for record in fitted:
        record.known_stiffness()
    wanted = task.analysis
    found = calibrate(fitted, **wanted['calibrate'])
    row = {**_described(task, fitted), **_calibrated(found), 'remarks': BETWEEN.join(remarks)}
    called = source_names(r.source for r in fitted)
    stiffest = called[max(fitted, key=Record.known_stiffness).source]
    row |= _tracked(found.tracking, stiffest)
    if wanted['draws']:
        with replaced(_made(keep / 'draws') / f'{key}.npz') as part:
            found.save(part)
        row['draws'] = f'draws/{key}.npz'
    left = found.structure is not None and not found.structure.intervals_hold
    named: Sequence[str] = ()
    if wanted['diagnose'] == 'always' or (wanted['diagnose'] == 'structure' and left):
        diagnosis = _diagnosed(fitted, held, wanted)
        named = diagnosis.model_effects
        row |= _told(diagnosis) | _tracked(diagnosis.tracking, stiffest)
        if wanted['reports']:
            with replaced(_made(keep / 'reports') / f'{key}.html') as part:
                diagnosis.report(part)
            row['report'] = f'reports/{key}.html'
    if wanted.get('partition') is not None:
        row |= judged(found, fitted, named, wanted)
    return row


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _described(task: Task, records: Sequence[Record]) -> Row:
    """Return what the records say of themselves where neither names nor a table did."""
    first = min(records, key=lambda r: r.start_ns)
    started = task.started
    moment = calendar_time(first.start_ns)
    if started is None and moment is not None:
        started = moment.replace(tzinfo=None).isoformat(timespec='seconds')
    if started is None and task.day is not None:
        started = f'{task.day}T00:00:00'
    return {
        'actuator': task.actuator or first.actuator,
        'day': task.day or (None if started is None else started[:10]),
        'specimen': task.specimen,
        'started': started,
        'records': len(records),
        'stiffness_n_per_m': BETWEEN.join(f'{r.known_stiffness():g}' for r in records),
        'duration_s': sum(r.duration for r in records),
    }


def _calibrated(found: Calibration) -> Row:
    left = found.structure
    doubt = left is not None and not left.intervals_hold
    row: Row = {
        'verdict': 'structure' if doubt else 'none',
        'effects': BETWEEN.join(found.effects),
        'error_before_m': found.error.rms_m,
        'error_after_m': found.error.rms_m,
        'noise_m': None if left is None else left.noise_m,
        'structure_m': None if left is None else left.structure_m,
        'converged': found.converged,
        'problems': BETWEEN.join(found.problems),
        'evaluations': found.evaluations,
        'seed': found.seed,
    }
    row |= _quantiles(found.posterior, found.names)
    bounds = {name: p.bounds for name, p in found.parameters.items()}
    row['pooling'] = first_stage(found.posterior, found.names, bounds)
    return row


def _diagnosed(
    records: Sequence[Record], held: Sequence[Record], wanted: Mapping[str, Any]
) -> Diagnosis:
    from actuator_glue.api.diagnosis import diagnose

    seed = wanted['calibrate'].get('seed', 1)
    return diagnose(
        records,
        holdout=held or None,
        seed=seed,
        jobs=1,
        false_alarms=wanted['false_alarms'],
    )


def _told(found: Diagnosis) -> Row:
    row: Row = {
        'verdict': found.outcome,
        'headline': found.summary(),
        'effects': BETWEEN.join(e.name for e in found.effects),
        'alternatives': BETWEEN.join(', '.join(e.alternatives) or '-' for e in found.effects),
        'probabilities': BETWEEN.join(f'{e.probability:.3f}' for e in found.effects),
        'error_before_m': found.error.before,
        'error_after_m': found.error.after,
        'noise_m': found.alarm.noise,
        # Those of the calibration are answered.
        'problems': '' if found.complete else found.summary(),
    }
    row |= _quantiles(found.posterior, found.names)
    row['pooling'] = first_stage(found.posterior, found.names)
    return row


def _quantiles(draws: Array, names: Sequence[str]) -> Row:
    """Return mean and 95 % limits of each column of draws (m, p)."""
    lower, upper = np.quantile(draws, (0.025, 0.975), axis=0)
    row: Row = {}
    for i, name in enumerate(names):
        row[f'{name}_mean'] = float(draws[:, i].mean())
        row[f'{name}_lower'], row[f'{name}_upper'] = float(lower[i]), float(upper[i])
    return row


def _tracked(tracking: Sequence[RecordTracking], source: str) -> Row:
    """Return the tracking numbers of one record; nothing where there are none of it."""
    row: Row = {}
    for of in (t for t in tracking if t.source == source):
        for name, spread in of.predicted.items():
            row |= _limits(name, spread)
        row |= {f'{name}_measured': value for name, value in of.measured.items()}
    return row


def _limits(name: str, of: Spread) -> Row:
    return {f'{name}_mean': of.mean, f'{name}_lower': of.lower, f'{name}_upper': of.upper}


def judged(
    found: Calibration,
    records: Sequence[Record],
    named: Sequence[str],
    wanted: Mapping[str, Any],
) -> Row:
    """Return P(unstable) and delay margin of the recipe's hybrid test.

    Args:
        found: calibration of the records.
        records: those that it was fitted to.
        named: effects that a diagnosis named. Those of a linear loop, a delay say, decide whether
            it is stable: the records are calibrated again with them.
        wanted: `Recipe.analysis`.
    """
    from actuator_glue.api.calibration import calibrate
    from actuator_glue.api.rths import rths
    from actuator_glue.io.partition import parse_partition
    from actuator_glue.model.effects import CATALOGUE

    linear = [n for n in named if n in CATALOGUE and CATALOGUE[n].linear]
    if set(linear) - set(found.effects):
        effects = list(dict.fromkeys([*found.effects, *linear]))
        # With the usual effort: the recipe's may not be enough for more parameters.
        options = {n: v for n, v in wanted['calibrate'].items() if n != 'evaluations'}
        found = calibrate(records, **{**options, 'effects': effects})
    partition = parse_partition(wanted['partition'], wanted['partition_name'])
    stable = rths(partition, found)
    row: Row = {
        'p_unstable': stable.p_unstable.value,
        'p_unstable_upper': stable.p_unstable.upper,
    }
    if stable.margin_s is not None:
        row |= _limits('margin_s', stable.margin_s)
    return row
