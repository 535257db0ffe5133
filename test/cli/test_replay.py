"""replay: the estimator over a bag, and held against what it published live."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuator_glue import replay as replayed
from actuator_glue.hybrid.indicators import TargetMotion
from actuator_glue.inference.choice import choose_model
from actuator_glue.io import messages
from actuator_glue.io.bag_reader import messages as bag_messages
from actuator_glue.io.bag_records import read_records, write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.model import linear
from actuator_glue.model.parameters import NAMES
from actuator_glue.online import conversion
from actuator_glue.online.job import WindowResult
from actuator_glue.online.playback import replay, stream
from actuator_glue.online.settings import EstimatorSettings

SETTINGS = EstimatorSettings(window=4.0, hop=2.0, evaluations=6000, start_evaluations=12_000)


def put(
    writer: BagWriter, topic: str, name: str, head: conversion.Head, fields: conversion.Fields
) -> None:
    """Write one message the way a node publishes it."""
    content = messages.message(name, header=messages.header(*head), **completed(name, fields))
    writer.write(topic, content, head.stamp_ns)


def completed(name: str, fields: conversion.Fields) -> conversion.Fields:
    """Return fields with zeros where nothing was said, as ROS does, and arrays as arrays."""
    kinds = messages.typestore().fielddefs[messages.full_name(name)][1]
    values = {}
    for field, kind in kinds:
        array = kind[0] == 4
        value = fields.get(field, [] if array else 0.0)
        base = kind[1][0][1][0] if array else ''
        if array and base not in ('', 'string'):
            value = np.asarray(value, np.bool_ if base == 'bool' else base)
        if field != 'header':
            values[field] = value
    return values


@pytest.fixture(scope='module')
def estimated(short_bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Return a function that makes a bag with samples and an estimator's messages."""
    (record,) = read_records(short_bag)
    model = choose_model()
    results = [r for r in replay(stream(record), SETTINGS, model) if isinstance(r, WindowResult)]
    assert len(results) == 3

    def make(name: str, change: Callable[[conversion.Fields], Any] = lambda fields: None) -> Path:
        bag = tmp_path_factory.mktemp('live') / name
        with BagWriter(bag) as writer:
            write_record(writer, record)
            for topic, kind in (
                ('/estimator_setup', 'EstimatorSetup'),
                ('/posterior', 'PosteriorMoments'),
                ('/posterior_draws', 'PosteriorDraws'),
                ('/prediction_band', 'PredictionBand'),
            ):
                writer.add_topic(topic, kind)
            head = conversion.Head(record.start_ns, record.actuator)
            setup = conversion.estimator_setup(SETTINGS, model, 0, 0)
            put(writer, '/estimator_setup', 'EstimatorSetup', head, setup)
            for result in results:
                head, fields = conversion.posterior(result, 0.1)
                change(fields)
                put(writer, '/posterior', 'PosteriorMoments', head, fields)
                put(writer, '/posterior_draws', 'PosteriorDraws', *conversion.draws(result))
                for prediction in result.scored:
                    head, fields = conversion.prediction(prediction, record.actuator)
                    change(fields)
                    put(writer, '/prediction_band', 'PredictionBand', head, fields)
        return bag

    return make


def test_a_replay_is_identical_bit_by_bit(run, estimated: Callable[..., Path]) -> None:
    """Same bag, same numbers: exit 0 and a count of what was compared."""
    done = run('replay', estimated('bag'), '--json', '-')
    assert done.code == 0, done.err
    content = done.json
    assert content['schema'] == 'actuator_glue.replay/1'
    assert content['identical'] is True
    assert content['compared']['posteriors'] == 3
    assert content['compared']['bands'] >= 2
    assert [w['window'] for w in content['windows']] == [0, 1, 2]
    assert 'identical, bit for bit' in done.err


def test_one_other_bit_is_found(run, estimated: Callable[..., Path]) -> None:
    """The smallest difference in one published number is exit 1 and named."""

    def change(fields: conversion.Fields) -> None:
        if fields['window'] == 1 and 'mean' in fields:
            fields['mean'] = np.nextafter(fields['mean'], np.inf)
        if fields['window'] == 0 and fields.get('kind') == 'noise':
            fields['upper'] = fields['upper'].copy()
            fields['upper'][-1] = np.nextafter(fields['upper'][-1], np.inf)

    done = run('replay', estimated('bag', change), '--json', '-')
    assert done.code == 1
    assert done.json['identical'] is False
    posterior, band = sorted(done.json['compared']['differing'], reverse=True)
    assert posterior == 'window 1: posterior differs in mean'
    assert band.startswith('band (0, ') and band.endswith("'noise') differs in upper")


