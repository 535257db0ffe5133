"""What the launch files share: nodes with the suite's parameters, and an end for all of them."""

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
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

# Nodes whose end is the end of a test; that of any other is a failure.
STREAMS = ('actuator_sim', 'lab_bridge', 'replay')
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
    """Return what `true` or `false` of a launch argument says."""
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
    )


def ends(streams: int, linger: float) -> Callable[[Any, Any], Any]:
    """Return the rule for a node's end: that of the last stream ends all, any other is a failure.

    Args:
        streams: how many nodes stream.
        linger: time for the last windows [s].
    """
    left = streams

    def ended(event: Any, context: Any) -> Any:
        nonlocal left
        if context.is_shutdown:
            return None
        if event.returncode or event.action.node_executable not in STREAMS:
            # launch takes an exception for a failure, ends the other nodes and returns 1.
            raise RuntimeError(
                f'{event.process_name} ended with exit code {event.returncode}; it says why above'
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
        rule = ends(streams, float(given['linger']))
        return [*found, RegisterEventHandler(OnProcessExit(on_exit=rule))]

    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in everything.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=made)])
