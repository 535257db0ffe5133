"""Everything of `actuator_glue` that the study's computations use, gathered in one place.

The public names where they offer it; the paper's own steps (its likelihood on residuals that are
added, its sampler, bands of draws) are below them.
"""

from __future__ import annotations

from actuator_glue import Diagnosis, InputError, Record, diagnose
from actuator_glue.inference.bands import Band, band, check_draws
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.likelihood import Errors, GlueLikelihood
from actuator_glue.inference.moments import Moments, moments
from actuator_glue.inference.posterior import Target, sample
from actuator_glue.inference.predictive import fit_residual, predictive_draws, total_band
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.model import commands, linear
from actuator_glue.model.exact import ExactErrors
from actuator_glue.model.parameters import BASE, NAMES, TABLE_2, bounds
from actuator_glue.model.reference_problem import EQUATION_3, NOISE, RATE, STIFFNESS
from actuator_glue.model.reference_problem import records as reconstructed_tests
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

__all__ = [
    'BASE',
    'EQUATION_3',
    'NAMES',
    'NOISE',
    'RATE',
    'STIFFNESS',
    'TABLE_2',
    'Array',
    'Band',
    'Chains',
    'Diagnosis',
    'Errors',
    'ExactErrors',
    'GlueLikelihood',
    'InputError',
    'Moments',
    'Record',
    'SamplerSettings',
    'Structure',
    'Target',
    'band',
    'bounds',
    'check_draws',
    'commands',
    'diagnose',
    'fit_residual',
    'linear',
    'moments',
    'predictive_draws',
    'reconstructed_tests',
    'sample',
    'total_band',
]
