"""Sizes as people say them."""

import math

import numpy as np
import pytest

from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.parameters import BASE, TABLE_2
from actuator_glue.report.quantity import percents, plain, said, said_in, spread, word


@pytest.mark.parametrize(
    ('value', 'unit', 'text'),
    [
        (4.1e-5, 'm', '41 um'),
        (-4.12e-4, 'm', '-412 um'),
        (2.5e-3, 'm', '2.5 mm'),
        (0.004, 's', '4 ms'),
        (12.0, 's', '12 s'),
        (950.0, 'N', '950 N'),
        (12_345.0, 'N', '12.3 kN'),
        (238e3, 'N/m', '238 kN/m'),
        (8.78e8, 'N/(m s^2)', '878 kN/(mm s^2)'),
        (1.02, '1', '1.02'),
        (0.0, 'm', '0 um'),
        (math.nan, 'm', 'not known'),
        (1.5, 'furlong', '1.5 furlong'),
    ],
)
def test_a_size_is_said_in_its_own_unit(value: float, unit: str, text: str) -> None:
    """Number and unit are right together."""
    assert said(value, unit) == text


def test_every_unit_of_the_catalogue_keeps_its_value() -> None:
    """The factor and the name of a unit belong together: nothing is a thousand times wrong."""
    in_si = {'u': 1e-6, 'm': 1e-3, 'k': 1e3}

    def size(unit: str) -> float:
        """Return how many SI units one of a unit is."""
        total = 1.0
        for part, sign in zip(
            unit.replace('(', '').replace(')', '').split('/'), (1, -1), strict=False
        ):
            for one in part.split():
                base, _, power = one.partition('^')
                if len(base) > 1 and base not in {'kg', 'Hz'}:
                    total *= in_si[base[0]] ** (sign * int(power or 1))
        return total

    units = {p.unit for e in CATALOGUE.values() for p in e.parameters} | {p.unit for p in BASE}
    for unit in units:
        for value in (1e-9, 1e-4, 0.1, 3.0, 2e3, 1e9):
            factor, name = said_in(unit, value)
            assert factor * size(name) == pytest.approx(1.0), (unit, name)
    assert said_in('m', math.nan, [1e-3, -2e-2])[1] == 'mm'
    assert said(TABLE_2[2], 'N/m').endswith('kN/m')


def test_numbers_are_plain() -> None:
    """Digits that say nothing are left out; powers of ten only where they must be."""
    assert [plain(v) for v in (0.0123, 1234.0, 99.96, 0.5, 2e7)] == [
        '0.0123',
        '1234',
        '100',
        '0.5',
        '2e+07',
    ]


def test_shares_of_a_whole_add_up() -> None:
    """What was 98 % beside 3 % for none of these: together 100."""
    assert percents([0.9751, 0.0249]) == [98, 2]
    assert percents([0.975, 0.025]) in ([98, 2], [97, 3])
    assert percents([0.335, 0.335, 0.33]) in ([34, 33, 33], [33, 34, 33])
    assert percents([0.5, 0.2]) == [50, 20]  # names that are not shown have the rest
    rng = np.random.default_rng(4)
    for count in range(2, 9):
        shares = rng.dirichlet(np.full(count, 0.4))
        told = np.array(percents(shares))
        assert told.sum() == 100
        assert np.abs(told - 100 * shares).max() < 1.0


def test_words_and_intervals() -> None:
    """No key of a program, and one unit for a size and its interval."""
    assert word('alpha_1_beta_0') == '\u03b1\u2081\u03b2\u2080'
    assert word('coulomb_force') == 'coulomb force'
    assert spread(4.25e-5, 4.2e-5, 4.3e-5, 'm') == '42.5 um (42 to 43)'
    assert spread(9e-4, 4e-4, 2e-3, 'm') == '0.9 mm (0.4 to 2)'
