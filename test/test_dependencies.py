"""What is declared for pip and for rosdep is what the sources import, no more and no less."""

import ast
import re
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from functools import cache
from importlib.metadata import metadata
from pathlib import Path
from typing import NamedTuple

import pytest
from colcon_core.task.python.test import has_test_dependency
from colcon_python_setup_py.package_identification.python_setup_py import get_setup_information

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / 'pyproject.toml').read_text(encoding='utf-8'))['project']
OURS = {'actuator_glue', 'benchmarks', 'examples', 'studies'}
OURS |= {p.stem for p in (ROOT / 'test').rglob('*.py')}


class Names(NamedTuple):
    """How a library is called where it is installed from."""

    pip: str
    rosdep: str | None


# None: rosdep has no key for it.
LIBRARIES = {
    'PIL': Names('pillow', 'python3-pil'),
    'aiohttp': Names('aiohttp', 'python3-aiohttp'),
    'arviz': Names('arviz', None),
    'catkin_pkg': Names('catkin-pkg', 'python3-catkin-pkg-modules'),
    'colcon_core': Names('colcon-core', None),
    'colcon_python_setup_py': Names('colcon-python-setup-py', None),
    'control': Names('control', 'python-control-pip'),
    'distributed': Names('distributed', None),
    'h5py': Names('h5py', 'python3-h5py'),
    'hypothesis': Names('hypothesis', 'python3-hypothesis'),
    'jinja2': Names('jinja2', 'python3-jinja2'),
    'llvmlite': Names('llvmlite', None),
    'lvm_read': Names('lvm-read', None),
    'lz4': Names('lz4', None),
    'markupsafe': Names('markupsafe', None),
    'matio': Names('mat-io', None),
    'matplotlib': Names('matplotlib', 'python3-matplotlib'),
    'mcap': Names('mcap', None),
    'nptdms': Names('nptdms', None),
    'numba': Names('numba', 'python3-numba'),
    'numpy': Names('numpy', 'python3-numpy'),
    'openpyxl': Names('openpyxl', 'python3-openpyxl'),
    'pandas': Names('pandas', 'python3-pandas'),
    'pyarrow': Names('pyarrow', None),
    'pylsl': Names('pylsl', None),
    'pytest': Names('pytest', 'python3-pytest'),
    'pytest_timeout': Names('pytest-timeout', 'python3-pytest-timeout'),
    'rich': Names('rich', 'python3-rich'),
    'rosbags': Names('rosbags', 'python3-rosbags-pip'),
    'ruptures': Names('ruptures', None),
    'scipy': Names('scipy', 'python3-scipy'),
    'scoringrules': Names('scoringrules', None),
    'sklearn': Names('scikit-learn', 'python3-sklearn'),
    'statsmodels': Names('statsmodels', None),
    'threadpoolctl': Names('threadpoolctl', None),
    'xarray': Names('xarray', 'python3-xarray'),
    'xdist': Names('pytest-xdist', 'python3-pytest-xdist'),
    'yaml': Names('pyyaml', 'python3-yaml'),
    'zstandard': Names('zstandard', None),
}
# Libraries of the extra `lab`, each asked for where a file needs it.
OPTIONAL = {'aiohttp', 'h5py', 'matio', 'nptdms', 'openpyxl', 'pandas', 'pyarrow', 'pylsl'}
# Libraries of the extra `campaign`.
CAMPAIGN = {'distributed', 'pandas', 'pyarrow', 'ruptures'}
# Options of pytest that pyproject.toml and Makefile use; nothing imports these plug-ins.
PLUGINS = {'pytest_timeout', 'xdist'}


@cache
def imported(*folders: str) -> frozenset[str]:
    """Return the libraries and ROS packages that the sources below some folders import."""
    found = set()
    for path in (p for folder in folders for p in (ROOT / folder).rglob('*.py')):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.partition('.')[0])
    # Type checkers alone know the last one.
    return frozenset(found - OURS - set(sys.stdlib_module_names) - {'_typeshed'})


def needed() -> frozenset[str]:
    """Return what the package cannot do without."""
    return imported('actuator_glue', 'launch') - OPTIONAL - CAMPAIGN


def needed_to_test() -> frozenset[str]:
    """Return what the tests need besides."""
    return (imported('test') | PLUGINS) - needed()


def pip_names(requirements: Iterable[str]) -> set[str]:
    """Return the names of requirements without versions and extras."""
    return {re.split(r'[\[<>=!~ ]', r, maxsplit=1)[0].lower() for r in requirements}


def manifest(*tags: str) -> set[str]:
    """Return what package.xml declares under some tags."""
    root = ElementTree.parse(ROOT / 'package.xml').getroot()
    return {str(e.text) for tag in tags for e in root.iter(tag)}


def rosdep_keys(modules: Iterable[str]) -> set[str]:
    """Return the keys under which rosdep knows imported modules; a ROS package is its own key."""
    keys = {LIBRARIES[m].rosdep if m in LIBRARIES else m for m in modules}
    return {key for key in keys if key}


def test_pip_installs_what_the_package_imports() -> None:
    """[project] dependencies: every library, and none that nothing imports."""
    expected = {LIBRARIES[m].pip for m in needed() if m in LIBRARIES}
    assert pip_names(PROJECT['dependencies']) == expected


