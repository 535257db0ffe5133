"""What the launch files share: nodes with the suite's parameters, and the rule for their ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    OpaqueFunction,
    RegisterEventHandler,
    TimerAction,
)
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.ros_adapters import get_ros_node
from launch_ros.substitutions import FindPackageShare

from actuator_glue.nodes.restarts import Restarts
from launch import LaunchDescription

# What carries samples or records ends a launch: a stream when it has ended, all of them when they
# fail. Any other node is started again, for a test goes on without it.
STREAMS = ('actuator_sim', 'lab_bridge', 'replay')
CARRIERS = (*STREAMS, 'recorder')
# Time until a node is started again [s].
RESTART_SECONDS = 2.0
# Exit code of a node that refuses its parameters.
REFUSED = 2
# Every launch file has these besides its own.
COMMON = {
    'params': (
        PathJoinSubstitution([FindPackageShare('actuator_glue'), 'config', 'actuator_glue.yaml']),
        'parameter file of all nodes',
    ),
    'use_sim_time': ('false', 'take the time from /clock'),
    'linger': (
        '5.0',
        'time for the last windows and a diagnosis that runs, once the streams have ended [s]',
    ),
}
Given = Mapping[str, str]


def truth(text: str) -> bool:
    """Return the truth value of a launch argument, `true` or `false`."""
    return text.strip().lower() in ('true', '1', 'yes')


def node(given: Given, name: str, parameters: Mapping[str, Any], namespace: str = '') -> Any:
    """Return a node with the parameter file and parameters of its own.

    Args:
        given: the launch arguments.
        name: executable and name.
        parameters: what differs from the file.
        namespace: of its topics and services.
    """
    more = {**parameters, 'use_sim_time': truth(given['use_sim_time'])}
    return Node(
        package='actuator_glue',
        executable=name,
        name=name,
        namespace=namespace,
        parameters=[given['params'], more],
        output='screen',
        respawn=name not in CARRIERS,
        respawn_delay=RESTART_SECONDS,
    )


def ends(streams: int, linger: float, simulated: bool) -> Callable[[Any, Any], Any]:
    """Return the rule for a node's end.

    The end of the last stream ends all; that of any other node that carries samples or records is
    a failure. The other nodes are started again, which /diagnostics tells; only if such a node
    refuses its parameters at its first start, that is a failure, too: streams still wait for it.

    Args:
        streams: how many nodes stream.
        linger: time for the last windows [s].
        simulated: whether /clock has the time.
    """
    left = streams
    restarts: Restarts | None = None
    ended_before: set[int] = set()

    def ended(event: Any, context: Any) -> Any:
        nonlocal left, restarts
        if context.is_shutdown:
            return None
        node, code = event.action, event.returncode
        if node.node_executable not in CARRIERS and (code != REFUSED or id(node) in ended_before):
            ended_before.add(id(node))
            if restarts is None:
                restarts = Restarts(get_ros_node(context), simulated)
            restarts.ended(node.node_name, code)
            return None
        if code or node.node_executable not in STREAMS:
            # launch takes an exception for a failure, ends the other nodes and returns 1.
            raise RuntimeError(
                f'{event.process_name} ended with exit code {code}; it says why above'
            )
        left -= 1
        if left:
            return None
        end = EmitEvent(event=Shutdown(reason='the stream has ended'))
        return TimerAction(period=linger, actions=[end])

    return ended


def description(
    arguments: Mapping[str, tuple[Any, str]], nodes: Callable[[Given], list[Any]]
) -> Any:
    """Return a launch description.

    Args:
        arguments: default and meaning of each launch argument besides the common ones.
        nodes: return the nodes for the arguments given.
    """
    everything = {**COMMON, **arguments}

    def made(context: Any) -> list[Any]:
        given = {name: LaunchConfiguration(name).perform(context) for name in everything}
        found = nodes(given)
        streams = sum(n.node_executable in STREAMS for n in found)
        rule = ends(streams, float(given['linger']), truth(given['use_sim_time']))
        return [*found, RegisterEventHandler(OnProcessExit(on_exit=rule))]

    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in everything.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=made)])
