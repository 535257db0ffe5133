"""Every figure of the report: no text over another, none beyond the page."""

import pytest

from actuator_glue.model.parameters import TABLE_2
from actuator_glue.reproduction.figures import bands, misfit, shaping, spread, tests
from actuator_glue.reproduction.pages.bands import NAMES
from actuator_glue.reproduction.pages.shaping import KINDS
from actuator_glue.reproduction.responses import simulate
from actuator_glue.reproduction.study import Results, study


@pytest.fixture(scope='module')
def results() -> Results:
    return study(2, quick=True)


def test_figures_are_legible(results: Results, overlapping_texts) -> None:
    figures = {
        'Fig. 5': shaping.chains(results.shaped['matched']),
        'Fig. 6': shaping.convergence(results.shaped['matched']),
        'spread against G': shaping.spread_against_g(results.shaped, KINDS),
        'Table 4': spread.against_residual(results.table_4, results.sensor.best_rms),
        'pairs': spread.correlations(results.table_4.matched.thinned(500)),
        'Fig. 7': bands.frequency_response(results.frequency, results.curves),
        'coverage': bands.coverage_by_frequency(results.time, NAMES),
        'misfit': misfit.residual_by_frequency(results.records, results.refits, 2e-5),
    }
    for test in (0, 1):
        record = results.records[test]
        figures |= {
            f'Fig. {3 + test}': tests.command_and_measured(record),
            f'Fig. {8 + test}': bands.displacement(
                record,
                results.time['matched'][test],
                results.time['total'][test],
                simulate(TABLE_2[None], record)[0],
            ),
            f'Fig. {10 + test}': bands.histograms(
                results.frequency['matched'][test], results.curves[test]
            ),
        }
    problems = {name: overlapping_texts(figure) for name, figure in figures.items()}
    assert not {name: found for name, found in problems.items() if found}