def less(bag: Path, blocks: tuple[int, ...], lacks: str = '', draws: int | None = None) -> Path:
    """Return a bag that lacks sample blocks by their place, a topic, or some of the draws."""
    poorer, place = bag.with_name(bag.name + '_less'), 0
    with BagWriter(poorer) as writer:
        for found in bag_messages(bag):
            place += found.type.endswith('/SampleBlock')
            if (found.type.endswith('/SampleBlock') and place - 1 in blocks) or (
                found.topic == lacks
            ):
                continue
            content = messages.deserialize(found.type, found.data)
            if draws is not None and found.type.endswith('/PosteriorDraws'):
                content.values = content.values[: draws * len(content.parameter_names)]
            writer.add_topic(found.topic, found.type)
            writer.write(found.topic, content, found.log_time)
    return poorer


def test_windows_that_are_whole_are_repeated_where_a_block_is_missing(
    run, estimated: Callable[..., Path]
) -> None:
    """A recorder that missed the first block: the draws say where the second window began."""
    done = run('replay', less(estimated('bag'), (0,)), '--json', '-')
    assert done.code == 0, done.err
    compared = done.json['compared']
    assert done.json['identical'] is True
    assert compared['posteriors'] == 2 and compared['differing'] == []
    (lost,) = compared['unrepeatable']
    assert lost == 'window 0: 64 of its samples 0 to 399 are missing'
    assert '1 windows of the live run cannot be repeated' in done.err and lost in done.err
    assert [w['window'] for w in done.json['windows']] == [1, 2]


def test_windows_behind_a_gap_are_repeated(run, estimated: Callable[..., Path]) -> None:
    """Blocks in the middle are missing: the windows with them are named, the others repeated."""
    found = replayed(less(estimated('bag'), (4, 5)))
    assert found.identical and found.compared is not None
    assert [w.window for w in found.windows] == [2]
    assert found.compared.unrepeatable == (
        'window 0: 128 of its samples 0 to 399 are missing',
        'window 1: 128 of its samples 200 to 599 are missing',
    )


@pytest.mark.parametrize('poorer', [{'lacks': '/posterior_draws'}, {'draws': 200}])
def test_windows_that_began_where_nobody_knows_are_estimated_and_named(
    run, estimated: Callable[..., Path], poorer: dict[str, Any]
) -> None:
    """Without all draws no window behind the missing block is the same to the bit."""
    done = run('replay', less(estimated('bag'), (0,), **poorer), '--json', '-')
    assert done.code == 0, done.err
    assert done.json['identical'] is None
    assert [w['window'] for w in done.json['windows']] == [1, 2]
    assert done.json['compared']['differing'] == []
    told = done.json['compared']['unrepeatable']
    assert [line.split(':')[0] for line in told] == ['window 1', 'window 2', 'window 0']
    assert 'began where window 0 ended' in told[0]
    assert '3 windows of the live run cannot be repeated' in done.err


def test_a_bag_that_began_late_is_estimated(run, estimated: Callable[..., Path]) -> None:
    """The recorder was started when two windows had passed: of them nothing is in the bag."""
    bag = estimated('bag')
    poorer = bag.with_name('late')
    late = read_records(bag)[0].start_ns + 4_100_000_000
    with BagWriter(poorer) as writer:
        for found in bag_messages(bag):
            if found.log_time >= late or found.type.endswith('Setup'):
                writer.add_topic(found.topic, found.type)
                writer.write(
                    found.topic, messages.deserialize(found.type, found.data), found.log_time
                )
    found = replayed(poorer)
    assert found.identical is not False


def test_other_settings_are_not_compared(run, estimated: Callable[..., Path]) -> None:
    """What is estimated otherwise is no replay: exit 0, nothing compared."""
    done = run('replay', estimated('bag'), '--window', 5, '--evaluations', 4000, '--json', '-')
    assert done.code == 0
    assert done.json['identical'] is None
    assert done.json['settings']['window'] == 5


def test_pictures_of_an_estimate(run, estimated: Callable[..., Path], tmp_path: Path) -> None:
    """A bag with posteriors and bands gives the two pictures as well."""
    done = run('plot', estimated('bag'), '--out', tmp_path)
    assert done.code == 0, done.err
    names = {p.name for p in tmp_path.iterdir()}
    assert names == {'bag.png', 'bag_bands.png', 'bag_parameters.png'}


def test_a_laboratory_file_is_estimated_window_by_window(run, problem_r: Path) -> None:
    """No bag is needed to see what the online estimator would have said."""
    options = ('--window', 20, '--hop', 20, '--evaluations', 4000, '--json', '-')
    done = run('replay', problem_r / 'r_2.csv', *options)
    assert done.code == 0, done.err
    assert len(done.json['windows']) == 3
    assert done.json['times_real_time'] > 1


