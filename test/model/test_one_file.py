"""An effect with a compiled stage of its own is one file in the catalogue."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import actuator_glue

# A flow that weakens with the square of the position: the expression beside it says the same.
STAGE = '''
"""Flow that weakens away from the middle."""

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Stage
from actuator_glue.model.parameters import Parameter

(FALL,) = r.ROWS.take(1)
(ON,) = r.SWITCHES.take(1)


@njit
def _fill(w, n, p, case):
    w[FALL + n] = p.fall


@njit
def _gain(w, n, time):
    x = w[r.X + n] + 0.5 * w[r.DX + n]
    return 1.0 - w[FALL + n] * x * x


EFFECT = Effect(
    name='flow-fall',
    place='flow',
    equation='Q = q (1 - c x^2)',
    parameters=(Parameter('fall', '1/m^2', 0.0, 1e5, 'loss over the square', 0.0),),
    group='flow-fall',
    signature='odd harmonics',
    source='made for a test',
    starts=lambda s: ((0.1 / s.stroke**2,),),
    stage=Stage(_fill, gain=_gain, own=ON),
)
'''
WORK = """
import numpy as np
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import TABLE_2, Parameter
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record
u = 5e-3 * np.sin(2 * np.pi * 2.0 * np.arange(1500) / 500.0)
record = Record(u, u, 1 / 500.0, 250e3)
other = Parameter('c', '1/m^2', 0.0, 1e5, '', 0.0)
written = Structure((term('written', 'flow: q = q*(1 - c*x**2)', (other,)), 'valve-deadband'))
own = Structure(('flow-fall', 'valve-deadband'))
none = Structure(('valve-deadband',)).simulate([*TABLE_2, 1e-4], record)
a, b = (s.simulate([*TABLE_2, 4e3, 1e-4], record) for s in (own, written))
print(np.abs(a - none).max(), np.abs(a - b).max())
"""


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_one_file_is_enough(tmp_path: Path) -> None:
    """Rows, switch, coefficients and the compiled step follow from the file."""
    package = tmp_path / 'actuator_glue'
    shutil.copytree(
        Path(actuator_glue.__file__).resolve().parent,
        package,
        ignore=shutil.ignore_patterns('__pycache__'),
    )
    (package / 'model/effects/catalogue/flow_fall.py').write_text(STAGE)
    done = subprocess.run(
        [sys.executable, '-c', WORK],
        cwd=tmp_path,
        env={**os.environ, 'PYTHONPATH': str(tmp_path)},
        check=True,
        capture_output=True,
        text=True,
        timeout=850,
    )
    size, difference = (float(word) for word in done.stdout.split())
    # Both take the flow's slope with the increment differently: none against the exact one.
    assert size > 1e-5
    assert difference < 1e-3 * size
