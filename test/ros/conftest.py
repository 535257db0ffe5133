"""Real nodes in processes of their own, on a ROS domain of their own."""

import os

import pytest

from examples.demonstration.domain import free_domain

# Before anything of DDS starts; the domain differs between test processes.
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
os.environ['ROS_DOMAIN_ID'] = str(free_domain())

# Everything but ROS is tested on a machine without it, too.
rclpy = pytest.importorskip('rclpy', reason='ROS 2 is not installed: run `make setup`')
pytest.importorskip(
    'actuator_glue_msgs', reason='interfaces are not built: `. install/setup.bash` first'
)

# Needs what is checked above.
from ros_nodes import Probe, Process  # noqa: E402 - after the checks


def pytest_collection_modifyitems(items):
    """Everything here needs ROS."""
    for item in items:
        if 'test/ros/' in str(item.path):
            item.add_marker(pytest.mark.ros)


@pytest.fixture
def start(tmp_path):
    """Start nodes; whatever still runs at the end is killed."""
    running = []

    def begin(executable, name=None, *, namespace='', installed=False, **parameters):
        node = name or executable
        process = Process(executable, node, parameters, tmp_path, namespace, installed)
        running.append(process)
        return process

    yield begin
    for process in running:
        process.kill()


@pytest.fixture
def probe():
    """A node of the test: publishes, listens, calls services."""
    rclpy.init()
    node = Probe()
    yield node
    node.destroy_node()
    rclpy.shutdown()
