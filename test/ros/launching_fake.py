"""`ros2 launch` as far as the launch files use it: it is no wheel, and these tests need none."""

import runpy
import sys
import time
from pathlib import Path
from types import ModuleType, SimpleNamespace

LAUNCH = Path(__file__).resolve().parents[2] / 'launch'
MODULES = {
    'launch': ('LaunchDescription',),
    'launch.actions': (
        'DeclareLaunchArgument',
        'EmitEvent',
        'OpaqueFunction',
        'RegisterEventHandler',
        'TimerAction',
    ),
    'launch.event_handlers': ('OnProcessExit',),
    'launch.events': ('Shutdown',),
    'launch.substitutions': ('LaunchConfiguration', 'PathJoinSubstitution'),
    'launch_ros': (),
    'launch_ros.actions': ('Node',),
    'launch_ros.ros_adapters': ('get_ros_node',),
    'launch_ros.substitutions': ('FindPackageShare',),
}


def thing(kind):
    """A class that keeps what it was made with."""

    def begin(self, *args, **given):
        self.kind, self.args = kind, args
        self.__dict__.update(given)
        self.node_executable = given.get('executable')
        self.node_name = f'{given.get("namespace", "")}/{given.get("name", "")}'

    def perform(self, context):
        return context[self.args[0]]

    return type(kind, (), {'__init__': begin, 'perform': perform})


class Noted(dict):
    """Launch arguments that remember who has been asked for."""

    def __init__(self, given):
        super().__init__(given)
        self.asked = set()

    def __getitem__(self, name):
        self.asked.add(name)
        return super().__getitem__(name)


def pretend(monkeypatch):
    """Put the modules in place of launch's."""
    for name, kinds in MODULES.items():
        module = ModuleType(name)
        for kind in kinds:
            setattr(module, kind, thing(kind))
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.delitem(sys.modules, 'actuator_glue.nodes.launching', raising=False)


def load(name):
    """The names of a launch file."""
    return SimpleNamespace(**runpy.run_path(str(LAUNCH / f'{name}.launch.py')))


def launched(name, **given):
    """Nodes and what follows their ends, of a launch file with some arguments."""
    (*declared, function) = load(name).generate_launch_description().args[0]
    defaults = {d.args[0]: d.default_value for d in declared}
    assert set(given) <= set(defaults), given
    (*nodes, handler) = function.function(defaults | given)
    return nodes, handler.args[0].on_exit, declared


class Launched:
    """Nodes that run as launch runs them: what has ended is told to the rule and started again.

    Args:
        start: starts a node.
        nodes: what to run.
        rule: follows their ends.
        own: node of the launch itself.
        more: parameters beside those of the launch file, for each executable.
    """

    def __init__(self, start, nodes, rule, own, more):
        self._start, self._rule, self._more = start, rule, more
        self._context = SimpleNamespace(is_shutdown=False, node=own)
        sys.modules['launch_ros.ros_adapters'].get_ros_node = lambda context: context.node
        sys.modules['actuator_glue.nodes.launching'].get_ros_node = lambda context: context.node
        self._actions = {node.executable: node for node in nodes}
        self._due = {}
        self.running = {name: self._begin(name) for name in self._actions}
        self.ended = []

    def _begin(self, name):
        node = self._actions[name]
        return self._start(name, **{**node.parameters[1], **self._more.get(name, {})})

    def look(self):
        """Do what launch would do now; return True, to be asked while something is waited for."""
        for name, process in list(self.running.items()):
            if process.alive:
                continue
            del self.running[name]
            self.ended.append(name)
            node, code = self._actions[name], process.process.poll()
            event = SimpleNamespace(action=node, process_name=f'{name}-1', returncode=code)
            self._rule(event, self._context)
            if node.respawn:
                self._due[name] = time.monotonic() + node.respawn_delay
        for name in [n for n, due in self._due.items() if time.monotonic() >= due]:
            del self._due[name]
            self.running[name] = self._begin(name)
        return True
