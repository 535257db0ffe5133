"""Several actuators side by side, each with its nodes in a namespace of its own.

Simulated ones, or live streams of a laboratory in the same order:

ros2 launch actuator_glue four.launch.py
ros2 launch actuator_glue four.launch.py names:=x1,x2,y1,y2 layout:=rig.yaml \
    sources:=udp://127.0.0.1:5001,udp://127.0.0.1:5002,udp://127.0.0.1:5003,udp://127.0.0.1:5004
"""

from pathlib import PurePath

from actuator_glue.nodes.launching import description, node, truth

ARGUMENTS = {
    'names': ('north,east,south,west', 'names of the actuators: namespaces of their nodes'),
    'bags': ('', 'folder of the bags, one per actuator; empty for ~/.ros/actuator_glue'),
    'sources': ('', 'live streams, in the order of the names; empty for simulated actuators'),
    'layout': ('', 'layout of the sources'),
    'rate': ('0.0', 'sample rate of the sources [Hz], 0 for what their layout says'),
    'stiffnesses': (
        '250e3',
        'specimen stiffnesses [N/m], in the order of the names, or one for all',
    ),
    'duration': ('60.0', 'length of the simulated tests [s]'),
    'view': ('false', 'a page per actuator on 127.0.0.1, at any free port; each logs its address'),
    'partitions': (
        '',
        'hybrid tests whose stability is watched, in the order of the names, or one for all',
    ),
    'diagnose': ('false', 'a diagnoser per actuator, too: half a core and 300 MB each'),
}


def entries(given, name, count):
    """Return the parts of a launch argument, one per actuator.

    Raises:
        RuntimeError: their number is neither one nor that of the actuators.
    """
    parts = [part.strip() for part in given[name].split(',') if part.strip()]
    parts = parts * count if len(parts) == 1 and name != 'sources' else parts
    if len(parts) not in (0, count):
        raise RuntimeError(f'{name} has {len(parts)} entries for {count} actuators')
    return parts


def nodes(given):
    """Return the nodes of all actuators; their recorders, too, have a bag each."""
    names = [name.strip() for name in given['names'].split(',') if name.strip()]
    sources = entries(given, 'sources', len(names))
    stiffnesses = entries(given, 'stiffnesses', len(names))
    partitions = entries(given, 'partitions', len(names))
    diagnose, view = truth(given['diagnose']), truth(given['view'])
    found = []
    for at, name in enumerate(names):
        common = {
            'actuator': name,
            'specimen_stiffness': float(stiffnesses[at]),
            'wait_for': 2 + diagnose + view,
            'exit_at_end': True,
        }
        if sources:
            live = {
                'source': sources[at],
                'layout': given['layout'],
                'rate': float(given['rate']),
            }
            stream = ('lab_bridge', common | live)
        else:
            # Each with its own noise.
            simulated = {'duration': float(given['duration']), 'preview': 3.0, 'seed': at + 1}
            stream = ('actuator_sim', common | simulated)
        bag = str(PurePath(given['bags'], name)) if given['bags'] else ''
        wanted = [('recorder', {'bag': bag}), ('estimator', {}), stream]
        wanted += [('diagnoser', {})] if diagnose else []
        wanted += [('viewer', {'port': 0})] if view else []
        wanted += [('margin', {'partition': partitions[at]})] if partitions else []
        found += [node(given, executable, more, name) for executable, more in wanted]
    return found


def generate_launch_description():
    """Return the nodes; the end of the last stream ends them all, estimators start again."""
    return description(ARGUMENTS, nodes)
