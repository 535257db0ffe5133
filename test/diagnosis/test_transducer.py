"""A faulty transducer inside of the controller's loop is told from one that only looks on."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from smooth_machines import piston

from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.moves.transducer_in_loop import in_the_loop
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.records import Array, Record

NOISE, STROKE, RATE, SECONDS = 1e-5, 2e-3, 256.0, 16.0
PLANTS = np.array([[128.0, 1.01e9, 2.42e5, 0.3], [225.0, 5.3e9, 6e5, 0.3]])
NAMES = ('backlash', 'stribeck-friction', 'specimen-yield', 'delay', 'gain')
_FEEDBACK_PLAY, _POSITION_GAIN = 7, 13  # departures of smooth_machines.py
_FINER = 16


def play(x: Array, half: float) -> Array:
    """What a transducer with play shows of a motion (n,), which turns between its samples [m]."""
    steps = np.arange(_FINER * len(x)) / _FINER
    out, at = np.empty(len(steps)), 0.0
    for i, value in enumerate(CubicSpline(np.arange(len(x)), x)(steps).tolist()):
        at = min(max(at, value - half), value + half)
        out[i] = at
    return out[::_FINER]


def sweeps(
    plant: Array, departure: tuple[int, float], rng: np.random.Generator, half: float = 0.0
) -> list[Record]:
    """Two of a machine near a plant, without and with a specimen; a transducer may have play."""
    theta = plant * np.exp(0.1 * rng.standard_normal(4))
    t = np.arange(0.0, SECONDS, 1.0 / RATE)
    command = STROKE * np.sin(np.pi * (9.0 / SECONDS) * t**2)
    records = []
    for k in (0.0, 250e3):
        moved = piston(command, 1.0 / RATE, theta, k, departure)
        measured = play(moved, half) if half else moved
        measured += NOISE * rng.standard_normal(len(t))
        records.append(Record(command, measured, 1.0 / RATE, stiffness=k))
    return records


def selected(half: float, inside: bool, rng: np.random.Generator) -> Selection:
    """What is chosen for two sweeps."""
    departure = (_FEEDBACK_PLAY, half) if inside else (0, 0.0)
    records = sweeps(rng.choice(PLANTS), departure, rng, half)
    refits = Refits(Data.whole(records), NAMES)
    beam = BeamSearch(refits, Thresholds(), lambda *_: None)
    found = beam.run()
    return in_the_loop(beam, found) or found


@pytest.mark.parametrize('inside', [pytest.param(True, marks=pytest.mark.slow), False])
def test_play_inside_of_the_loop_is_told_from_play_beside_it(inside: bool, rng_seed: int) -> None:
    """Its size, and that the loop is closed on it; beside the loop it is play alone."""
    rng = np.random.default_rng(rng_seed)
    half = float(rng.uniform(50e-6, 150e-6))
    final = selected(half, inside, rng).final
    assert set(final.effects) == ({'backlash', 'sensor-feedback'} if inside else {'backlash'})
    assert final.fit.rms < 1.05 * NOISE
    sizes = dict(zip((p.name for p in final.structure.parameters), final.fit.theta, strict=True))
    assert sizes['backlash'] == pytest.approx(half, abs=1.5e-6)
    assert sizes.get('feedback_share', 1.0) == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_a_plainer_description_comes_before_a_fault_in_the_loop(rng_seed: int) -> None:
    """Flow that falls with the position is no curved transducer that the controller reads.

    That fits to the noise, too, with two parameters more.
    """
    rng = np.random.default_rng(rng_seed)
    size = float(rng.uniform(1e5, 1.6e5))
    records = sweeps(PLANTS[1], (_POSITION_GAIN, size), rng)
    found = diagnose(records, settings=Thresholds(evaluations=0))
    assert found.complete and found.error.after < 1.05 * NOISE
    assert [e.name for e in found.effects] == ['learned-flow-q-x2']
    (estimate,) = found.effects[0].parameters.values()
    assert -estimate.mean == pytest.approx(size, rel=0.05)
