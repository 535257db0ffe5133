"""One actuator - simulated, of a file, live, or replayed - with estimator, recorder, diagnoser.

The stream begins when all listen: on a machine's first run two minutes later, for compiling.

ros2 launch actuator_glue demo.launch.py
ros2 launch actuator_glue demo.launch.py data:=test.csv stiffness:=250e3
ros2 launch actuator_glue demo.launch.py source:=udp://127.0.0.1:5005 layout:=speedgoat.yaml
ros2 launch actuator_glue demo.launch.py replay:=out/tuesday
ros2 launch actuator_glue demo.launch.py partition:=benchmark_case_1
ros2 launch actuator_glue demo.launch.py effect:=backlash namespace:=east
"""

from actuator_glue.errors import InputError
from actuator_glue.nodes.launching import description, node, truth

ARGUMENTS = {
    'namespace': ('', 'namespace of all nodes'),
    'bag': ('', 'folder of the bag, empty for ~/.ros/actuator_glue/bag_DATE-TIME'),
    'data': ('', 'laboratory file or bag to stream; empty for the simulator'),
    'channels': ('', 'channel map of data'),
    'source': ('', 'live stream of a laboratory: udp://HOST:PORT, tcp://HOST:PORT, lsl:NAME'),
    'layout': ('', 'layout of source'),
    'rate': ('0.0', 'sample rate of source [Hz], 0 for what its layout says'),
    'results': ('', 'where results go back to, udp://HOST:PORT or lsl:NAME'),
    'stiffness': ('-1.0', 'specimen stiffness [N/m], -1 for what data or source says'),
    'replay': ('', 'bag whose samples are published again'),
    'duration': ('60.0', 'length of the simulated test [s]'),
    'effect': ('', 'effect of the simulated actuator that no node is told of'),
    'sealed_file': (
        '',
        'file of the truth about the effect, empty for ~/.ros/actuator_glue/truth_DATE-TIME.json',
    ),
    'view': ('false', 'a page that shows everything, on 127.0.0.1'),
    'partition': (
        '',
        'hybrid test whose stability is watched: a file, sdof, benchmark_case_1, ...',
    ),
    'apply': ('true', 'go on with the augmented model once something is found missing'),
}


def stream(given):
    """Return the node that streams, and its parameters."""
    several = [name for name in ('data', 'source', 'replay') if given[name]]
    if len(several) > 1:
        raise InputError(
            f'{" and ".join(several)} are given, and one stream is launched: keep one'
        )
    # All that is given: the node says what does nothing.
    laboratory = {
        'specimen_stiffness': float(given['stiffness']),
        'results': given['results'],
        'channels': given['channels'],
        'layout': given['layout'],
        'rate': float(given['rate']),
    }
    if given['replay']:
        return 'replay', {'bag': given['replay'], 'clock': False}
    if given['source']:
        return 'lab_bridge', laboratory | {'source': given['source']}
    if given['data']:
        return 'lab_bridge', laboratory | {'file': given['data'], 'preview': 3.0}
    stiffness = float(given['stiffness'])
    return 'actuator_sim', {
        **({} if stiffness < 0.0 else {'specimen_stiffness': stiffness}),
        'duration': float(given['duration']),
        'preview': 3.0,
        'undeclared_effect': given['effect'],
        'sealed_file': given['sealed_file'],
    }


def nodes(given):
    """Return the nodes; the stream waits for those that must not miss its first sample."""
    name, parameters = stream(given)
    wanted = [
        ('recorder', {'bag': given['bag']}),
        ('estimator', {}),
        ('diagnoser', {'apply': truth(given['apply'])}),
    ]
    if truth(given['view']):
        wanted.append(('viewer', {'open': True}))
    listeners = len(wanted)
    if given['partition']:
        wanted.append(('margin', {'partition': given['partition']}))
    # The stream is the last one: its end ends the launch.
    wanted.append((name, parameters | {'wait_for': listeners, 'exit_at_end': True}))
    return [node(given, name, more, given['namespace']) for name, more in wanted]


def generate_launch_description():
    """Return the nodes; the stream's end ends them all, estimator and the like are restarted."""
    return description(ARGUMENTS, nodes)
