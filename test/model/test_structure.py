"""Structures: neutral is Eq. (2), batches, error sums, derivatives, extremes, streams."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from effect_records import EVERY, MANY, RATE, U, record, typical
from scipy import signal

from actuator_glue.errors import InputError
from actuator_glue.model import linear
from actuator_glue.model.effects import CATALOGUE, scale
from actuator_glue.model.exact import ExactErrors
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure
from actuator_glue.model.structure_errors import StructureErrors
from actuator_glue.records import Record


@pytest.mark.parametrize('hold', ['zoh', 'linear'])
@pytest.mark.parametrize('stiffness', [0.0, 250e3])
def test_neutral_is_eq_2_by_scipy(hold: str, stiffness: float) -> None:
    """Every effect, alone and all at once, switched off: scipy's response of Eq. (2)."""
    r = record(stiffness, hold)
    n0, d2, d1, d0 = (float(c) for c in linear.coefficients(TABLE_2, stiffness))
    method = 'zoh' if hold == 'zoh' else 'foh'
    num, den, _ = signal.cont2discrete(([n0], [d2, d1, d0]), r.period, method)
    expected = signal.lfilter(np.ravel(num), den, U)
    for names in [(), *((name,) for name in EVERY), EVERY]:
        structure = Structure(names)
        y = structure.simulate(structure.neutral(TABLE_2), r)
        assert np.abs(y - expected).max() < 1e-13, names


def test_no_effect_is_the_linear_kernel() -> None:
    """Structure(()) dispatches to Eq. (2): same bits, same error sums."""
    r = record(rate=256.0)
    theta = np.random.default_rng(1).uniform(0.7, 1.3, (5, 4)) * TABLE_2
    x = linear.simulate(theta, r.command, stiffness=250e3, period=r.period)
    assert np.array_equal(Structure(()).simulate(theta, r), x)
    assert np.array_equal(StructureErrors(Structure(()), [r])(theta), ExactErrors([r])(theta))


@pytest.mark.parametrize('names', [('coulomb-friction',), ('delay',), MANY, EVERY])
def test_batch_equals_single(names: tuple[str, ...]) -> None:
    """A parameter set's answer does not depend on its neighbours, bit for bit."""
    r = record()
    structure = Structure(names)
    rng = np.random.default_rng(2)
    theta = np.repeat(typical(names, r)[np.newaxis], 37, axis=0)
    # Fast poles in some rows need shorter sub-steps than others: lanes are grouped.
    theta[:, :4] *= rng.uniform(0.5, 8.0, (37, 4))
    batch = structure.simulate(theta, r)
    assert batch.shape == (37, len(U))
    for i in (0, 11, 36):
        assert np.array_equal(batch[i], structure.simulate(theta[i], r), equal_nan=True)


def test_threads_do_not_disturb_each_other() -> None:
    """The kernel releases the interpreter lock: answers are those of one thread."""
    r = record()
    jobs = [(Structure((name,)), typical((name,), r)) for name in EVERY]
    alone = [structure.simulate(theta, r) for structure, theta in jobs]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda job: job[0].simulate(job[1], r), jobs * 3))
    for i, y in enumerate(together):
        assert np.array_equal(y, alone[i % len(jobs)])


@pytest.mark.parametrize('name', EVERY)
def test_half_the_step_changes_little(name: str) -> None:
    """Typical sizes: sub-steps four times finer move the response by far less than 1 um rms.

    Where the spool slews, by 1.7 um of 500.
    """
    r = record()
    structure = Structure((name,))
    theta = structure.starts(TABLE_2, scale([r], TABLE_2))
    change = structure.simulate(theta, r) - structure.simulate(theta, r, rate=4)
    most = {'valve-rate': 2.0e-6, 'stribeck-friction': 1.0e-6, 'payload-inertia': 0.4e-6}
    limit = most.get(name, 0.15e-6)
    assert np.sqrt(np.mean(change**2, axis=1)).max() < limit


@pytest.mark.parametrize('initial', ['rest', 'measured'])
@pytest.mark.parametrize('names', [('gain', 'bias'), ('valve-deadband', 'drift'), MANY])
def test_error_sums_are_those_of_the_simulation(names: tuple[str, ...], initial: str) -> None:
    """Sums over counted samples of two records, from the simulation itself."""
    records = [record(0.0), record(250e3).slice(300, 1900)]
    settle = (0, 1100)
    structure = Structure(names)
    theta = np.stack([typical(names, records[0]), structure.neutral(TABLE_2)])
    errors = StructureErrors(structure, records, settle, initial)
    assert errors.sizes.tolist() == [len(U), 500]
    sums = errors(theta)
    for i, (r, skip) in enumerate(zip(records, settle, strict=True)):
        e = (r.measured - structure.simulate(theta, r, initial=initial))[:, skip:]
        assert np.allclose(sums[:, i, 0], e.sum(axis=1), rtol=1e-9, atol=1e-15)
        assert np.allclose(sums[:, i, 1], (e**2).sum(axis=1), rtol=1e-9, atol=1e-20)
        assert np.array_equal(errors.residuals(theta)[i], e)
    assert errors(theta[0]).shape == (2, 2)


def test_measured_start_needs_no_settling() -> None:
    """A window cut from a running test is simulated from its own first samples."""
    r = record(250e3, rate=1024.0).slice(3000, 5000)
    for names in [(), ('backlash', 'valve-deadband')]:
        structure = Structure(names)
        theta = structure.neutral(TABLE_2)
        late = structure.simulate(theta, r, initial='measured') - r.measured
        assert np.abs(late).max() < 40e-6  # of 2 mm; from rest the error is 1 mm
        assert np.abs(late[-200:]).max() < 1e-9


