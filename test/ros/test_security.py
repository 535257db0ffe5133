"""The policy of SROS 2 allows each node what it does, and nothing that it does not."""

import xml.etree.ElementTree as ElementTree
from contextlib import suppress
from pathlib import Path

import pytest

from actuator_glue.nodes.parameter_file import NODES

# Those that compile before they answer.
WORKING = {'diagnoser', 'estimator'}

ROOT = Path(__file__).resolve().parents[2]
POLICY = ElementTree.parse(ROOT / 'config' / 'security' / 'policy.xml').getroot()
# What a node subscribes to by its parameters: results back out, simulated time.
OPTIONAL = {'/clock', '/posterior', '/prediction_band', '/frequency_response', '/diagnosis'}
OPTIONAL |= {'/stability_margin'}
ACTION = '/_action/'


def allowed(node, group, kind):
    """Full names that the policy allows a node."""
    entries = POLICY.iterfind(f'.//profile[@node="{node}"]/{group}[@{kind}="ALLOW"]/*')
    names = [str(e.text) for e in entries]
    return {n.replace('~', f'/{node}') if n[0] in '~/' else f'/{n}' for n in names}


@pytest.mark.parametrize(
    'node',
    [pytest.param(n, marks=[pytest.mark.slow] if n in WORKING else []) for n in sorted(NODES)],
)
def test_the_policy_is_what_a_node_does(node, start, probe, tmp_path):
    bag = sorted(p.parent for p in ROOT.glob('bags/**/metadata.yaml'))[0]
    given = {
        'recorder': {'bag': str(tmp_path / 'bag')},
        'replay': {'bag': str(bag), 'results': True, 'clock': True, 'wait_for': 99},
        'actuator_sim': {'wait_for': 99},
        'margin': {'partition': 'sdof'},
        'lab_bridge': {'file': str(bag), 'wait_for': 99, 'results': 'udp://127.0.0.1:9'},
    }
    process = start(node, **given.get(node, {}))
    probe.until(lambda: probe.value(node, 'state') == 'active')
    if node in ('estimator', 'diagnoser'):
        probe.until(lambda: probe.value(node, 'worker') == 'ready', 250, 'compiled')
        probe.for_a_while(1.0)

    # Discovery goes on after a node has been heard: its name comes with a message of its own.
    probe.until(lambda: (node, '/') in probe.get_node_names_and_namespaces(), what='discovered')

    def names(ask):
        return {name for name, _ in ask(node, '/') if ACTION not in name}

    # DDS tells of one after the other, on a busy computer seconds later.
    exact = {
        ('topics', 'publish'): probe.get_publisher_names_and_types_by_node,
        ('services', 'reply'): probe.get_service_names_and_types_by_node,
        ('services', 'request'): probe.get_client_names_and_types_by_node,
    }
    heard = probe.get_subscriber_names_and_types_by_node
    listed = allowed(node, 'topics', 'subscribe')

    def known():
        complete = all(names(ask) >= allowed(node, *what) for what, ask in exact.items())
        return complete and listed - names(heard) <= OPTIONAL

    with suppress(AssertionError):
        probe.until(known)
    for what, ask in exact.items():
        assert names(ask) == allowed(node, *what)
    assert names(heard) <= listed and listed - names(heard) <= OPTIONAL
    assert process.end() == 0
