"""The launch files: they name what exists, several actuators run apart; what an end ends."""

import importlib
from types import SimpleNamespace

import launching_fake
import numpy as np
import pytest
from launching_fake import LAUNCH, Launched, Noted, launched
from ros_nodes import recorded

from actuator_glue.errors import InputError
from actuator_glue.nodes import base, parameter_file, suite, viewer

KNOWN = parameter_file.NODES | {'viewer': viewer.SPECS}
FILES = sorted(path.name.partition('.')[0] for path in LAUNCH.glob('*.launch.py'))
# What each file can be asked to do.
WAYS = {
    'demo': (
        {},
        {'data': 'x.csv'},
        {'source': 'udp://127.0.0.1:5005'},
        {'replay': 'bag'},
        {'partition': 'benchmark_case_1'},
        {'view': 'true'},
    ),
    'four': (
        {},
        {'sources': 'udp://a:1,udp://a:2,udp://a:3,udp://a:4'},
        {'diagnose': 'true'},
        {'view': 'true'},
        {'partitions': 'sdof'},
    ),
}
EVERY = [(file, way) for file in FILES for way in WAYS[file]]


@pytest.fixture(autouse=True)
def launch(monkeypatch):
    """The modules of launch, which is no wheel."""
    launching_fake.pretend(monkeypatch)


@pytest.mark.parametrize(('file', 'way'), EVERY)
def test_a_launch_file_names_what_exists(file, way):
    nodes, _, _ = launched(file, **way)
    for node in nodes:
        specs = {s.name: s for s in (*base.COMMON, *KNOWN[node.executable])}
        for name, value in node.parameters[1].items():
            if name != 'use_sim_time':
                assert type(value) is type(specs[name].default), (node.executable, name)


def test_what_is_given_of_a_stream_is_used_or_said():
    """A stiffness said nothing of the simulator, and of two streams one was left out unsaid."""
    stiffness = [
        launched('demo', **given)[0][-1].parameters[1].get('specimen_stiffness', 'usual')
        for given in ({}, {'stiffness': '1e5'}, {'data': 'x.csv'}, {'data': 'x', 'stiffness': '0'})
    ]
    assert stiffness == ['usual', 1e5, -1.0, 0.0]
    # Passed on, for the node to say that it does nothing.
    assert launched('demo', data='x.csv', rate='500.0')[0][-1].parameters[1]['rate'] == 500.0
    with pytest.raises(InputError, match=r'data and source are given.*keep one'):
        launched('demo', data='x.csv', source='udp://127.0.0.1:5005')


def test_every_stream_can_be_launched():
    ways = [launched('demo', **way)[0] for way in WAYS['demo']]
    streams = [nodes[-1].executable for nodes in ways]
    simulated, filed = ['actuator_sim'], ['lab_bridge', 'lab_bridge', 'replay']
    assert streams == [*simulated, *filed, *simulated, *simulated]
    assert [n.parameters[1].get('wait_for') for n in ways[-1]][-1] == 4
    found = {n.executable for nodes in ways for n in nodes}
    assert found == set(KNOWN)


def test_four_actuators_are_watched_side_by_side():
    """Pages at ports of their own, margins in the order of the names; streams wait for pages."""
    nodes, _, _ = launched('four', view='true', partitions='sdof,sdof,sdof,benchmark_case_1')
    assert [n.parameters[1]['port'] for n in nodes if n.executable == 'viewer'] == [0] * 4
    watched = {n.namespace: n.parameters[1] for n in nodes if n.executable == 'margin'}
    assert watched['west']['partition'] == 'benchmark_case_1' and len(watched) == 4
    streams = [n for n in nodes if n.executable == 'actuator_sim']
    assert all(n.parameters[1]['wait_for'] == 3 for n in streams)


@pytest.mark.parametrize('file', FILES)
def test_every_launch_argument_is_used_and_explained(file):
    asked = set()
    _, _, declared = launched(file)
    for way in WAYS[file]:
        given = Noted({d.args[0]: d.default_value for d in declared} | way)
        launching_fake.load(file).nodes(given)
        asked |= given.asked
    assert {d.args[0] for d in declared} == asked | {'linger'}
    assert all(len(d.description) > 8 for d in declared)


def test_as_many_sources_as_actuators_are_needed():
    with pytest.raises(RuntimeError, match='sources has 1 entries for 4 actuators'):
        launched('four', sources='udp://127.0.0.1:5001')


# What follows a node's end.


def end(rule, node, code, shutting_down=False):
    """Tell of a node's end as launch does."""
    action = SimpleNamespace(node_executable=node)
    event = SimpleNamespace(action=action, process_name=f'{node}-1', returncode=code)
    return rule(event, SimpleNamespace(is_shutdown=shutting_down))


def test_a_node_that_cannot_start_fails_the_launch(start, tmp_path):
    """A recorder whose bag exists; launch returns 1 for an exception and ends the others."""
    bag = tmp_path / 'bag'
    bag.mkdir()
    (bag / 'precious').touch()
    recorder = start('recorder', bag=str(bag))
    code = recorder.wait(60)
    assert code == 2 and 'exists' in recorder.text, recorder.text
    with pytest.raises(RuntimeError, match='recorder-1 ended with exit code 2'):
        end(launched('demo')[1], 'recorder', code)


@pytest.mark.parametrize(
    ('node', 'code'), [('recorder', 0), ('recorder', -9), ('actuator_sim', 2), ('lab_bridge', -9)]
)
def test_what_carries_samples_or_records_ends_all(node, code):
    with pytest.raises(RuntimeError, match=f'{node}-1 ended with exit code {code}'):
        end(launched('demo')[1], node, code)


