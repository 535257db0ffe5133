"""What a user sees without a spell: short texts of results, pictures in a notebook."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.api.compensation import Comparison
from actuator_glue.inference.bands import band
from actuator_glue.report.as_text import LINES, as_text
from actuator_glue.report.html import Note, Table

PNG = b'\x89PNG'


@pytest.fixture(scope='module')
def record() -> ag.Record:
    """Six seconds at 100 Hz."""
    return ag.simulate(ag.Command(rate=100.0, duration=6.0, high=5.0), stiffness=250e3, seed=3)


@pytest.fixture(scope='module')
def posterior(record: ag.Record) -> ag.Calibration:
    """A short calibration."""
    return ag.calibrate(record, evaluations=12_000)


@pytest.fixture(scope='module')
def results(record: ag.Record, posterior: ag.Calibration) -> dict[str, Any]:
    """Everything that the public functions hand out, by a text that it must show."""
    stable = ag.rths('benchmark_case_1', posterior, draws=20)
    partition = ag.Partition(*3 * (40.0 * np.eye(40),), ag.Specimen(1.0, 2.0, 3.0), 1000.0)
    replayed = ag.replay(record, window=3.0, hop=0.5, evaluations=6000)
    return {
        'beta_1': posterior,
        'P(unstable)': stable,
        'no compensator': Comparison({'none': stable, 'ats': stable}, 'none'),
        'window': replayed,
        '601 samples at 100 Hz': record,
        '40 degree(s) of freedom': partition,
        'levels 0.5, 0.95': band(np.ones((20, 3000)), (0.5, 0.95)),
        'sweep': ag.Command(),
    }


def test_a_text_is_short_and_tells_what_matters(results: dict[str, Any]) -> None:
    """No arrays, at most 25 lines, none of which a terminal breaks; `print` shows the same."""
    for told, result in results.items():
        for text in (repr(result), str(result), f'{result}'):
            lines = text.splitlines()
            assert len(lines) <= 25 and max(map(len, lines)) <= 160, text
            assert told in text and 'array(' not in text, text


def test_a_diagnosis_is_short(record: ag.Record) -> None:
    """It begins with the verdict; of one with many records and effects the rest is cut off."""
    found = ag.Diagnosis.__new__(ag.Diagnosis)
    assert 'array(' not in ag.Diagnosis.__repr__.__qualname__
    assert type(found).__repr__ is ag.Calibration.__repr__
    blocks = [Note('the verdict'), Table(('a', 'b'), [(f'r{i}', i) for i in range(100)], 'rows')]
    lines = as_text(blocks, 'see there').splitlines()
    assert lines[0] == 'the verdict' and len(lines) == LINES
    assert lines[-1] == f'... {103 - LINES + 1} more lines: see there'
    assert lines[3] == '  r0    0'


def test_a_problem_is_the_first_line(posterior: ag.Calibration) -> None:
    """As on the command line."""
    doubted = replace(posterior, problems=('24 um of structure over 10 um of noise',))
    assert repr(doubted).splitlines()[0] == '24 um of structure over 10 um of noise'


def test_a_notebook_shows_pictures(
    results: dict[str, Any], record: ag.Record, posterior: ag.Calibration, tmp_path: Path
) -> None:
    """What IPython asks of a figure of ours gives a PNG, though nobody imported pyplot."""
    formatters = pytest.importorskip('IPython.core.formatters', reason='no IPython')
    formatter = formatters.DisplayFormatter()
    figures = [posterior.plot(), posterior.plot_bands(record)]
    figures += [results[name].plot() for name in ('P(unstable)', 'window')]
    for figure in figures:
        shown, _ = formatter.format(figure)
        assert shown['image/png'][:4] == PNG
    shown, _ = formatter.format(posterior)
    assert 'beta_1' in shown['text/html'] and len(shown['text/plain'].splitlines()) <= 25
    figures[0].savefig(tmp_path / 'as_ever.svg')


def test_rths_hands_on_that_intervals_do_not_hold(posterior: ag.Calibration) -> None:
    """A posterior that is sure of wrong numbers makes no test safe; as a prior it is doubted."""
    assert posterior.structure is not None and not posterior.problems
    wrong = replace(posterior.structure, structure_m=2.4e-5, noise_m=1e-5, matters_m=5e-6)
    problem = wrong.problem()
    assert problem is not None
    doubted = replace(posterior, structure=wrong, problems=(problem,))
    found = ag.rths('benchmark_case_1', doubted, draws=20)
    assert found.problems == (problem,) and not found.go(1.0)
    assert 'intervals do not hold' in repr(found).splitlines()[0]
    other = replace(doubted, sketches=())  # as if of another test
    again = ag.calibrate(posterior.records, prior=other, evaluations=12_000)
    assert again.prior is not None and again.prior.doubt == wrong.amounts()
    assert any('its intervals do not hold' in note for note in again.notes)