@pytest.mark.parametrize('name', EVERY)
def test_every_parameter_of_an_entry_acts(name: str) -> None:
    """An entry whose stage does not know one of its parameters would be ignored in silence."""
    r = record(250e3)
    names = (name, 'backlash') if name == 'sensor-feedback' else (name,)  # which alone is nothing
    structure = Structure(names)
    for which in range(2):  # some parameters of a shape act in some of the typical sizes only
        theta = np.repeat(typical(names, r, which)[np.newaxis], len(structure.names) + 1, axis=0)
        for j in range(4, theta.shape[1]):
            p = structure.parameters[j]
            theta[j, j] += 0.05 * (p.upper - p.lower) * (1.0 if theta[j, j] < p.upper else -1.0)
        y = structure.simulate(theta, r, origin=5.0)
        changed = np.abs(y - y[-1]).max(axis=1)
        variance = structure.variance(theta, r, y)
        changed += np.sqrt(np.abs(variance - variance[-1]).max(axis=1))
        if (changed[4:-1] > 1e-9).all():
            return
    raise AssertionError(dict(zip(structure.names[4:], changed[4:-1], strict=True)))


def test_noise_like_effects_leave_the_mean_and_add_variance() -> None:
    """Quantisation d^2/12, timing-jitter (s v)^2; the expected record stays."""
    r = record()
    names = ('quantisation', 'timing-jitter')
    structure = Structure(names)
    theta = np.array([*TABLE_2, 12e-6, 3e-4])
    y = structure.simulate(theta, r)
    assert np.array_equal(y, Structure(()).simulate(TABLE_2, r))
    variance = structure.variance(theta, r, y)
    velocity = np.gradient(y, r.period)
    assert np.allclose(variance, 12e-6**2 / 12.0 + (3e-4 * velocity) ** 2)
    assert not Structure(('delay',)).variance(np.array([*TABLE_2, 1e-3]), r, y).any()
    # The simulator's record has that variance: mean square over many samples, 5-sigma bounds.
    stream = Stream(
        structure, theta, stiffness=250e3, period=r.period, rng=np.random.default_rng(5)
    )
    recorded, _ = stream.step(U)
    ratio = np.sum((recorded - y) ** 2) / np.sum(variance)
    assert abs(ratio - 1.0) < 5.0 * np.sqrt(2.0 * np.sum(variance**2)) / np.sum(variance)
    assert np.allclose(recorded / 12e-6, np.round(recorded / 12e-6), atol=1e-6)


@pytest.mark.parametrize('name', EVERY)
def test_bounds_are_survived(name: str) -> None:
    """All corners of an effect's box at awkward base parameters: finite or cleanly not."""
    r = record().slice(0, 600)
    structure = Structure((name,))
    lower, upper = structure.bounds()
    columns = structure.columns(name)
    corners = np.stack(np.meshgrid(*zip(lower[columns], upper[columns], strict=True)), axis=-1)
    corners = corners.reshape(-1, columns.stop - columns.start)
    bases = np.array([TABLE_2, lower[:4], upper[:4], [400.0, 2e10, 10.0, 0.0], [1e-3] * 4])
    theta = np.array([[*b, *c] for b in bases for c in corners])
    with np.errstate(all='ignore'):
        y = structure.simulate(theta, r)
        sums = StructureErrors(structure, [r])(theta)
    assert y.shape == (len(theta), 600)
    assert sums.shape == (len(theta), 1, 2)
    if name not in ('payload-inertia', 'specimen-hardening'):  # these may truly diverge
        assert np.isfinite(y[: len(corners)]).all()


@pytest.mark.parametrize('hold', ['zoh', 'linear'])
@pytest.mark.filterwarnings('error')
def test_absurd_parameters_stay_quiet(hold: str) -> None:
    """NaN gives NaN; infinity and negative sizes are survived; other rows are not touched."""
    r = record(hold=hold).slice(0, 300)
    for name in EVERY:
        structure = Structure((name,))
        good = typical((name,), r)
        rows = [good]
        for value in (np.nan, np.inf, -np.inf, -1.0, 0.0, 1e300):
            for i in range(len(good)):
                rows.append(good.copy())
                rows[-1][i] = value
        y = structure.simulate(np.array(rows), r)
        assert np.array_equal(y[0], structure.simulate(good, r))
        acts = len(good) if CATALOGUE[name].variance is None else 4
        assert np.isnan(y[1 : 1 + acts, 2:]).all(), name
        assert StructureErrors(structure, [r])(np.array(rows)).shape == (len(rows), 1, 2)


def test_bad_input_is_named() -> None:
    """Unknown, repeated, wrong shapes, unknown stiffness."""
    with pytest.raises(InputError, match="'slack' is not in the catalogue"):
        Structure(('slack',))
    with pytest.raises(InputError, match='named twice'):
        Structure(('delay', 'delay'))
    with pytest.raises(InputError, match=r'takes \(5,\) or \(m, 5\)'):
        Structure(('delay',)).simulate(TABLE_2, record())
    with pytest.raises(InputError, match='stiffness is not known'):
        Structure(('delay',)).simulate(np.zeros(5), Record(U, U, 1.0 / RATE))
    with pytest.raises(InputError, match='does not have the effect'):
        Structure(('delay',)).columns('gain')
