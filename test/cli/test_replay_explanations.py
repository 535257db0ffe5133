"""replay and info of a bag whose estimator carried several structures."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_replay import put

from actuator_glue.api.replay_data import (
    ReplayData,
    WindowError,
    WindowEstimate,
    WindowExplanation,
)
from actuator_glue.api.replay_report import explanations_table, if_true_table
from actuator_glue.inference.choice import choose_model
from actuator_glue.io.bag_records import write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.model.commands import noise
from actuator_glue.model.structure import Structure
from actuator_glue.online import conversion
from actuator_glue.online.job import WindowResult
from actuator_glue.online.playback import replay, stream
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.structures import Proposal, Proposed
from actuator_glue.records import Record

RATE, PLAY = 200.0, 6e-5
SETTINGS = EstimatorSettings(window=3.0, hop=1.0, evaluations=3000, start_evaluations=6000)
CARRIED = Proposal(
    (
        Proposed(choose_model(), 0.6),
        Proposed(choose_model(('backlash',), start={'backlash': PLAY}), 0.4),
    )
)


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a bag of 8 s with 60 um of play, and what an estimator said of it."""
    command = noise(RATE, 8.0, 0.2, 8.0, seed=3)
    record = Record(command, command, 1.0 / RATE, 250e3, start_ns=10**18)
    clean = Structure(('backlash',)).simulate(np.array([134.0, 1.1e9, 2.5e5, 0.5, PLAY]), record)
    measured = clean + 1e-5 * np.random.default_rng(3).standard_normal(len(clean))
    record = Record(command, measured, 1.0 / RATE, 250e3, start_ns=10**18)
    path = tmp_path_factory.mktemp('carried') / 'bag'
    with BagWriter(path) as writer:
        write_record(writer, record)
        for topic, kind in (
            ('/estimator_setup', 'EstimatorSetup'),
            ('/posterior', 'PosteriorMoments'),
            ('/posterior_draws', 'PosteriorDraws'),
        ):
            writer.add_topic(topic, kind)
        head = conversion.Head(record.start_ns, record.actuator)
        setup = conversion.estimator_setup(SETTINGS, CARRIED, 0, 0)
        put(writer, '/estimator_setup', 'EstimatorSetup', head, setup)
        for result in replay(stream(record), SETTINGS, CARRIED):
            if isinstance(result, WindowResult):
                told = conversion.posterior(result, 0.1)
                put(writer, '/posterior', 'PosteriorMoments', *told)
                put(writer, '/posterior_draws', 'PosteriorDraws', *conversion.draws(result))
    return path


@pytest.mark.slow
def test_replay_tells_weights_over_time_and_the_parameters_if_each_is_true(run, bag: Path) -> None:
    done = run('replay', bag, '--json', '-')
    windows = done.json['windows']
    first, last = windows[0]['explanations'], windows[-1]['explanations']
    assert [(e['name'], e['weight']) for e in first] == [('Eq. (2)', 0.6), ('backlash', 0.4)]
    # Its forecasts are right: play gains.
    assert last[0]['name'] == 'backlash' and last[0]['weight'] > 0.9
    for one in last:
        if one['name'] == 'backlash':
            assert abs(one['mean']['backlash'] - PLAY) < 4.0 * one['stddev']['backlash'] < 2e-5
        else:
            assert list(one['mean']) == ['beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3']
    assert 'Explanations and their weights over time' in done.err
    assert 'Eq. (2) 60' in done.err and 'backlash 40' in done.err


def test_info_tells_them_without_computing_anything(run, tmp_path: Path) -> None:
    """From the posteriors of a bag, by the ends of their windows."""
    record = Record(np.zeros(600), np.zeros(600), 1.0 / RATE, 250e3)
    with BagWriter(tmp_path / 'bag') as writer:
        write_record(writer, record)
        writer.add_topic('/posterior', 'PosteriorMoments')
        for index, play in ((0, 0.4), (200, 0.9), (400, 0.97)):
            head = conversion.Head(record.stamp_ns(index + 199), '')
            fields = {'index': index, 'samples': 200, 'period': 1.0 / RATE}
            fields |= {'window': 0, 'evaluations': 0, 'converged': True}
            fields |= {'stopped_early': False, 'prior_contradicted': False}
            fields |= {'structures': ['Eq. (2)', 'backlash'], 'weights': [1.0 - play, play]}
            put(writer, '/posterior', 'PosteriorMoments', head, fields)
    done = run('info', tmp_path / 'bag', '--json', '-')
    assert done.code == 0
    first, last = done.json['files'][0]['explanations']['/posterior']
    assert (first['start_s'], last['start_s'], last['stop_s']) == (1.0, 2.0, 3.0)
    assert last['last'] == {'backlash': 0.97, 'Eq. (2)': pytest.approx(0.03)}
    assert 'backlash 90 -> 97 %, Eq. (2) 10 -> 3 %' in done.err


def window(end: float, *explanations: WindowExplanation) -> WindowEstimate:
    """Return a window of which nothing is asked but its explanations."""
    nothing = WindowError(0.0, 0.0)
    return WindowEstimate(0, 0, 0, end, {}, 0, True, nothing, (), explanations=explanations)


def test_the_parameters_if_each_is_true_in_units_that_people_say() -> None:
    """A column for each explanation of the last window; what one lacks is a dash."""
    plain = WindowExplanation('Eq. (2)', 0.04, {'beta_1': 120.0}, {'beta_1': 2.0})
    play = WindowExplanation(
        'backlash',
        0.96,
        {'beta_1': 134.0, 'backlash': 4.1e-5},
        {'beta_1': 0.5, 'backlash': 4e-7},
    )
    found = ReplayData(
        'bag', {}, (), (window(5.0, plain), window(6.0, play, plain)), (), None, None, 6.0, 1.0
    )
    assert if_true_table(found) == (
        ('parameter', 'backlash (96 %)', 'Eq. (2) (4 %)', 'unit'),
        [
            ('beta_1', '134 +- 0.5', '120 +- 2', '1/s'),
            ('backlash', '41 +- 0.4', '-', 'um'),
        ],
    )
    told = explanations_table(found)
    assert told is not None and [row[2] for row in told[1]] == [
        'Eq. (2) 4 %',
        'backlash 96 %, Eq. (2) 4 %',
    ]
    alone = replace(found, windows=found.windows[:1])
    assert if_true_table(alone) is None and explanations_table(alone) is None
