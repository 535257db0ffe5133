"""Who may import whom, and what the core may not touch."""

import ast
import re
import runpy
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import actuator_glue

ROOT = Path(actuator_glue.__file__).resolve().parent
SOURCES = sorted(p for p in ROOT.rglob('*.py'))
OUTSIDE = sorted(p for f in ('studies', 'examples') for p in (ROOT.parent / f).rglob('*.py'))
OURS = ('test', 'benchmarks', 'launch', 'scripts')
EVERY = [*SOURCES, *OUTSIDE, *(p for f in OURS for p in (ROOT.parent / f).rglob('*.py'))]

BOTTOM = {
    'errors',
    'given',
    'records',
    'setups',
    'sample_block',
    'clock_check',
    'velocity_command',
    'motion',
    'si',
    'even_times',
    'jit',
    'normal',
    'play',
    'robust',
    'json_value',
}
CORE = BOTTOM | {'model', 'inference'}
READY = CORE | {'hygiene'}
EVERYTHING = READY | {
    'online', 'diagnosis', 'report', 'io', 'interfaces', 'workers', 'effects',
    'hybrid', 'streams', 'view', 'optional_library', 'whole_file',
}  # fmt: skip
# Each folder or top module, and what it may import besides itself.
ARROWS = {
    '__init__': {
        'api',
        'campaigns',
        'effects',
        'errors',
        'hybrid',
        'io',
        'records',
    },  # names, imported when used
    'errors': set(),
    'given': {'errors'},
    'si': set(),
    'even_times': {'errors'},
    'motion': set(),
    'records': {'errors', 'given', 'si', 'even_times', 'motion'},
    'setups': {'records', 'errors', 'motion'},
    'sample_block': {'records', 'setups', 'errors'},
    'clock_check': set(),
    'velocity_command': set(),
    'jit': set(),
    'normal': {'jit'},
    'play': {'jit', 'records'},
    'robust': {'records'},
    'json_value': set(),
    'whole_file': {'errors'},
    'optional_library': {'errors'},
    'arguments': {'errors', 'given'},
    'plain_yaml': {'errors'},
    'model': BOTTOM,
    'effects': BOTTOM | {'model', 'plain_yaml', 'whole_file'},
    'inference': BOTTOM | {'model'},
    'online': READY,
    'hygiene': CORE,
    'diagnosis': READY,
    'hybrid': CORE,
    'report': CORE | {'online', 'diagnosis', 'io', 'whole_file'},
    'io': {
        'given',
        'optional_library',
        'plain_yaml',
        'motion',
        'records',
        'setups',
        'sample_block',
        'clock_check',
        'velocity_command',
        'si',
        'even_times',
        'errors',
        'robust',
        'json_value',
        'interfaces',
        'hybrid',
        'whole_file',
    },
    'streams': {'records', 'clock_check', 'errors', 'io'},
    'view': {
        'records',
        'sample_block',
        'setups',
        'errors',
        'io',
        'interfaces',
        'motion',
        'online',
        'report',
    },
    'workers': CORE | {'online'},
    'api': EVERYTHING,
    'nodes': EVERYTHING | {'api'},
    'campaigns': EVERYTHING | {'api'},
    'cli': EVERYTHING | {'api', 'arguments', 'campaigns'},
}
# Rooms of the diagnosis: data go down this list, and each may import those above it, and what all
# of them share.
SHARED = {
    'effort',
    'estimate',
    'finding',
    'remembered',
    'selection',
    'stages',
    'thresholds',
    'trial',
    'verdicts',
}
DIAGNOSIS = runpy.run_path(str(ROOT.parent / 'scripts' / 'write_house_map.py'))['DIAGNOSIS']
# All below io but jit, which keeps compiled code in files.
PURE = (
    'errors',
    'records',
    'setups',
    'sample_block',
    'clock_check',
    'velocity_command',
    'motion',
    'si',
    'even_times',
    'normal',
    'robust',
    'json_value',
    'plain_yaml',
    'model',
    'inference',
    'hygiene',
    'online',
    'diagnosis',
    'hybrid',
)
ROS = ('rclpy', 'launch', 'ament_index_python')
HEAVY = ('numba', 'scipy', 'matplotlib', 'arviz', 'control', 'statsmodels', 'rosbags', 'rclpy')

