"""Compiled code: the same bits in every process, and never that of sources of yesterday."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

# Band limits of a mixture: many sums, in functions that call each other.
WORK = """
import hashlib
import numpy as np
from actuator_glue.online.mixture import mixture_band
rng = np.random.default_rng(0)
time = np.arange(20_000)
draws = 1e-3 * np.sin(time / 50) + rng.standard_normal((200, 1)) * 2e-6 * np.cos(time / 37)
draws += 1e-6 * rng.standard_normal((200, 1))
sd = 1e-5 * (1 + 0.02 * rng.standard_normal(200))
band = mixture_band(draws, 1e-7 * rng.standard_normal(200), sd, (0.5, 0.95))
print(hashlib.sha256(band.lower.tobytes() + band.upper.tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_fresh_and_cached_code_agree_to_the_bit(tmp_path: Path) -> None:
    """Without forced inlining one limit in 80 000 differed in its last bit."""
    environment = {**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path)}
    compiled, cached = (
        subprocess.run(
            [sys.executable, '-c', WORK],
            env=environment,
            check=True,
            capture_output=True,
            text=True,
            timeout=300,
        ).stdout
        for _ in range(2)
    )
    assert any(tmp_path.rglob('*.nbc'))
    assert compiled == cached


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package of our name with two compiled functions, one of which calls the other."""
    package = tmp_path / 'actuator_glue'
    package.mkdir()
    (package / '__init__.py').touch()
    shutil.copy(Path(__file__).parents[1] / 'actuator_glue/jit.py', package)
    (package / 'outer.py').write_text(
        'from actuator_glue.inner import inner\nfrom actuator_glue.jit import njit\n\n'
        '@njit\ndef outer(x):\n    return 10.0 * inner(x)\n'
    )
    return package


def write_inner(package: Path, number: int) -> None:
    (package / 'inner.py').write_text(
        f'from actuator_glue.jit import njit\n\n@njit\ndef inner(x):\n    return x + {number}\n'
    )


def test_a_changed_callee_is_compiled_again(package: Path) -> None:
    """Numba alone would go on with the copy in the caller's cached code."""
    environment = {k: v for k, v in os.environ.items() if k != 'NUMBA_CACHE_DIR'}
    # Python takes a file of the same size and second for the one whose bytecode it has kept.
    environment['PYTHONDONTWRITEBYTECODE'] = '1'
    found = []
    for number in (1, 2, 2):
        write_inner(package, number)
        done = subprocess.run(
            [sys.executable, '-c', 'from actuator_glue.outer import outer; print(outer(0.0))'],
            env=environment,
            cwd=package.parent,
            check=True,
            capture_output=True,
            text=True,
            timeout=300,
        )
        found.append(float(done.stdout))
    assert found == [10.0, 20.0, 20.0]
    assert len(list((package / '__pycache__').glob('compiled-*'))) == 2


# The value, how often it was read from a folder, and where that is.
TOLD = """
from actuator_glue.jit import STORE
from actuator_glue.outer import outer
print(outer(0.0), sum(outer.stats.cache_hits.values()), STORE.folder)
"""


@pytest.mark.slow
def test_an_installation_that_cannot_be_written_is_no_obstacle(
    package: Path, read_only: Callable[..., list[str]]
) -> None:
    """In memory without a home; in a home's cache where there is one; read where it was put."""
    write_inner(package, 1)
    environment = {k: v for k, v in os.environ.items() if k != 'NUMBA_CACHE_DIR'}
    environment['PYTHONPATH'] = str(package.parent)

    def run(**more: str) -> tuple[list[str], str]:
        done = subprocess.run(
            read_only(sys.executable, '-c', TOLD),
            env=environment | more,
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.split(), done.stderr

    found, said = run()
    assert found == ['10.0', '0', 'None']
    assert said.count('kept in the memory of this process') == 1 and 'Traceback' not in said
    home = package.parent / 'out'
    for hits in '0', '1':
        (value, read, folder), said = run(HOME_THERE=str(home))
        assert (value, read) == ('10.0', hits) and not said
        assert Path(folder).parent == home / '.cache' / 'actuator_glue'
    # As in the image of a container that was warmed up when it was made.
    subprocess.run(
        [sys.executable, '-c', TOLD], env=environment, cwd=package.parent, check=True, timeout=300
    )
    (value, read, folder), said = run()
    assert (value, read) == ('10.0', '1') and not said
    assert Path(folder).parent == package / '__pycache__'


def test_links_lead_to_the_same_compiled_code(tmp_path: Path) -> None:
    """What `make demo` compiled the command line finds afterwards, workspace or not."""
    (tmp_path / 'actuator_glue').symlink_to(Path(__file__).parents[1] / 'actuator_glue')
    work = (
        'import actuator_glue; from actuator_glue.model import kernel; '
        'print(actuator_glue.__file__, kernel.systems.py_func.__code__.co_filename)'
    )
    done = subprocess.run(
        [sys.executable, '-c', work],
        cwd=tmp_path,
        check=True,
        capture_output=True,
        text=True,
        timeout=300,
    )
    package, kernel = map(Path, done.stdout.split())
    assert package.parent == tmp_path / 'actuator_glue'
    assert kernel == kernel.resolve() != package.parent / 'model' / 'kernel.py'
