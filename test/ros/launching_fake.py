"""`ros2 launch` as far as the launch files use it: it is no wheel, and these tests need none."""

import runpy
import sys
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
    'launch_ros.substitutions': ('FindPackageShare',),
}


def thing(kind):
    """A class that keeps what it was made with."""

    def begin(self, *args, **given):
        self.kind, self.args = kind, args
        self.__dict__.update(given)
        self.node_executable = given.get('executable')

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
