"""The picture of a posterior."""

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.report.posterior_figure import posterior_figure

NAMES = ('beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3')
UNITS = ('1/s', 'N/(m s^2)', 'N/m', '1/s')


def test_every_pair_is_there_and_nothing_overlaps(overlapping_texts) -> None:
    """One panel per pair, correlations above the diagonal, texts apart."""
    rng = np.random.default_rng(0)
    draws = np.array([133.0, 1.1e9, 2.5e5, 6e-5]) * (1 + 0.01 * rng.standard_normal((2000, 4)))
    draws[:, 1] = 8e6 * draws[:, 0]
    figure = posterior_figure(draws, NAMES, UNITS)
    texts = [t.get_text() for axes in figure.axes for t in axes.texts]
    assert len(figure.axes) == 16
    assert len(texts) == 6
    assert texts[0] == '1.00'
    assert overlapping_texts(figure) == []


def test_one_parameter_and_draws_that_cannot_be_drawn() -> None:
    """One parameter is a histogram; wrong shapes and NaN are refused."""
    assert len(posterior_figure(np.arange(9.0)[:, None], ('a',), ('1',)).axes) == 1
    with pytest.raises(InputError, match='shape'):
        posterior_figure(np.zeros((5, 3)), NAMES, UNITS)
    with pytest.raises(InputError, match='NaN'):
        posterior_figure(np.full((5, 4), np.nan), NAMES, UNITS)