def test_each_window_tells_how_the_actuator_followed(run, estimated: Callable[..., Path]) -> None:
    """What was measured is the window's own; what is predicted holds Eq. (2a)'s delay."""
    bag = estimated('bag')
    done = run('replay', bag, '--tracking', '--json', '-')
    assert done.code == 0 and done.json['identical'] is True
    (record,) = read_records(bag)
    windows = done.json['windows']
    assert len(windows) == 3
    for window in windows:
        start = window['index'] - record.first_index + round(0.5 / record.period)
        part = record.slice(start, window['index'] - record.first_index + window['samples'])
        j = TargetMotion(part.command, part.period).criteria(part.measured)
        tracking = window['tracking']
        assert tracking['measured']['J2'] == pytest.approx(j.j2)
        assert tracking['measured']['J1_s'] == pytest.approx(j.j1)
        theta = [window['parameters'][name]['mean'] for name in NAMES]
        gain = linear.frequency_response(theta, record.known_stiffness(), [5.0])[0]
        delay, told = -np.angle(gain) / (10.0 * np.pi), tracking['predicted']['delay_at_5_hz_s']
        assert told['lower'] - 2e-3 < delay < told['upper'] + 2e-3
    (table,) = (b for b in replayed(bag, tracking=True).brief() if 'followed' in str(b))
    assert 'J2, rms error [%]' in str(table)


def test_the_only_set_up_is_that_of_the_only_samples(run, tmp_path: Path, estimated) -> None:
    """A recording of renamed topics: its records have that stiffness, and so has its replay."""
    bag = tmp_path / 'renamed'
    names = {'/samples': '/rig/data', '/test_setup': '/other/setup'}
    with BagWriter(bag) as writer:
        for found in bag_messages(estimated('bag'), topics=names):
            writer.add_topic(names[found.topic], found.type)
            writer.write_raw(names[found.topic], found.data, found.log_time)
    assert run('replay', bag, '--window', 4, '--evaluations', 4000).code == 0


def test_what_cannot_be_replayed(run, tmp_path: Path, estimated: Callable[..., Path]) -> None:
    """Two actuators without a choice, absurd settings, a record shorter than a window."""
    (record,) = read_records(estimated('bag'))
    bag = tmp_path / 'two'
    with BagWriter(bag) as writer:
        for namespace in ('/a', '/b'):
            write_record(writer, record, namespace=namespace)
    assert '--namespace' in run('replay', bag).message
    assert "under '/c'" in run('replay', bag, '--namespace', '/c').message
    fast = ('--window', 4, '--evaluations', 4000)
    assert run('replay', bag, '--namespace', '/b', *fast).code == 0
    assert 'outside' in run('replay', bag, '--namespace', 'a', '--window', -1).message
    assert 'not one window' in run('replay', bag, '--namespace', 'a', '--window', 60).message


@pytest.mark.parametrize(
    ('stiffness', 'told'),
    [(None, 'samples, but nothing on test_setup'), (-1.0, 'stiffness .* is not known')],
)
def test_samples_that_nobody_described_are_named(
    run, short_bag: Path, tmp_path: Path, stiffness: float | None, told: str
) -> None:
    """The sentence of the live node, and what can be done; with a stiffness there are windows."""
    bag = tmp_path / 'bare'
    with BagWriter(bag) as writer:
        for found in bag_messages(short_bag):
            content = messages.deserialize(found.type, found.data)
            if found.type.endswith('/TestSetup'):
                if stiffness is None:
                    continue
                content.specimen_stiffness = stiffness
            writer.add_topic(found.topic, found.type)
            writer.write(found.topic, content, found.log_time)
    said = run('replay', bag).message
    assert re.search(told, said) and '--stiffness' in said, said
    assert run('replay', bag, '--stiffness', 250e3, '--evaluations', 4000).code == 0


@pytest.mark.slow
def test_of_thousands_of_events_the_first_are_told(
    estimated: Callable[..., Path], tmp_path: Path
) -> None:
    """A report of a bag with thousands of gaps stays small: the first, and how many more."""
    found = replayed(estimated('bag'))
    gaps = tuple(f'samples {i} to {i} are missing' for i in range(5000))
    page = (
        replace(found, events=gaps, notes=gaps).report(tmp_path / 'gaps.html').read_text('utf-8')
    )
    assert page.count('are missing') == 40
    assert 'and 4980 more events, all in the JSON' in page and 'more notes' in page
    few = replace(found, events=gaps[:20]).report(tmp_path / 'few.html').read_text('utf-8')
    assert few.count('are missing') == 20 and 'more events' not in few
