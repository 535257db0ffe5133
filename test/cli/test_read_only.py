"""Every command once where nothing but the working folder can be written and nobody has a home."""

import os
import subprocess
import sys
import textwrap
from collections.abc import Callable

import pytest

from actuator_glue.cli.main import commands

# In one process, whose start takes longer than most commands: each line's exit code is 0.
QUICK = """
completion bash
simulate rig.csv --stiffness 0 250e3 --duration 6 --rate 200 --seed 1
info rig_1.csv
map rig_1.csv
convert rig_2.csv copy
recover copy
calibrate rig_1.csv rig_2.csv --evaluations 12000 --save rig.npz --json rig.json
"""
SLOW = """
simulate rig.csv --stiffness 0 250e3 --duration 6 --rate 200 --seed 1
calibrate rig_1.csv rig_2.csv --evaluations 12000 --save rig.npz --report rig.html
plot rig_1.csv --out rig.png
simulate bag --stiffness 250e3 --duration 6 --rate 200 --seed 1
replay bag --json again.json
rths sdof --posterior rig.npz --json rths.json
send rig_2.csv --to udp://127.0.0.1:5999 --speed 100
diagnose rig_1.csv rig_2.csv --report lacks.html --json rig.json
simulate rig_2026-01-05.csv --stiffness 250e3 --duration 6 --rate 200 --seed 2
simulate rig_2026-01-06.csv --stiffness 250e3 --duration 6 --rate 200 --seed 3
campaign rig_2026-01-05.csv rig_2026-01-06.csv --recipe recipe.yaml --out year --workers 1
history year --report year.html
compare year 2026-01-05 2026-01-06
"""
# `view` and `doctor` wait or look at this computer.
WAITING = {'view', 'doctor'}
RUN = r"""
import pathlib, shlex, sys
pathlib.Path('recipe.yaml').write_text(r"names: '(?P<actuator>rig)_(?P<day>[-\d]+)\.'")
from actuator_glue.cli.main import main
for line in sys.argv[1].strip().splitlines():
    code = main(shlex.split(line))
    print(f'{line}: {code}', flush=True)
    if code not in (0, 1):
        sys.exit(code)
"""


def run(read_only: Callable[..., list[str]], lines: str, seconds: float) -> str:
    done = subprocess.run(
        read_only(sys.executable, '-c', textwrap.dedent(RUN), lines),
        env=os.environ | {'PYTHONPATH': os.pathsep.join(p for p in sys.path if p)},
        capture_output=True,
        text=True,
        timeout=seconds,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert 'Traceback' not in done.stderr and 'cannot cache' not in done.stderr
    return done.stdout


@pytest.mark.slow
def test_what_is_quick_runs(read_only: Callable[..., list[str]]) -> None:
    run(read_only, QUICK, 400)


@pytest.mark.slow
def test_what_takes_longer_runs(read_only: Callable[..., list[str]]) -> None:
    run(read_only, SLOW, 900)


def test_no_command_is_left_out() -> None:
    tried = {line.split()[0] for line in (QUICK + SLOW).splitlines() if line}
    assert set(commands()) == tried | WAITING
