"""The study as JSON, `actuator_glue.reproduction/1`, SI units."""

from __future__ import annotations

from typing import Any

import numpy as np

from actuator_glue import __version__
from actuator_glue.inference.moments import Moments
from actuator_glue.inference.scores import Scores
from actuator_glue.model.parameters import BASE, NAMES, TABLE_2
from actuator_glue.model.problem_r import EQUATION_3, NOISE, STIFFNESS
from actuator_glue.records import Array
from actuator_glue.reproduction.identify import NAMES as COEFFICIENTS
from actuator_glue.reproduction.posterior import Posterior
from actuator_glue.reproduction.published import SOURCE, TABLE_4, Table4
from actuator_glue.reproduction.study import Results

SCHEMA = 'actuator_glue.reproduction/1'
Json = dict[str, Any]


def to_json(results: Results) -> Json:
    """Return the study's numbers, SI units; arrays are left for the writer to turn into lists."""
    spread = results.table_4
    return {
        'schema': SCHEMA,
        'version': __version__,
        'source': SOURCE,
        'seed': results.seed,
        'quick': results.quick,
        'sensor_noise': NOISE,
        'parameters': [{'name': p.name, 'unit': p.unit} for p in BASE],
        'tests': [
            {
                'stiffness': stiffness,
                'readings': [
                    {
                        'frequency_hz': r.frequency_hz, 'amplitude': r.amplitude,
                        'phase': r.phase, 'delay': r.delay,
                        'expected_amplitude': abs(r.expected),
                        'expected_phase': float(np.angle(r.expected)),
                    }
                    for r in results.readings[test]
                ],
                'transfer_function': {
                    kind: {
                        'coefficients': dict(zip(COEFFICIENTS, fits[test].value, strict=True)),
                        'published': dict(zip(COEFFICIENTS, EQUATION_3[test], strict=True)),
                        'limits_95': fits[test].limits(),
                        'static_gain': fits[test].static_gain,
                        'rms': fits[test].rms,
                    }
                    for kind, fits in results.identified.items()
                },
                'coverage_near_close_ups': {
                    kind: bands[test].near for kind, bands in results.time.items()
                },
                'scores': {
                    kind: [_scores(s) for s in bands[test].scores]
                    for kind, bands in results.time.items()
                },
                'frequency_coverage': {
                    kind: {' '.join(key): share for key, share in bands[test].coverage.items()}
                    for kind, bands in results.frequency.items()
                },
            }
            for test, stiffness in enumerate(STIFFNESS)
        ],
        'physical_fit': {
            'theta': _named(results.physical.theta),
            'stddev': _named(results.physical.stddev),
            'table_2': _named(TABLE_2),
            'rms': results.physical.rms,
            'table_2_rms': results.physical.table_2_rms,
        },
        'posteriors': {name: _posterior(p) for name, p in results.posteriors.items()},
        'table_4': {
            'published': _moments(TABLE_4),
            'matched_rms': spread.matched.best_rms,
            'mean_matched_rms': spread.mean_rms,
            'skewness_matched_rms': spread.skewness_rms,
            'cov_difference': _named(spread.difference),
            'at_equivalent_shaping_factor': _posterior(spread.literal),
        },
        'residual_structures': [
            {'name': s.name, **_posterior(s.posterior)} for s in results.structures
        ],
        'shaping_factors': {
            kind: [
                {
                    **_posterior(s.ours),
                    'evaluations_to_rhat_1_2': s.ours_trace.converged_at(),
                    'evaluations_to_rhat_1_2_published': s.published_trace.converged_at(),
                    'held_out_coverage': s.held_out,
                    'mean_width': s.width,
                    'converged': s.converged,
                    'informative': s.informative,
                }
                for s in entries
            ]
            for kind, entries in results.shaped.items()
        },
        'shaping_factor_choice': {
            kind: {'shaping_factor': c.shaping_factor, 'reason': c.reason, 'covers': c.covers}
            for kind, c in results.choices.items()
        },
        'static_gain': [
            {
                'structure': r.name, 'tests': r.tests, 'theta': r.theta, 'gain': r.gain,
                'rms_fitted': r.fitted, 'rms_held_out': r.held_out,
            }
            for r in results.refits
        ],
        'diagnosis': {
            name: {key: d.to_json()[key] for key in ('verdict', 'summary', 'effects', 'error')}
            for name, d in results.diagnoses.items()
        },
        'simulated_coverage': [
            {'glue': c.glue, 'total': c.total, 'phi': c.phi, 'noise': c.noise}
            for c in results.covered
        ],
    }  # fmt: skip


def _scores(s: Scores) -> Json:
    return {
        'low_hz': s.low_hz, 'high_hz': s.high_hz, 'samples': s.samples, 'level': s.level,
        'coverage': s.coverage, 'mean_width': s.mean_width, 'crps': s.crps,
        'interval_score': s.interval_score,
    }  # fmt: skip


def _named(values: Array) -> dict[str, float]:
    return {name: float(value) for name, value in zip(NAMES, values, strict=True)}


def _moments(moments: Moments | Table4) -> Json:
    return {
        'mean': _named(moments.mean),
        'stddev': _named(moments.stddev),
        'skewness': _named(moments.skewness),
        'cov': _named(moments.cov),
    }


def _posterior(p: Posterior) -> Json:
    return {
        'shaping_factor': p.shaping_factor,
        'residual_rms': p.best_rms,
        'added_rms': p.added_rms,
        'evaluations': p.chains.evaluations,
        'rhat': _named(p.chains.rhat),
        'ess': _named(p.chains.ess),
        **_moments(p.moments),
        'stddev_over_prior': _named(p.prior_share()),
    }