# Modules and calls through which print, clock, file, thread or global random state would come in.
IMPURE_MODULES = {
    'time', 'datetime', 'random', 'logging', 'pathlib', 'tempfile', 'shutil', 'glob', 'os',
    'threading', 'concurrent', 'multiprocessing',
}  # fmt: skip
IMPURE_CALLS = {'print', 'open', 'input'}
SEEDED = {'Generator', 'PCG64', 'Philox', 'SeedSequence', 'BitGenerator', 'default_rng'}


LOOKED_AT = (
    ast.Import,
    ast.ImportFrom,
    ast.Call,
    ast.ClassDef,
    ast.FunctionDef,
    ast.AsyncFunctionDef,
)


def folder_of(path: Path) -> str:
    """Return the folder or top module a source belongs to."""
    return path.relative_to(ROOT).parts[0].removesuffix('.py')


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """Return all nodes of a source that some test looks at."""
    tree = ast.parse(path.read_text(encoding='utf-8'))
    return tuple(node for node in ast.walk(tree) if isinstance(node, LOOKED_AT))


def imports(path: Path) -> Iterator[tuple[str, int]]:
    """Yield each imported module with its line, relative imports resolved."""
    package = ('actuator_glue', *path.relative_to(ROOT).parent.parts)
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = '.'.join(package[: len(package) - node.level + 1]) if node.level else ''
            module = '.'.join(filter(None, (base, node.module)))
            if module == 'actuator_glue':
                yield from ((f'{module}.{alias.name}', node.lineno) for alias in node.names)
            else:
                yield module, node.lineno


def identifier(path: Path) -> str:
    """Name a source in what a test says."""
    return str(path.relative_to(ROOT))


def test_every_folder_has_its_arrows() -> None:
    """A new folder says here what it may import."""
    assert {folder_of(p) for p in SOURCES} <= set(ARROWS)


def test_imports_follow_the_arrows() -> None:
    """No import against the direction in which data flows."""
    assert not [
        f'{identifier(path)}:{line} imports {module}'
        for path in SOURCES
        for module, line in imports(path)
        if module.startswith('actuator_glue.')
        and module.split('.')[1] not in ARROWS[folder_of(path)] | {folder_of(path), '__version__'}
    ]


def test_rooms_of_the_diagnosis_follow_the_data() -> None:
    """What is told rests on a verdict, a verdict on draws, draws on what the search concluded."""
    found = []
    for path in SOURCES:
        parts = path.relative_to(ROOT).with_suffix('').parts
        if parts[0] != 'diagnosis' or parts[1] in ('diagnose', 'pipeline', '__init__'):
            continue
        above = DIAGNOSIS[: DIAGNOSIS.index(parts[1]) + 1] if parts[1] in DIAGNOSIS else ()
        for module, line in imports(path):
            names = module.split('.')
            if names[:2] != ['actuator_glue', 'diagnosis']:
                continue
            if len(names) < 3 or names[2] not in SHARED | set(above):
                found.append(f'{identifier(path)}:{line} imports {module}')
    assert not found


def test_ros_is_imported_in_nodes_only() -> None:
    """Everything else works on a machine without ROS."""
    assert not [
        f'{identifier(path)}:{line} imports {module}'
        for path in SOURCES
        if folder_of(path) != 'nodes'
        for module, line in imports(path)
        if (top := module.split('.')[0]) in ROS or top.endswith(('_msgs', '_srvs', '_interfaces'))
    ]


def impure(call: ast.Call) -> bool:
    """Whether a call prints, reads, or draws from a generator that is global or has no seed."""
    name = ast.unparse(call.func)
    drawn = name.startswith(('np.random.', 'numpy.random.'))
    if name in IMPURE_CALLS or (drawn and re.split(r'[.(]', name)[2] not in SEEDED):
        return True
    return name.endswith(('default_rng', 'SeedSequence')) and not (call.args or call.keywords)


def test_core_is_pure() -> None:
    """No print, clock, file, thread, process or global random state below io."""
    core = [path for path in SOURCES if folder_of(path) in PURE]
    assert not [
        f'{identifier(path)}:{line} {module}'
        for path in core
        for module, line in imports(path)
        if module.split('.')[0] in IMPURE_MODULES
    ]
    assert not [
        f'{identifier(path)}:{node.lineno} calls {ast.unparse(node.func)}'
        for path in core
        for node in nodes(path)
        if isinstance(node, ast.Call) and impure(node)
    ]


