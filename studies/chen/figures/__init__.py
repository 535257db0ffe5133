"""The paper's figures drawn from our numbers, each under the name that the prose calls it by."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from matplotlib.figure import Figure

from studies.chen.figures import bands, chains, residuals, sweeps
from studies.chen.study import Results

FIGURES: dict[str, Callable[[Results], Figure]] = {
    'sweep_0': partial(sweeps.command_and_measured, test=0),
    'sweep_1': partial(sweeps.command_and_measured, test=1),
    'chains': chains.chains,
    'convergence': chains.convergence,
    'spread_against_g': chains.spread_against_g,
    'spread_against_residual': residuals.spread,
    'matched_posterior': residuals.matched_posterior,
    'frequency_response': bands.frequency_response,
    'displacement_0': partial(bands.displacement, test=0),
    'displacement_1': partial(bands.displacement, test=1),
    'histograms_0': partial(bands.histograms, test=0),
    'histograms_1': partial(bands.histograms, test=1),
    'coverage_by_frequency': bands.coverage_by_frequency,
    'residual_by_frequency': residuals.by_frequency,
}
