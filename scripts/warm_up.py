"""Compile what the first calibration, diagnosis, estimate and hybrid test need, by small ones.

Two at a time: `make setup` runs this beside the build of the messages.
"""

import io
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy.signal import lsim

# The first two share next to no compiled code; the next need most of theirs, and some more for
# records that tell more; the last two take what those before have saved, and share their own.
COMMANDS = [
    'simulate {0}/made.csv --duration 6 --rate 200 --stiffness 250e3 --effect backlash',
    'calibrate {0}/free.csv --stiffness 0 --evaluations 24000',
    'calibrate {0}/free.csv {0}/clamped.csv --stiffness 0 250e3 --evaluations 24000 '
    '--save {0}/posterior.npz',
    'diagnose {0}/free.csv {0}/clamped.csv --stiffness 0 250e3',
    'calibrate {0}/clamped.csv --stiffness 250e3 --effect backlash --evaluations 24000 '
    '--save {0}/play.npz',
    'rths sdof --posterior {0}/posterior.npz --draws 32 --ground-motion {0}/ground.txt',
    'rths sdof --posterior {0}/play.npz --draws 32 --ground-motion {0}/ground.txt',
]
# What the estimator's process does before it is ready, and a replay's; the other commands have
# compiled most of it.
WINDOWS = (
    'from actuator_glue.workers.warm import warm_prior, warm_windows; '
    'warm_windows(); warm_windows(windows=1, carried=warm_prior())'
)
# pytest rewrites the assertions of each file once; at their first start four processes of
# `make test` would do so four times, side by side.
TESTS = ['-m', 'pytest', '--collect-only', '-q']


def record(gain: float, coefficients: tuple[float, float]) -> str:
    """Return a sweep and the response of gain/(s^2 + a s + b) as the text of a laboratory file."""
    time = np.arange(2000) / 200.0
    command = 2.0 * np.sin(2 * np.pi * (0.2 + 0.3 * time) * time)
    response = lsim(([gain], [1.0, *coefficients]), command, time)[1]
    noise = 0.01 * np.random.default_rng(0).standard_normal(time.size)
    text = io.StringIO()
    np.savetxt(text, np.column_stack([time, command, response + noise]), '%.6f', delimiter=',')
    return 'time_s,command_mm,measured_mm\n' + text.getvalue()


def run(arguments: list[str]) -> None:
    """Run Python with some arguments, in a process of its own.

    Raises:
        RuntimeError: it could not use its input or failed; an answer of "no" is an answer.
    """
    done = subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, check=False
    )
    if done.returncode > 1 or 'Traceback' in done.stderr:
        raise RuntimeError(f'{" ".join(arguments)}: {done.stderr}')


def main() -> None:
    """Run the commands on records in a temporary folder."""
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        # Eqs. (3a) and (3b) of the paper: a free actuator and one on 250 kN/m.
        for name, response in (
            ('free', record(4609.0, (140.0, 4609.0))),
            ('clamped', record(2208.0, (133.0, 2101.0))),
        ):
            Path(folder, f'{name}.csv').write_text(response, encoding='utf-8')
        time = np.arange(200) / 100.0
        np.savetxt(Path(folder, 'ground.txt'), np.column_stack([time, np.sin(9.0 * time)]))
        lines = [
            ['-m', 'actuator_glue.cli.main', *command.format(folder).split()]
            for command in COMMANDS
        ]
        *others, hybrid, last = lines
        for together in (others[:2], others[2:], [hybrid, ['-c', WINDOWS], TESTS, last]):
            list(pool.map(run, together))


if __name__ == '__main__':
    main()
