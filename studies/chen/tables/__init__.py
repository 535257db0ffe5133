"""Every table of the study, under the name that the prose calls it by."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from studies.chen.study import Results
from studies.chen.table import StudyTable
from studies.chen.tables import deterministic, predictions, statistics

TABLES: dict[str, Callable[[Results], StudyTable]] = {
    'readings': deterministic.readings,
    'transfer_functions': deterministic.transfer_functions,
    'joint_fit': deterministic.joint_fit,
    'coefficients': deterministic.coefficients,
    'rms': deterministic.rms,
    'refits': deterministic.refits,
    'diagnoses': deterministic.diagnoses,
    'priors': statistics.priors,
    'shaping_sensor': partial(statistics.shaping_factors, kind='sensor'),
    'shaping_matched': partial(statistics.shaping_factors, kind='matched'),
    'choices': statistics.choices,
    'table_4': statistics.table_4,
    'matches': statistics.matches,
    'shapes': statistics.shapes,
    'posteriors': statistics.posteriors,
    'frequency_coverage': predictions.frequency_coverage,
    'displacement_coverage': predictions.displacement_coverage,
    'histograms': predictions.histograms,
    'scores': predictions.scores,
    'simulated_coverage': predictions.simulated_coverage,
}
