"""A cause whose shape the catalogue does not hold is described by its own."""

import numpy as np
import pytest
from smooth_machines import piston
from two_sweeps import RATE, motions, selected_of, sweep

from actuator_glue.diagnosis.moves import learned_terms
from actuator_glue.diagnosis.refits.candidates import mean_effects
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.model import commands
from actuator_glue.records import Record

FRICTION = 125.0
THETA = np.array([400.0, 5.5e10, 2e6, 1.5])
NAMES = ('coulomb-friction', 'stribeck-friction', 'gain', 'viscous-damping', 'bias')


def held_out(found: Selection, kind: int) -> float:
    """Error of a structure on slow small motion without any noise [m]."""
    u = commands.noise(RATE, 30.0, 0.2, 3.0, seed=5)
    u *= 5e-4 / np.abs(u).max()
    y = piston(u, 1.0 / RATE, THETA, 250e3, (kind, FRICTION))
    record, final = Record(u, y, 1.0 / RATE, stiffness=250e3), found.final
    left = y - final.structure.simulate(final.fit.theta, record)
    return float(np.sqrt(np.mean(left**2)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ('kind', 'form', 'where', 'share', 'names'),
    [
        pytest.param(11, 'learned-force-friction', 1e-3, 0.4, NAMES, id='velocity'),
        pytest.param(14, 'learned-force-presliding', 5e-6, 0.6, NAMES, id='way'),
        pytest.param(11, 'learned-force-friction', 1e-3, 0.4, NAMES[1:], id='told-as-falling'),
    ],
)
def test_friction_that_is_reached_late_has_its_shape(
    kind: int, form: str, where: float, share: float, names: tuple[str, ...]
) -> None:
    """As Coulomb friction it leaves less than what matters here, and more on slow motion.

    Over noises the force scatters by 1 % and the velocity by 4 %; that form removes 3.2 to 3.4 um,
    0.6 are asked for, and 300 nats and more. A spring that slips comes near to the bristle, 1.0 um
    instead of 2.3 are left of slow motion.
    """
    u = sweep(2e-3, 8.0, 32.0)
    machine = [(k, u, piston(u, 1.0 / RATE, THETA, k, (kind, FRICTION))) for k in (0.0, 250e3)]
    beam, found = selected_of(names, machine)
    assert found.left < found.material
    shaped = learned_terms.with_terms(beam, found)
    assert shaped is not None
    assert shaped.final.effects == (form,)
    force, reached = shaped.final.fit.theta[4:]
    assert force == pytest.approx(FRICTION, rel=0.06)
    assert reached == pytest.approx(where, rel=0.25)
    assert held_out(shaped, kind) < share * held_out(found, kind)


@pytest.mark.slow
def test_friction_that_is_there_at_once_keeps_its_name() -> None:
    """Its shape is that of the catalogue.

    Of 158 noises one had it as friction that falls with velocity: a seed is written down.
    """
    effects = {'coulomb-friction': FRICTION}
    machine = motions(effects, THETA, sweep(2e-3, 8.0, 16.0), (0.0, 250e3))
    beam, found = selected_of(NAMES, machine, 1)
    assert found.final.effects == ('coulomb-friction',)
    assert learned_terms.with_terms(beam, found) is None


VALVE = ('valve-deadband', 'coulomb-friction', 'valve-null', 'gain', 'bias')
MACHINE = np.array([230.0, 3.5e9, 4e5, 0.6])


@pytest.mark.slow
def test_a_wrong_name_that_seems_enough_gives_way() -> None:
    """Lost motion of the command leaves next to nothing as a dead band of the valve."""
    u = sweep(2e-3, 8.0, 32.0)
    machine = [(k, u, piston(u, 1.0 / RATE, MACHINE, k, (6, 25e-6))) for k in (0.0, 250e3)]
    beam, found = selected_of(mean_effects(), machine)
    assert len(found.final.effects) == 1 and found.left < found.material
    told = learned_terms.with_terms(beam, found)
    assert told is not None
    assert told.final.effects == ('learned-command-play',)
    assert told.final.fit.theta[4] == pytest.approx(25e-6, rel=0.1)


@pytest.mark.slow
def test_a_right_name_stays() -> None:
    """No form of all is better by what a description must be."""
    effects = {'valve-deadband': 60e-6}
    machine = motions(effects, MACHINE, sweep(2e-3, 8.0, 32.0), (0.0, 250e3))
    beam, found = selected_of(VALVE, machine)
    assert found.final.effects == ('valve-deadband',)
    assert learned_terms.with_terms(beam, found) is None