def test_what_is_impure_is_seen() -> None:
    """Whatever it is called by."""
    bad = ('print(1)', 'np.random.rand()', 'np.random.default_rng()', 'SeedSequence()')
    good = ('np.random.default_rng(3)', 'np.random.Generator(bits)', 'rng.normal()', 'reprint(1)')
    calls = [ast.parse(text, mode='eval').body for text in (*bad, *good)]
    assert [impure(call) for call in calls] == [True] * 4 + [False] * 4


def test_functions_can_be_called_without_counting() -> None:
    """Eight parameters at most, but for compiled ones."""
    found = []
    for path in SOURCES:
        for node in nodes(path):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                how = ' '.join(map(ast.unparse, node.decorator_list))
                given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
                named = [a for a in given if a.arg not in ('self', 'cls')]
                if len(named) > 8 and 'njit' not in how and '_strict' not in how:
                    found.append(f'{identifier(path)}:{node.lineno} {node.name}')
    assert not found


def test_a_name_means_one_thing() -> None:
    """No two classes of one name, and no file name three times: whoever searches finds one."""
    classes = Counter(
        node.name for path in SOURCES for node in nodes(path) if isinstance(node, ast.ClassDef)
    )
    everywhere = [p for p in [*SOURCES, *OUTSIDE] if not p.name.startswith('__')]
    files = Counter(path.name for path in everywhere)
    assert not [name for name, count in classes.items() if count > 1]
    assert not [name for name, count in files.items() if count > 2]


def test_yaml_is_read_in_one_place() -> None:
    """Where no key may stand twice."""
    loads = re.compile(r'\byaml\.(?:safe_|full_|unsafe_)?load\b')
    found = [identifier(p) for p in SOURCES if loads.search(p.read_text(encoding='utf-8'))]
    assert found == ['plain_yaml.py']


def test_layout_is_left_to_the_formatter() -> None:
    """Where lines are laid out by hand, a table is read as one."""
    mark = '# fmt: ' + 'skip'
    assert sum(p.read_text(encoding='utf-8').count(mark) for p in EVERY) <= 20


def test_a_silenced_check_has_its_reason() -> None:
    """What is said to mypy or ruff is followed by why."""
    mark = re.compile(
        r'# (?:type: ' + r'ignore|no' + r'qa)\b(?!(?:\[[\w-]+\]|: [A-Z0-9]+) +(?:#|-) \w)'
    )
    for path in EVERY:
        found = mark.search(path.read_text(encoding='utf-8'))
        assert found is None, f'{path}: {found}'


@pytest.mark.parametrize('path', OUTSIDE, ids=lambda p: str(p.relative_to(ROOT.parent)))
def test_studies_and_examples_are_apart(path: Path) -> None:
    """They use the package as others do; a study's computations through its `library` alone."""
    text = path.read_text(encoding='utf-8')
    found = set(re.findall(r'^\s*(?:from|import) ([\w.]+)', text, re.MULTILINE))
    tops = {name.partition('.')[0] for name in found}
    assert not tops & {'rclpy', 'benchmarks', 'test'}
    assert ('studies' if 'examples' in path.parts else 'examples') not in tops
    assert not any(name.startswith(('actuator_glue.nodes', 'actuator_glue.cli')) for name in found)
    if 'studies' in path.parts and path.name != 'library.py':
        allowed = {
            'actuator_glue',
            *(f'actuator_glue.{n}' for n in ('arguments', 'errors', 'io.json_file')),
        }
        apart = {n for n in found if n.startswith('actuator_glue') and n not in allowed}
        assert all(n.startswith('actuator_glue.report') for n in apart)


def test_command_line_imports_nothing_heavy() -> None:
    """`actuator-glue --help` answers at once: commands import what they need when they run."""
    commands = [f'actuator_glue.cli.{p.stem}' for p in (ROOT / 'cli').glob('[!_]*.py')]
    code = (
        f'import importlib, sys\nfor name in {commands!r}: importlib.import_module(name)\n'
        f'print(sorted(set(sys.modules) & set({HEAVY!r})))'
    )
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == '[]'


def test_parts_of_scipy_are_loaded_where_they_are_used() -> None:
    """`import scipy` loads a part at its first use, `import scipy.signal` at every start."""
    eager = [
        str(path.relative_to(ROOT))
        for path in ROOT.rglob('*.py')
        if re.search(r'^import scipy\.', path.read_text(encoding='utf-8'), re.MULTILINE)
    ]
    assert eager == []
