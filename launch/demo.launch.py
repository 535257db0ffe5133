"""Simulator (or a laboratory file), estimator, recorder and diagnoser.

The stream begins when all listen: on a machine's first run two minutes later, for compiling.

ros2 launch actuator_glue demo.launch.py
ros2 launch actuator_glue demo.launch.py data:=test.csv stiffness:=250e3
ros2 launch actuator_glue demo.launch.py effect:=backlash namespace:=east
"""

from launch.actions import DeclareLaunchArgument, EmitEvent, RegisterEventHandler, TimerAction
from launch.conditions import IfCondition, UnlessCondition
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

ARGUMENTS = {
    'namespace': ('', 'namespace of all nodes'),
    'params': (
        PathJoinSubstitution([FindPackageShare('actuator_glue'), 'config', 'actuator_glue.yaml']),
        'parameter file of all nodes',
    ),
    'bag': ('', 'folder of the bag, empty for ~/.ros/actuator_glue/bag_DATE-TIME'),
    'data': ('', 'laboratory file or bag to stream; empty for the simulator'),
    'channels': ('', 'channel map of data'),
    'stiffness': ('-1.0', 'specimen stiffness [N/m] of data, -1 for what it says'),
    'duration': ('60.0', 'length of the simulated test [s]'),
    'effect': ('', 'effect of the simulated actuator that no node is told of'),
    'sealed_file': (
        '',
        'file of the truth about the effect, empty for ~/.ros/actuator_glue/truth_DATE-TIME.json',
    ),
    'linger': ('5.0', 'time for the last windows, once the stream has ended [s]'),
    'apply': ('true', 'go on with the augmented model once something is found missing'),
}

STREAMS = ('actuator_sim', 'lab_bridge')


def given(name, kind=str):
    """Return a launch argument as a parameter value."""
    return ParameterValue(LaunchConfiguration(name), value_type=kind)


def ended(event, context):
    """Return what follows the end of a node: the end of all; a failure, unless it streamed."""
    if context.is_shutdown:
        return None
    if event.returncode or event.action.node_executable not in STREAMS:
        # launch takes an exception for a failure, ends the other nodes and returns 1.
        raise RuntimeError(
            f'{event.process_name} ended with exit code {event.returncode}; it says why above'
        )
    end = EmitEvent(event=Shutdown(reason='the stream has ended'))
    return TimerAction(period=LaunchConfiguration('linger'), actions=[end])


def generate_launch_description():
    """Return the nodes; the end of the stream ends them all, that of another one is a failure."""
    simulated = PythonExpression(["'", LaunchConfiguration('data'), "' == ''"])
    # Subscribers that must listen before the first sample, so that none is lost.
    stream = {'wait_for': 3, 'exit_at_end': True}

    def node(name, *parameters, **more):
        return Node(
            package='actuator_glue',
            executable=name,
            name=name,
            namespace=LaunchConfiguration('namespace'),
            parameters=[LaunchConfiguration('params'), *parameters],
            output='screen',
            **more,
        )

    sources = [
        node(
            'actuator_sim',
            stream
            | {
                'duration': given('duration', float),
                'preview': 3.0,
                'undeclared_effect': given('effect'),
                'sealed_file': given('sealed_file'),
            },
            condition=IfCondition(simulated),
        ),
        node(
            'lab_bridge',
            stream
            | {
                'file': given('data'),
                'channels': given('channels'),
                'specimen_stiffness': given('stiffness', float),
                'preview': 3.0,
            },
            condition=UnlessCondition(simulated),
        ),
    ]
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription(
        [
            *declared,
            node('recorder', {'bag': given('bag')}),
            node('estimator'),
            node('diagnoser', {'apply': given('apply', bool)}),
            *sources,
            RegisterEventHandler(OnProcessExit(on_exit=ended)),
        ]
    )