def test_studies_and_examples_need_nothing_more() -> None:
    """They run where the package does."""
    assert imported('studies', 'examples') <= needed()


def test_pip_installs_what_the_tests_import() -> None:
    """The extra `test`: what is not needed at run time already."""
    expected = {LIBRARIES[m].pip for m in needed_to_test() - OPTIONAL - CAMPAIGN if m in LIBRARIES}
    expected.add('actuator_glue')  # with its extras `campaign` and `lab`
    assert pip_names(PROJECT['optional-dependencies']['test']) == expected


@pytest.mark.parametrize(('extra', 'modules'), [('lab', OPTIONAL), ('campaign', CAMPAIGN)])
def test_an_extra_is_what_single_files_need(extra: str, modules: set[str]) -> None:
    """Each of its libraries is named by a source, as an import or by name."""
    sources = ' '.join(p.read_text('utf-8') for p in (ROOT / 'actuator_glue').rglob('*.py'))
    assert all(
        f"'{module}'" in sources or re.search(rf'(import|from) {module}', sources)
        for module in modules
    )
    expected = {LIBRARIES[m].pip for m in modules}
    assert pip_names(PROJECT['optional-dependencies'][extra]) == expected


def test_rosdep_installs_what_the_package_imports() -> None:
    """package.xml: every ROS package and every library that has a key."""
    assert manifest('depend', 'exec_depend') == rosdep_keys(needed())


def test_rosdep_installs_what_the_tests_import() -> None:
    """package.xml: test dependencies likewise."""
    assert manifest('test_depend') == rosdep_keys(needed_to_test())


def test_every_requirement_is_pinned_once() -> None:
    """constraints.txt names exactly the requirements of pyproject.toml, each with one version."""
    lines = (ROOT / 'constraints.txt').read_text(encoding='utf-8').splitlines()
    pins = [line.split('==') for line in lines if line and not line.startswith('#')]
    assert all(len(pin) == 2 for pin in pins)
    extras = PROJECT['optional-dependencies'].values()
    required = pip_names([*PROJECT['dependencies'], *(r for extra in extras for r in extra)])
    assert sorted(name.lower() for name, _ in pins) == sorted(required - {'actuator_glue'})


# How metadata say what the security page calls a licence.
LICENCES = {
    'BSD': 'BSD',
    'MIT': 'MIT',
    'Apache 2.0': 'Apache',
    'PSF': 'Python Software Foundation',
    'LGPL 3': 'LGPL-3',
}


def test_the_security_page_tells_the_licence_of_what_is_installed() -> None:
    """Every library of the package and its extras for users; all but one are permissive."""
    page = (ROOT / 'docs' / 'security.md').read_text(encoding='utf-8')
    told = {}
    for line in page.partition('| licence |')[2].partition('\n\n')[0].splitlines()[2:]:
        licence, names = (cell.strip() for cell in line.strip('|').split('|'))
        told |= dict.fromkeys(re.sub(r'\(.*?\)', '', names).replace(' ', '').split(','), licence)
    extras = PROJECT['optional-dependencies']
    installed = [*PROJECT['dependencies'], *extras['lab'], *extras['campaign']]
    assert set(told) == pip_names(installed)
    for name, licence in told.items():
        known = metadata(name)
        fields = (known.get('License-Expression'), known.get('License'))
        words = ' '.join([*(f or '' for f in fields), *(known.get_all('Classifier') or ())])
        assert LICENCES[licence] in words, name
    assert [name for name, licence in told.items() if 'GPL' in licence] == ['nptdms']


@pytest.fixture(scope='module')
def as_colcon_reads() -> dict[str, object]:
    """Return what colcon finds out about the package."""
    return get_setup_information(ROOT / 'setup.py')


def test_colcon_tests_with_pytest(as_colcon_reads: dict[str, object]) -> None:
    """Otherwise it takes unittest, finds no test, and is content."""
    assert has_test_dependency(as_colcon_reads, 'pytest')


def test_colcon_measures_no_coverage_unasked(as_colcon_reads: dict[str, object]) -> None:
    """It would for whoever declares pytest-cov among the test dependencies."""
    assert not has_test_dependency(as_colcon_reads, 'pytest-cov')


def test_colcon_finds_what_pyproject_needs(as_colcon_reads: dict[str, object]) -> None:
    """`colcon build --symlink-install` runs setup.py beside nothing but its data files."""
    installed = {f for _, files in as_colcon_reads['data_files'] for f in files}
    assert {'pyproject.toml', PROJECT['readme']} <= installed


def test_a_run_of_next_to_nothing_is_told(tmp_path: Path) -> None:
    """`.ci/run` fails where fewer tests ran than it asks for; skipped ones do not count."""
    report = tmp_path / 'tests.xml'
    report.write_text('<testsuites><testsuite tests="12" skipped="3"/></testsuites>')
    script = ROOT / 'scripts' / 'enough_tests.py'
    for least, status in ((9, 0), (10, 1)):
        run = subprocess.run([sys.executable, script, report, str(least)], check=False)
        assert run.returncode == status