def test_a_parameter_that_is_refused_at_the_first_start_fails_the_launch():
    """Streams wait for the node still, so that nothing is lost."""
    with pytest.raises(RuntimeError, match='estimator-1 ended with exit code 2'):
        end(launched('demo')[1], 'estimator', 2)


@pytest.mark.parametrize(('file', 'way'), EVERY)
def test_all_that_a_test_can_do_without_is_started_again(file, way):
    nodes, _, _ = launched(file, **way)
    modules = {n: importlib.import_module(f'actuator_glue.nodes.{n}') for n in suite.NODES}
    carries = {n: getattr(modules[n], kind).carries for n, kind in suite.NODES.items()}
    assert {n.executable: n.respawn for n in nodes} == {
        n.executable: not carries[n.executable] for n in nodes
    }


def all_killed_at_once(start, probe, tmp_path, victims, nodes, rule, **more):
    """Kill nodes in mid-stream; the others go on, they come back, and the bag is whole."""
    bag, waiting = tmp_path / 'bag', len(nodes) - 1
    stream = {'rate': 200.0, 'repeat': True, 'preview': 0.0, 'wait_for': waiting}
    given = {'recorder': {'bag': str(bag)}, 'actuator_sim': stream, **more}
    launch = Launched(start, nodes, rule, probe, given)
    probe.until(lambda: probe.number('actuator_sim', 'samples') > 200, 250, 'a stream')
    first = dict(launch.running)
    for name in victims:
        first[name].kill()
        probe.health.pop(name)
    probe.until(
        lambda: launch.look() and all(probe.value(n, 'state') == 'active' for n in victims),
        250,
        'all are back',
    )
    for name in victims:
        assert f'/{name} ended with exit code -9 and is started again' in probe.faults['launch']
        assert probe.value('launch', f'/{name}: restarts') == '1'
    assert launch.ended == victims
    for name in {'recorder', 'actuator_sim'} | (set(first) - set(victims)):
        assert launch.running[name] is first[name] and first[name].alive
    before = probe.number('actuator_sim', 'samples')
    probe.until(lambda: probe.number('actuator_sim', 'samples') > before + 200, what='it goes on')
    assert first['actuator_sim'].end() == 0 and first['recorder'].end() == 0
    index = recorded(bag)
    assert np.array_equal(index, np.arange(len(index)))


@pytest.mark.slow
def test_a_viewer_that_is_killed_comes_back_and_ends_nothing(start, probe, tmp_path):
    nodes, rule, _ = launched('demo', view='true')
    nodes = [n for n in nodes if n.executable in ('recorder', 'viewer', 'actuator_sim')]
    viewer = {'open': False, 'port': 0}
    all_killed_at_once(start, probe, tmp_path, ['viewer'], nodes, rule, viewer=viewer)


@pytest.mark.slow
def test_all_that_a_test_can_do_without_is_killed_and_comes_back(start, probe, tmp_path):
    nodes, rule, _ = launched('demo', view='true')
    victims = ['estimator', 'diagnoser', 'viewer']
    viewer = {'open': False, 'port': 0}
    all_killed_at_once(start, probe, tmp_path, victims, nodes, rule, viewer=viewer)


@pytest.mark.parametrize('node', ['actuator_sim', 'lab_bridge', 'replay'])
def test_the_end_of_the_stream_ends_all_later(node):
    timer = end(launched('demo')[1], node, 0)
    assert timer.kind == 'TimerAction' and timer.period == 5.0
    assert [a.kind for a in timer.actions] == ['EmitEvent']


def test_the_end_of_the_last_of_four_streams_ends_all():
    rule = launched('four')[1]
    assert [end(rule, 'actuator_sim', 0) for _ in range(3)] == [None] * 3
    assert end(rule, 'actuator_sim', 0).kind == 'TimerAction'


def test_what_ends_in_a_shutdown_is_no_failure():
    assert end(launched('demo')[1], 'estimator', -9, shutting_down=True) is None


def side_by_side(start, probe, tmp_path, names):
    """Launch actuators; each one's bag holds its own samples, whole, and its own estimates."""
    nodes, _, _ = launched(
        'four', names=','.join(names), bags=str(tmp_path), duration='9.0', stiffnesses='250e3'
    )
    running = {}
    for node in nodes:
        process = start(node.executable, namespace=node.namespace, **node.parameters[1])
        running[f'{node.namespace}/{node.executable}'] = process
    for name in names:
        assert running[f'{name}/actuator_sim'].wait(400) == 0
    probe.for_a_while(3.0)
    for name in names:
        assert running[f'{name}/estimator'].end() == 0
        assert running[f'{name}/recorder'].end() == 0
        assert np.array_equal(recorded(tmp_path / name), np.arange(10_001))
        assert probe.number(f'{name}/estimator', 'samples') == 10_001
        assert probe.number(f'{name}/estimator', 'windows') >= 1
    first = [recorded_values(tmp_path / name) for name in names]
    assert not any(np.array_equal(first[0], other) for other in first[1:])


def recorded_values(bag):
    """Measured displacement in a bag."""
    from actuator_glue.io.bag_reader import decoded

    return np.concatenate([m.measured for _, m in decoded(bag, ('SampleBlock',))])


@pytest.mark.slow
def test_two_actuators_side_by_side(start, probe, tmp_path):
    side_by_side(start, probe, tmp_path, ['north', 'east'])


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_four_actuators_side_by_side(start, probe, tmp_path):
    side_by_side(start, probe, tmp_path, ['north', 'east', 'south', 'west'])
