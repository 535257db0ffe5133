"""The fuzzer: what it begins with is good, and a hundred thousand inputs do no harm."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from actuator_glue.errors import InputError
from benchmarks.fuzz.targets import TARGETS

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize('name', TARGETS)
def test_what_the_fuzzer_begins_with_can_be_used(name, tmp_path):
    """A target that refused its own seeds would try nothing but its first line."""
    target = TARGETS[name]
    use, refused = target.user(tmp_path), []
    seeds = target.seeds(tmp_path)
    for seed in seeds:
        try:
            use(seed)
        except InputError as error:
            refused.append(str(error))
    # Layouts of datagrams and of OpenFresco are none of lines.
    assert len(refused) < len(seeds), refused


def test_effects_can_be_tried_where_nothing_is_compiled(tmp_path):
    """The fuzzer sees Python only: what functions of numba call natively must do without numba."""
    code = (
        'import sys; from pathlib import Path; from benchmarks.fuzz.targets import TARGETS\n'
        'target, folder = TARGETS["effects"], Path(sys.argv[1])\n'
        'use = target.user(folder)\n'
        'use(target.seeds(folder)[0])\n'
        'print("held")'
    )
    environment = {**os.environ, 'NUMBA_DISABLE_JIT': '1'}
    command = [sys.executable, '-c', code, str(tmp_path)]
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.stdout.split()[-1:] == ['held'], done.stderr


@pytest.mark.slow
@pytest.mark.timeout(7200)
@pytest.mark.skipif(
    importlib.util.find_spec('atheris') is None,
    reason="no atheris: pip install 'actuator_glue[safety]'",
)
def test_a_hundred_thousand_inputs_of_every_kind_do_no_harm(tmp_path, rng_seed):
    """No exception but InputError, none slower than its limit, within a limit of memory."""
    command = [sys.executable, '-m', 'benchmarks.fuzz', '--out', str(tmp_path)]
    command += ['--seed', str(rng_seed % 2**31)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads((tmp_path / 'fuzz.json').read_text())
    assert found['inputs'] >= 100_000 and not found['not_held']
