"""The measured force as evidence: what it tells apart, and what it must not pass for."""

from dataclasses import replace

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.diagnosis.samples.force import with_forces
from actuator_glue.errors import InputError
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.space import Space, jacobian
from actuator_glue.model.force_errors import ForceErrors, shown
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

THETA = [133.65, 1.1005e9, 2.4927e5, 1.0]
RATE, NOISE, FORCE_NOISE = 200.0, 20e-6, 20.0  # Hz, m, N


def swept(
    rng: np.random.Generator, effects: tuple[str, ...], sizes: list[float], gain: float = 1.0
) -> Record:
    """A sweep to 10 Hz against 250 kN/m, its force through a transducer of this gain."""
    time = np.arange(0.0, 15.0, 1.0 / RATE)
    command = 2e-3 * np.sin(np.pi * 10.0 / 15.0 * time**2)
    still = Record(command, np.zeros_like(command), 1.0 / RATE, 250e3)
    theta, structure = np.array(THETA + sizes), Structure(effects)
    force = structure.simulate(theta, still, force=True)
    return replace(
        still,
        measured=structure.simulate(theta, still) + NOISE * rng.standard_normal(len(command)),
        force=gain * force + 30.0 + FORCE_NOISE * rng.standard_normal(len(command)),
    )


@pytest.mark.parametrize(
    ('effects', 'sizes'),
    [
        ((), []),
        (('viscous-damping',), [3e4]),
        (('payload-inertia', 'sensor-lag'), [400.0, 60.0, 0.004]),
        (('coulomb-friction',), [300.0]),
        (('specimen-hardening', 'backlash'), [1e5, 5e-5]),
    ],
)
def test_the_force_is_that_of_the_balance(effects: tuple[str, ...], sizes: list[float]) -> None:
    """What specimen, friction and mass take, from the piston's own simulated motion."""
    record = replace(swept(np.random.default_rng(0), effects, sizes), hold='linear')
    theta, structure = np.array(THETA + sizes), Structure(effects)
    force = structure.simulate(theta, record, force=True)
    # The recorded displacement without what stands behind the piston.
    inner = tuple(e for e in effects if e not in ('sensor-lag', 'backlash'))
    bare = [s for e, s in zip(('mass', 'mass_damping', 'lag'), sizes, strict=False) if e != 'lag']
    own = np.array(THETA + (bare if 'payload-inertia' in effects else sizes[: len(inner)]))
    x = Structure(inner).simulate(own, record)
    v = np.gradient(x, record.period)
    if 'viscous-damping' in effects:
        expected = 250e3 * x + 3e4 * v
    elif 'payload-inertia' in effects:
        expected = 250e3 * x + 400.0 * (np.gradient(v, record.period) + 60.0 * v)
    elif 'coulomb-friction' in effects:
        expected = 250e3 * x + 300.0 * np.sign(v)
    elif 'specimen-hardening' in effects:
        expected = 250e3 * x * (1.0 + 1e5 * x**2)
    else:
        expected = 250e3 * x
    # Differences over two samples, and signs at reversals, are what is compared with.
    off = (force - expected)[200:2000]
    if 'coulomb-friction' in effects:  # a piston that sticks takes any force up to it
        assert np.abs(force - 250e3 * x).max() < 301.0
        off = off[np.abs(v[200:2000]) > 0.2 * np.abs(v).max()]
    assert np.sqrt(np.mean(off**2)) < 0.05 * np.std(expected[200:2000])
    assert np.median(np.abs(off)) < 0.005 * np.std(expected)


def test_gain_and_offset_belong_to_the_transducer(rng_seed: int) -> None:
    """Errors do not depend on them; a force against the simulated one is explained by nothing."""
    rng = np.random.default_rng(rng_seed)
    simulated = rng.standard_normal((3, 400))
    measured = 5.0 - 2.0 * simulated[0] + rng.standard_normal(400)
    np.testing.assert_allclose(shown(simulated[:1], measured)[0], measured.mean())
    simulated[2] = 7.0
    assert np.isfinite(shown(simulated, measured)).all()
    assert np.isnan(shown(np.full((1, 400), np.nan), measured)).all()
    record = swept(rng, (), [])
    assert record.force is not None
    scaled = replace(record, force=1.2 * record.force - 400.0)
    theta = np.array([THETA])
    one, other = (ForceErrors(Structure(()), [r])(theta)[0, 0] for r in (record, scaled))
    assert other == pytest.approx(1.2**2 * one)


def deviations(data: Data, theta: Array) -> Array:
    """Standard deviations of log alpha_2 and damping by the curvature of the squared error."""
    model = Structure(('viscous-damping',))
    space = Space(model, 15.0)
    slopes = jacobian(data, model, space, space.z(theta[None]), data.simulate(model, theta))[0]
    covariance = NOISE**2 * np.linalg.inv(slopes @ slopes.T)
    return np.asarray(np.sqrt(np.diag(covariance)[[2, 4]]))


@pytest.mark.slow
def test_the_force_tells_damping_from_the_actuator(rng_seed: int) -> None:
    """Damping of the specimen is one of the base parameters' doings to the displacement alone.

    There chains do not even meet. The phase of the force is its own: the posterior is as narrow as
    the curvature of both errors says. A gain of 1.1 of the load cell is told, and is no
    stiffness. Bounds of five standard deviations are left by chance once in a million runs. The
    search for the start ended beside the posterior in one of 121 runs, before such a start was
    begun anew.
    """
    record = swept(np.random.default_rng(rng_seed), ('viscous-damping',), [3e4], gain=1.1)
    theta, alone = np.array([*THETA, 3e4]), Data.whole([record])
    without = deviations(alone, theta)
    expected = deviations(with_forces(alone, Structure(('viscous-damping',)), theta), theta)
    assert (expected < 0.1 * without).all()
    found = ag.calibrate(record, effects=['viscous-damping'], evaluations=40_000, use_force=True)
    damping, oil = found.parameters['damping'], found.parameters['alpha_2']
    assert damping.stddev == pytest.approx(expected[1], rel=0.25)
    assert oil.stddev / oil.mean == pytest.approx(expected[0], rel=0.25)
    assert abs(damping.mean - 3e4) < 5.0 * damping.stddev
    (force,) = found.force
    assert force.gain == pytest.approx(1.1, rel=0.02)
    assert force.rms_n == pytest.approx(FORCE_NOISE, rel=0.1)
    assert force.offset_n == pytest.approx(30.0, abs=10.0)
    content = found.to_json()
    assert content['use_force'] is True and content['force'][0]['gain'] == force.gain
    assert any('would have a gain of 1.' in note for note in found.notes)
    assert any('that of the force' in note for note in found.notes)


def test_a_force_that_cannot_be_evidence_is_refused(rng_seed: int) -> None:
    """One error each: none recorded, wrong sign, wrong unit, not connected, no likelihood."""
    record = swept(np.random.default_rng(rng_seed), (), [])
    assert record.force is not None
    for force, words in (
        (None, 'no force is recorded'),
        (-record.force, 'moves against the displacement'),
        (1e-3 * record.force, 'units of the force channel'),
        (0.0 * record.force, 'force is constant'),
    ):
        with pytest.raises(InputError, match=words):
            ag.calibrate(replace(record, force=force), use_force=True)
    with pytest.raises(InputError, match='ar1'):
        ag.calibrate(record, use_force=True, likelihood='ar1')
