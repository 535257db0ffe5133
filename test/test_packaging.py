"""What other tools read here: package.xml, pyproject.toml, CMakeLists, message texts."""

import ast
import json
import re
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import actuator_glue

ROOT = Path(__file__).resolve().parent.parent
MANIFESTS = [ROOT / 'package.xml', ROOT / 'msg_defs' / 'package.xml']
INTERFACES = sorted(
    p for p in (ROOT / 'msg_defs').glob('*/*') if p.suffix in ('.msg', '.srv', '.action')
)
MESSAGES = [p for p in INTERFACES if p.suffix == '.msg']
# Parts of Diagnosis, never published alone.
PARTS = {'Effect', 'Candidate', 'ModelProposal'}
PROJECT = tomllib.loads((ROOT / 'pyproject.toml').read_text(encoding='utf-8'))
NODES = (
    'actuator_sim',
    'estimator',
    'recorder',
    'replay',
    'lab_bridge',
    'diagnoser',
    'margin',
    'viewer',
    'suite',
)

FIELD = re.compile(r'^(?P<type>[a-zA-Z][\w/]*)(?P<array>\[[^]]*\])?\s+(?P<name>[a-z][a-z0-9_]*)\b')
CONSTANT = re.compile(r'^\w+\s+[A-Z][A-Z0-9_]*\s*=')


def fields(path: Path) -> list[tuple[str, re.Match[str]]]:
    """Return the field lines of an interface text."""
    lines = []
    for line in path.read_text(encoding='utf-8').splitlines():
        if line and not line.startswith(('#', '---')) and not CONSTANT.match(line):
            match = FIELD.match(line)
            assert match, f'{path.name}: {line}'
            lines.append((line, match))
    return lines


@pytest.mark.parametrize('path', MANIFESTS, ids=lambda p: p.parent.name)
def test_manifest(path: Path) -> None:
    """package.xml is format 3 and says who, what and under which licence."""
    root = ElementTree.parse(path).getroot()
    assert root.get('format') == '3'
    assert root.findtext('license') == 'Apache-2.0'
    assert re.fullmatch(r'\S+@\S+\.\w+', root.find('maintainer').get('email'))
    assert len(root.findtext('description')) > 20
    assert root.findtext('version') == actuator_glue.__version__
    build_type = 'ament_python' if path.parent == ROOT else 'ament_cmake'
    assert root.find('export').findtext('build_type') == build_type


