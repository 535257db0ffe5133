"""The policy of SROS 2 allows each node what it does, and nothing that it does not."""

import xml.etree.ElementTree as ElementTree
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
import rclpy
from rclpy.node import Node

from actuator_glue.nodes.parameter_file import NODES

# Those that compile before they answer.
WORKING = {'diagnoser', 'estimator'}

ROOT = Path(__file__).resolve().parents[2]
POLICY = ElementTree.parse(ROOT / 'config' / 'security' / 'policy.xml').getroot()
# What a node subscribes to by its parameters: results back out, simulated time.
OPTIONAL = {'/clock', '/posterior', '/prediction_band', '/frequency_response', '/diagnosis'}
OPTIONAL |= {'/stability_margin'}
ACTION = '/_action/'
EXACT = ('topics', 'publish'), ('services', 'reply'), ('services', 'request')


def allowed(node, group, kind):
    """Full names that the policy allows a node."""
    entries = POLICY.iterfind(f'.//profile[@node="{node}"]/{group}[@{kind}="ALLOW"]/*')
    names = [str(e.text) for e in entries]
    return {n.replace('~', f'/{node}') if n[0] in '~/' else f'/{n}' for n in names}


@contextmanager
def looker():
    """A node with a participant of its own."""
    context = rclpy.context.Context()
    rclpy.init(context=context)
    node = Node('looker', context=context)
    yield node
    node.destroy_node()
    context.shutdown()


def graph(looks, node):
    """What another node knows of a node's topics and services."""
    asked = {
        ('topics', 'publish'): looks.get_publisher_names_and_types_by_node,
        ('topics', 'subscribe'): looks.get_subscriber_names_and_types_by_node,
        ('services', 'reply'): looks.get_service_names_and_types_by_node,
        ('services', 'request'): looks.get_client_names_and_types_by_node,
    }
    if (node, '/') not in looks.get_node_names_and_namespaces():
        return {what: set() for what in asked}
    return {
        what: {name for name, _ in ask(node, '/') if ACTION not in name}
        for what, ask in asked.items()
    }


def complete(looks, node):
    """Whether another node knows of all that the policy allows."""
    seen = graph(looks, node)
    missing = allowed(node, 'topics', 'subscribe') - seen['topics', 'subscribe']
    return missing <= OPTIONAL and all(seen[what] >= allowed(node, *what) for what in EXACT)


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

    # DDS tells of one after the other, on a busy computer seconds later. What one participant has
    # been told once stayed incomplete for good: another one is told anew.
    listed = allowed(node, 'topics', 'subscribe')
    for _ in range(6):
        with looker() as looks:
            with suppress(AssertionError):
                probe.until(lambda looks=looks: complete(looks, node), 15)
            seen = graph(looks, node)
            whole = complete(looks, node)
        if whole:
            break
    assert all(seen[what] == allowed(node, *what) for what in EXACT), seen
    heard = seen['topics', 'subscribe']
    assert heard <= listed and listed - heard <= OPTIONAL
    assert process.end() == 0
