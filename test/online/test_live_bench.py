"""The bench of the live loop: what its rows are, and the page that they make."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from actuator_glue.model.structure import Structure
from benchmarks.live.__main__ import ran
from benchmarks.live.cases import NOISE, RATE, Case, all_cases, left, streamed
from benchmarks.live.score import made_worse
from benchmarks.live.table import page


def row(seed, effects=(), **more):
    """A row of a stream in which nothing happened."""
    nothing = {
        'effects': effects,
        'ratio': 4.0,
        'calibrated': True,
        'onset': 0.0,
        'drift': 0.0,
        'seed': seed,
        'inside': 0.9,
        'windows': 100,
        'true_weight': 0.0,
        'true_least': math.nan,
        'leading': [],
        'right': not effects,
        'coverage': 0.95,
        'error': 1.0,
        'broke': math.nan,
        'added': math.nan,
        'delay': math.nan,
        'looks': [],
        'worse': 0,
        'commit': 'abc',
    }
    return nothing | more


def test_what_was_measured_stands_beside_what_is_required():
    found = {'right': True, 'true_least': 0.3, 'true_weight': 0.9, 'leading': ['delay']}
    times = {'broke': 11.0, 'added': 23.0, 'delay': 12.0, 'looks': [4.0], 'inside': 0.96}
    rows = [
        row(1),
        row(2, added=40.0),
        row(3, ('delay',), **found, **times),
        row(4, ('gain',), **(times | {'delay': 20.0, 'windows': 300, 'inside': 0.92, 'worse': 4})),
    ]
    told = page(rows, 300)
    assert '4 of 300 streams (seeds 1 to 4), commit abc.' in told
    # 100 windows and 300; their parts are 3 windows more and 3 less than 93 %.
    assert '| 93 to 97 % | 93.0% of 400 in 2 streams (standard error 1.5%) |' in told
    assert '| 90 % | 1 of 2 |' in told and '| all of 50 | 1 of 2 |' in told
    assert '| 15 s | 16 s of 2 |' in told and '| none | 1 of 4 |' in told
    assert told.count('\n## Commit') == 1
    assert 'were run more often' not in told
    healthy = [row(seed) for seed in range(10, 15)]
    assert 'were run more often' in page([*rows, *healthy], 300)
    both = page([*rows, {k: v for k, v in row(5, commit='old').items() if k != 'worse'}], 300)
    assert both.count('\n## Commit') == 2 and '| none | 1 of 4 |' in both
    beside = page(rows, 300, [row(9, commit='old')])
    assert 'Before: 1 streams (seeds 9 to 9), commit old.' in beside
    assert '| all of 50 | 1 of 1 | 1 of 2 |' in beside and '| 90 % |  | 1 of 2 |' in beside


def test_a_fair_part_of_300_streams_has_healthy_ones_pairs_and_both_sizes():
    cases = all_cases(7)
    assert len(cases) == 300 and len({case.seed for case in cases}) == 300
    assert sum(not case.effects and not case.drift for case in cases) == 50
    assert sum(len(case.effects) == 2 for case in cases) == 32
    hidden = [case for case in cases if case.effects]
    assert {case.ratio for case in hidden} == {2.0, 4.0}
    assert {case.onset for case in hidden} == {0.0, 45.0}


def test_a_drifting_gain_stays_a_gain_to_the_end_of_the_stream():
    given = streamed(Case(('gain-drift',), 2.0, seconds=120.0, seed=3))
    assert abs(given.sizes['gain_drift']) * 120.0 < 0.5


def test_a_drift_that_begins_in_mid_stream_begins_with_no_leap():
    """Its gain was that of 45 s of drift at once: a second fault that nobody had hidden."""
    case = Case(('gain-drift',), 4.0, onset=45.0, seconds=90.0, seed=3)
    given, plain = streamed(case), streamed(replace(case, effects=()))
    error = given.record.measured - plain.record.measured

    def rms(start):
        return np.std(error[round(start * RATE) : round((start + 2.0) * RATE)])

    assert rms(43.0) == 0.0 and rms(45.0) < 0.1 * rms(88.0)


@pytest.mark.parametrize('name', ['specimen-hardening', 'flow-saturation', 'specimen-gap'])
def test_a_hidden_effect_has_the_size_that_is_told_and_lies_inside_its_bounds(name):
    """Half of the saturated valves had their velocity at its lower bound, and another size."""
    given = streamed(Case((name,), 4.0, seconds=20.0, seed=12))
    structure = Structure((name,))
    (parameter,), (size,) = structure.parameters[4:], given.sizes.values()
    assert parameter.lower < size < parameter.upper
    response = structure.simulate(np.append(given.theta, size), given.record)
    assert left(response, given.theta, given.record) / NOISE == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize(
    ('errors', 'plain', 'worse'),
    [((4e-10, 1e-10), True, True), ((4e-10, 1e-10), False, False), ((1e-10, 4e-10), True, False)],
)
def test_worse_is_worse_than_eq_2_by_what_matters(errors, plain, worse):
    rival = SimpleNamespace(model=SimpleNamespace(effects=() if plain else ('delay',)))
    leading = SimpleNamespace(effects=('backlash',))
    result = SimpleNamespace(errors=errors, model=leading, rivals=(rival,), noise=1e-5)
    assert made_worse(result, 1e-5) is worse
    assert made_worse(result, np.nan) is worse
    assert not made_worse(result, 1e-3)


def test_the_same_case_is_the_same_stream():
    case = Case(('backlash',), 4.0, seconds=6.0, seed=11)
    one, again = streamed(case), streamed(replace(case))
    assert one.record.measured.tobytes() == again.record.measured.tobytes()


def test_a_machine_that_cannot_be_built_is_said_and_left_out(capsys):
    impossible = Case(('delay',), 1e6, seconds=5.0)
    assert list(ran([impossible], 1, 1.0)) == []
    assert 'left out: ' in capsys.readouterr().err
