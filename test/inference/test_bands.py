"""Quantile bands of simulated draws."""

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.inference.bands import COLUMNS_AT_ONCE, band


def test_band_of_few_draws_covers_a_further_draw_with_its_level(rng_seed: int) -> None:
    # 40 draws and 40 000 exchangeable columns: coverage of each column is independent, so its
    # mean has sd sqrt(0.95 0.05/40000) = 0.0011; 4.5 sd is a false-failure rate of 7e-6.
    rng = np.random.default_rng(rng_seed)
    everything = rng.gumbel(size=(41, 40_000))
    limits = band(everything[:-1], [0.8, 0.95])
    for level in (0.8, 0.95):
        lower, upper = limits.at(level)
        inside = np.mean((everything[-1] >= lower) & (everything[-1] <= upper))
        assert abs(inside - level) < 4.5 * np.sqrt(level * (1 - level) / 40_000)


def test_columns_taken_in_blocks_change_nothing() -> None:
    draws = np.random.default_rng(5).normal(size=(12, COLUMNS_AT_ONCE + 7))
    whole = band(draws, [0.6])
    for column in (0, COLUMNS_AT_ONCE - 1, COLUMNS_AT_ONCE, COLUMNS_AT_ONCE + 6):
        alone = band(draws[:, [column]], [0.6])
        assert whole.lower[0, column] == alone.lower[0, 0]
        assert whole.upper[0, column] == alone.upper[0, 0]
    assert len(whole) == COLUMNS_AT_ONCE + 7
    assert len(whole.slice(2, 6)) == 4


@pytest.mark.parametrize(
    ('draws', 'keywords', 'says'),
    [
        (np.zeros(5), {}, 'two draws'),
        (np.zeros((1, 5)), {}, 'two draws'),
        (np.array([[0.0], [np.nan]]), {}, 'draw 1 is not finite'),
        (np.zeros((3, 2)), {'levels': [95.0]}, 'between 0 and 1'),
        (np.zeros((3, 2)), {'levels': []}, 'no band level is given'),
    ],
)
def test_unusable_input_says_what_is_wrong(draws, keywords, says) -> None:
    with pytest.raises(InputError, match=says):
        band(draws, **keywords)


def test_level_that_was_not_computed() -> None:
    with pytest.raises(InputError, match=r'not 0\.5'):
        band(np.zeros((3, 2))).at(0.5)