def test_versions_agree() -> None:
    """The changelog tells of the version of the package, from which setuptools takes its own."""
    version = actuator_glue.__version__
    assert PROJECT['tool']['setuptools']['dynamic']['version']['attr'] == (
        'actuator_glue.__version__'
    )
    changelog = (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8')
    assert re.search(rf'^{re.escape(version)}( \(|$)', changelog, re.MULTILINE)
    assert 'Apache License' in (ROOT / 'LICENSE').read_text(encoding='utf-8')


@pytest.mark.parametrize('script', PROJECT['project']['scripts'].items(), ids=lambda s: s[0])
def test_entry_point_exists(script: tuple[str, str]) -> None:
    """Each console script leads to something that can be called, found without ROS."""
    module, _, function = script[1].partition(':')
    code = f'import sys, {module} as m; assert callable(m.{function}), sys.modules'
    code += "; assert 'rclpy' not in sys.modules"
    subprocess.run([sys.executable, '-c', code], check=True)


@pytest.mark.parametrize('node', NODES)
def test_node_has_a_main(node: str) -> None:
    """What the executable calls by its name is there."""
    tree = ast.parse((ROOT / 'actuator_glue/nodes' / f'{node}.py').read_text(encoding='utf-8'))
    assert 'main' in {n.name for n in tree.body if isinstance(n, ast.FunctionDef)}


def test_every_node_is_a_script() -> None:
    """`ros2 run` starts what is named in [project.scripts]."""
    assert set(PROJECT['project']['scripts']) == {'actuator-glue', *NODES}


@pytest.mark.ros
@pytest.mark.parametrize('node', NODES)
def test_installed_where_ros2_run_looks(node: str) -> None:
    """`ros2 run actuator_glue NODE` starts install/actuator_glue/lib/actuator_glue/NODE."""
    prefix = ROOT / 'install' / 'actuator_glue'
    if not prefix.exists():
        pytest.skip('not built: run `make setup`')
    executable = prefix / 'lib' / 'actuator_glue' / node
    assert executable.is_file() and executable.stat().st_mode & 0o111
    marker = prefix / 'share/ament_index/resource_index/packages/actuator_glue'
    assert marker.exists()
    assert (prefix / 'share/actuator_glue/launch/demo.launch.py').exists()


def test_build_lists_every_interface() -> None:
    """No interface text is forgotten in CMakeLists.txt."""
    text = (ROOT / 'msg_defs' / 'CMakeLists.txt').read_text(encoding='utf-8')
    listed = set(re.findall(r'"((?:msg|srv|action)/\w+\.\w+)"', text))
    assert listed == {str(p.relative_to(ROOT / 'msg_defs')) for p in INTERFACES}


@pytest.mark.parametrize('path', INTERFACES, ids=lambda p: p.stem)
def test_every_field_says_unit_and_meaning(path: Path) -> None:
    """`# [unit] meaning` after each field; a nested message carries its own units."""
    assert path.read_text(encoding='utf-8').startswith('# ')
    for line, field in fields(path):
        comment = line.partition('#')[2].strip()
        if field['type'] == 'std_msgs/Header':
            assert comment.startswith('stamp: '), f'{path.name}: {line}'
        else:
            assert re.match(r'\[[^]]+\] \w.{5,}', comment), f'{path.name}: {line}'


@pytest.mark.parametrize('path', INTERFACES, ids=lambda p: p.stem)
def test_no_bounded_sequences(path: Path) -> None:
    """PlotJuggler cannot read them."""
    for line, field in fields(path):
        assert field['array'] in (None, '[]'), f'{path.name}: {line}'


@pytest.mark.parametrize('path', MESSAGES, ids=lambda p: p.stem)
def test_header_comes_first(path: Path) -> None:
    """What is published has a Header as its first field."""
    if path.stem in PARTS:
        return
    assert fields(path)[0][1]['type'] == 'std_msgs/Header'


@pytest.mark.parametrize('path', MESSAGES, ids=lambda p: p.stem)
def test_texts_parse_without_ros(path: Path) -> None:
    """The texts that bags embed are understood by another reader."""
    store = get_typestore(Stores.ROS2_JAZZY)
    name = f'actuator_glue_msgs/msg/{path.stem}'
    types = get_types_from_msg(path.read_text(encoding='utf-8'), name)
    store.register(types)
    assert name in store.fielddefs


def test_message_reference_is_up_to_date() -> None:
    """docs/fields_of_*.md are what the texts say; `make docs` renews them."""
    script = str(ROOT / 'scripts' / 'write_message_reference.py')
    assert subprocess.run([sys.executable, script, '--check'], check=False).returncode == 0


TOPICS = {
    'samples': 'SampleBlock',
    'posterior': 'PosteriorMoments',
    'prediction_band': 'PredictionBand',
    'frequency_response': 'FrequencyResponseBand',
    'diagnosis': 'Diagnosis',
}


def check_curve(topic: str, field: str) -> None:
    """Fail unless a topic has a field."""
    names = {f['name'] for _, f in fields(ROOT / 'msg_defs' / 'msg' / f'{TOPICS[topic]}.msg')}
    assert re.sub(r'\[\d+\]$', '', field) in names, f'{topic} has no {field}'


def test_plotjuggler_layout_draws_what_exists() -> None:
    """Each curve of the layout is a field of a message."""
    layout = ElementTree.parse(ROOT / 'docs' / 'layouts' / 'actuator_glue.plotjuggler.xml')
    curves = [curve.get('name') for curve in layout.iter('curve')]
    assert curves
    for curve in curves:
        _, topic, field = curve.split('/')
        check_curve(topic, field)


def test_foxglove_layout_draws_what_exists() -> None:
    """Each path of the layout is a field of a message, each panel is placed."""
    text = (ROOT / 'docs' / 'layouts' / 'actuator_glue.foxglove.json').read_text(encoding='utf-8')
    layout = json.loads(text)
    paths = [p['value'] for c in layout['configById'].values() for p in c.get('paths', ())]
    assert paths
    for path in paths:
        topic, condition, field = re.fullmatch(r'/(\w+)(?:{(\w+)==.*})?\.(.+)', path).groups()
        check_curve(topic, field)
        if condition:
            check_curve(topic, condition)
    assert all(
        json.dumps(layout['layout']).count(f'"{panel}"') == 1 for panel in layout['configById']
    )


def test_nothing_of_one_machine_is_committed() -> None:
    """No home folder, temporary folder of a person or package mirror in a tracked file."""
    listed = subprocess.run(
        ['git', 'ls-files', '-z'], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode != 0:
        pytest.skip('not a git checkout')
    machine = re.compile(r'(?<![\w.])/(?:home|Users|root|work)/\w|index-url|extra-index')
    for name in filter(None, listed.stdout.split('\0')):
        path = ROOT / name
        if path.suffix in ('.mcap', '.png', '.gz', '.npz', '.mat') or not path.is_file():
            continue
        if path == Path(__file__).resolve():
            continue
        found = machine.search(path.read_text(encoding='utf-8'))
        assert found is None, f'{name}: {found.group()}'


def test_test_modules_have_names_of_their_own() -> None:
    """Pytest imports two files of one name only once."""
    names = [p.name for p in (ROOT / 'test').rglob('test_*.py')]
    assert sorted(names) == sorted(set(names))


def test_hooks_run_what_lint_runs() -> None:
    """`git commit` with hooks and `make lint` find the same."""
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    recipe = re.search(r'^lint:.*\n((?:\t.*\n)+)', makefile, re.MULTILINE)
    commands = re.findall(r'^\t@\$\(BIN\)/(.*)$', recipe[1], re.MULTILINE)
    hooks = yaml.safe_load((ROOT / '.pre-commit-config.yaml').read_text(encoding='utf-8'))
    entries = [hook['entry'] for repo in hooks['repos'] for hook in repo['hooks']]
    assert entries == [f'.venv/bin/{command}' for command in commands]


def test_citation_is_of_this_version() -> None:
    """CITATION.cff names the version and licence that the package has."""
    citation = yaml.safe_load((ROOT / 'CITATION.cff').read_text(encoding='utf-8'))
    assert citation['version'] == actuator_glue.__version__
    assert citation['license'] == 'Apache-2.0'
    changelog = (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8')
    assert f'{citation["version"]} ({citation["date-released"]})' in changelog
