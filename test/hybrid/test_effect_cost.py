"""What effects cost of the delay margin, nonlinear ones by their describing functions."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.api import effect_cost
from actuator_glue.hybrid import describing
from actuator_glue.hybrid.actuator import actuator
from actuator_glue.hybrid.compensator import Compensator
from actuator_glue.hybrid.design import Loop, compensator_of
from actuator_glue.io.partition import read_partition
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])
AMPLITUDE = 5e-3


def loop_with(effects: tuple[str, ...], *sizes: float) -> tuple[Loop, Compensator]:
    """Return the benchmark's first case with three draws of an actuator, compensated."""
    partition = read_partition('benchmark_case_1')
    structure = Structure(effects)
    draws = np.array([[*THETA * f, *sizes] for f in (0.98, 1.0, 1.02)])
    specimen = {n: np.repeat(v, 3) for n, v in partition.specimen.nominal.items()}
    loop = Loop.of(partition, draws, structure.names, effects, specimen)
    return loop, compensator_of('inverse', loop)


@pytest.mark.parametrize(('band', 'frequency'), [(1e-4, 2.0), (3e-4, 2.0), (5e-4, 6.0)])
def test_a_dead_band_is_the_gain_of_textbooks(band: float, frequency: float) -> None:
    """N(E) = 1 - 2/pi (asin r + r sqrt(1 - r^2)), r = band/E (Gelb and Vander Velde 1968).

    The valve sees the control error, whose amplitude E follows from the loop with the gain N;
    what is left is the third harmonic that comes back, some hundredths of the first.
    """
    k = 250e3
    test = describing.sine(frequency, AMPLITUDE, k)
    moved, _ = describing.describing(
        Structure(('valve-deadband',)), np.array([[*THETA, band]]), test
    )
    gain = 1.0
    for _ in range(200):
        error = AMPLITUDE * abs(1.0 - response(THETA, gain, k, frequency))
        r = min(band / error, 1.0)
        gain = 0.5 * (gain + 1.0 - 2.0 / np.pi * (np.arcsin(r) + r * np.sqrt(1.0 - r * r)))
    assert moved[0] == pytest.approx(response(THETA, gain, k, frequency), rel=0.02)
    assert gain < 0.97


def response(theta: Array, gain: float, k: float, frequency: float) -> complex:
    """Return motion over command of Eq. (2) with a valve of another gain."""
    other = theta * np.array([1.0, gain, 1.0, 1.0])
    test = describing.sine(frequency, AMPLITUDE, k)
    return complex(describing.describing(Structure(()), other[None], test)[0][0])


@pytest.mark.parametrize(('name', 'size'), [('delay', 3e-3), ('valve-lag', 4e-3)])
def test_what_is_linear_costs_the_same_by_its_describing_function(
    name: str, size: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once as a linear effect, once as if it were none."""
    loop, chosen = loop_with((name,), size)
    margin = effect_cost.margins(loop, chosen)[0]
    exact = effect_cost.effect_costs(loop, chosen, margin, 0.0)[name]
    without = loop.draws.copy()
    without[:, -1] = 0.0
    actuators = actuator(without, loop.names, loop.effects, loop.specimen['stiffness'])
    for module in (effect_cost, describing):
        monkeypatch.setattr(module, 'nonlinear', lambda effects: tuple(effects))
    found = effect_cost._nonlinear(replace(loop, actuators=actuators), chosen, AMPLITUDE)
    assert abs(exact.median) > 1e-4
    assert found[name].median == pytest.approx(exact.median, rel=0.05)


def test_the_cost_of_a_dead_band_falls_with_the_amplitude() -> None:
    """A dead band is a slower valve, the slower the less it is asked; nothing costs nothing."""
    costs = []
    for band, amplitude in ((3e-4, 2e-3), (3e-4, 2e-2), (0.0, 2e-3)):
        loop, chosen = loop_with(('valve-deadband', 'delay'), band, 2e-3)
        margin = effect_cost.margins(loop, chosen)[0]
        found = effect_cost.effect_costs(loop, chosen, margin, amplitude)
        assert found['delay'].median == pytest.approx(2e-3, rel=0.05)
        costs.append(found['valve-deadband'].median)
    assert costs[0] > 2.0 * costs[1] > 0.0
    assert abs(costs[2]) < 1e-6
    assert 'valve-deadband' not in effect_cost.effect_costs(loop, chosen, margin, 0.0)


def test_a_specimen_that_softens_takes_loop_gain_away() -> None:
    """The force's describing function counts, not the motion's alone."""
    loop, _ = loop_with(('specimen-yield',), 0.2, 1e-3, 1.0)
    nominal = loop.partition.specimen.nominal
    values = {n: float(v[0]) for n, v in nominal.items()}
    small, large = (
        describing.force_ratio(loop.draws, loop.names, loop.effects, values, (2.0, a))
        for a in (1e-5, 2e-2)
    )
    np.testing.assert_allclose(small, 1.0, atol=0.02)
    assert (np.abs(large) < 0.5).all()
