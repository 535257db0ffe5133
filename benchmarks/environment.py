"""The peers' own virtual environment, made once and kept while its requirements stay the same."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
REQUIREMENTS = ROOT / 'requirements-bench.txt'
CONSTRAINTS = ROOT / 'constraints.txt'


def python(folder: Path) -> Path:
    """Return the interpreter of the environment in `folder`, made first where it is missing.

    Raises:
        subprocess.CalledProcessError: packages could not be installed.
    """
    interpreter = folder / 'bin' / 'python'
    stamp = folder / 'installed'
    wanted = REQUIREMENTS.read_text() + CONSTRAINTS.read_text()
    if not (stamp.exists() and stamp.read_text() == wanted):
        subprocess.run([sys.executable, '-m', 'venv', '--clear', str(folder)], check=True)
        subprocess.run(
            [
                str(interpreter),
                '-m',
                'pip',
                'install',
                '--quiet',
                '--disable-pip-version-check',
                '-r',
                str(REQUIREMENTS),
            ],
            check=True,
        )
        stamp.write_text(wanted)
    return interpreter
