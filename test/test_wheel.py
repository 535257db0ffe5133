"""What `pip install .` brings, without ROS and without this checkout."""

import subprocess
import sys
import venv
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

import actuator_glue

ROOT = Path(__file__).resolve().parent.parent
LISTED = ('*.py', 'py.typed', '*.msg', '*.srv', '*.action', '*.mplstyle', '*.j2', 'dds_*.xml')


@pytest.fixture(scope='module')
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel from a copy of what belongs to the package."""
    source, out = tmp_path_factory.mktemp('source'), tmp_path_factory.mktemp('wheel')
    # Links: setuptools reads through them; what it writes stays beside them.
    for name in (
        'pyproject.toml',
        'setup.py',
        'setup.cfg',
        'README.md',
        'LICENSE',
        'package.xml',
        'resource',
        'launch',
        'config',
        'actuator_glue',
        'studies',
        'examples',
    ):
        (source / name).symlink_to(ROOT / name)
    command = ['-m', 'pip', 'wheel', '--quiet', '--no-deps', '--no-build-isolation', '-w', out]
    subprocess.run([sys.executable, *command, '.'], cwd=source, check=True)
    (built,) = out.glob('*.whl')
    return built


def test_wheel_holds_every_file_of_the_package(wheel: Path) -> None:
    """Modules, message texts, templates, style and the mark of a typed package."""
    package = ROOT / 'actuator_glue'
    # rglob follows no links, and the message texts lie behind one.
    files = (
        {
            p.relative_to(ROOT).as_posix()
            for folder in (package, package / 'interfaces/')
            for pattern in LISTED
            for p in folder.rglob(pattern)
        }
        | {
            f'actuator_glue/interfaces/{p.parent.name}/{p.name}'
            for p in (ROOT / 'msg_defs').glob('*/*')
        }
        | {
            f'actuator_glue/{folder}/{p.name}'
            for folder in ('channels', 'layouts', 'partitions')
            for p in (ROOT / 'config' / folder).glob('*.yaml')
        }
        | {f'actuator_glue/view/assets/{p.name}' for p in (package / 'view/assets').iterdir()}
    )
    held = {n for n in zipfile.ZipFile(wheel).namelist() if n.startswith('actuator_glue/')}
    assert held == files


def test_wheel_holds_nothing_beside_the_package(wheel: Path) -> None:
    """Studies and examples stay in the checkout."""
    tops = {name.partition('/')[0] for name in zipfile.ZipFile(wheel).namelist()}
    assert {top.partition('-')[0] for top in tops} == {'actuator_glue'}


def test_wheel_is_found_by_ros_and_by_pip(wheel: Path) -> None:
    """The marker and the manifest for ROS 2; name, version and commands for pip."""
    archive = zipfile.ZipFile(wheel)
    version = actuator_glue.__version__
    share = f'actuator_glue-{version}.data/data/share'
    assert f'{share}/ament_index/resource_index/packages/actuator_glue' in archive.namelist()
    assert f'{share}/actuator_glue/package.xml' in archive.namelist()
    info = f'actuator_glue-{version}.dist-info'
    metadata = Parser().parsestr(archive.read(f'{info}/METADATA').decode())
    assert (metadata['Name'], metadata['Version']) == ('actuator_glue', version)
    assert metadata['License'] == 'Apache-2.0'
    assert metadata['Requires-Python'] == '>=3.11'
    commands = archive.read(f'{info}/entry_points.txt').decode()
    assert 'actuator-glue = actuator_glue.cli.main:main' in commands


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_command_line_works_in_a_bare_environment(wheel: Path, tmp_path: Path) -> None:
    """`pip install`, then --help, simulate, calibrate, diagnose; no ROS, no checkout."""
    venv.create(tmp_path / 'bare', with_pip=True)
    tools = tmp_path / 'bare' / 'bin'
    install = ['-m', 'pip', 'install', '--quiet', '-c', ROOT / 'constraints.txt', wheel]
    subprocess.run([tools / 'python', *install], check=True)
    environment = {'PATH': '/usr/bin:/bin', 'HOME': str(tmp_path)}
    for line, statuses in (
        ('--help', {0}),
        ('simulate a.csv --duration 10 --rate 200 --stiffness 250e3', {0}),
        ('calibrate a.csv --stiffness 250e3', {0}),
        ('diagnose a.csv --stiffness 250e3', {0, 1}),
    ):
        done = subprocess.run(
            [tools / 'actuator-glue', *line.split()],
            env=environment,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode in statuses, f'{line}: {done.stdout}{done.stderr}'
    without = 'import importlib.util as u; assert not u.find_spec("rclpy"); import actuator_glue'
    subprocess.run([tools / 'python', '-c', without], env=environment, cwd=tmp_path, check=True)
