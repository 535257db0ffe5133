"""A run that comes part by part is the run that comes whole, however many sets and samples."""

import numpy as np
import pytest

from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.decimate import means
from actuator_glue.inference.least_squares.free_run import _decimated, parts
from actuator_glue.model import commands
from actuator_glue.model.exact import Initial
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 1000.0
THETA = np.array([128.0, 1.01e9, 2.42e5, 0.3])
# More parameter sets than lanes, some of which need shorter steps; linear; Eq. (2) alone.
STRUCTURES = ('backlash', 'bias'), ('viscous-damping',), ()


def sets(structure: Structure, count: int, rng: np.random.Generator) -> np.ndarray:
    table = np.array(
        [structure.neutral(THETA * (1.0 + 0.1 * rng.standard_normal(4))) for _ in range(count)]
    )
    table[::7, 1] *= 9.0
    table[:, 4:] += 1e-4 * rng.uniform(0.1, 1.0, table[:, 4:].shape)
    return table


def shaken(samples: int) -> Record:
    command = commands.noise(RATE, samples / RATE, 0.2, 8.0, seed=samples)[:samples]
    return Record(command, command + 1e-5, 1.0 / RATE, stiffness=250e3)


@pytest.mark.parametrize('effects', STRUCTURES)
@pytest.mark.parametrize('initial', ['rest', 'measured'])
def test_counted_samples_are_those_of_the_whole_run(
    effects: tuple[str, ...], initial: Initial
) -> None:
    structure, record = Structure(effects), shaken(9001)
    table = sets(structure, 70, np.random.default_rng(len(effects)))
    rng = np.random.default_rng(7)
    mask = np.repeat(rng.random(len(record) // 53 + 1) < 0.5, 53)[: len(record)]
    data = Data((record,), (mask,), (initial,), (record,), (0.0,))
    whole = structure.simulate(table, record, initial=initial)
    np.testing.assert_array_equal(data.simulate(structure, table), whole[:, mask])


@pytest.mark.parametrize('effects', STRUCTURES)
@pytest.mark.parametrize(('count', 'samples'), [(2, 6000), (3, 4097), (8, 8191), (8, 15)])
def test_means_are_those_of_the_whole_run(
    effects: tuple[str, ...], count: int, samples: int
) -> None:
    structure, record = Structure(effects), shaken(max(samples, 2000)).slice(0, samples)
    table = sets(structure, 5, np.random.default_rng(samples))
    out = np.full((5, -(-samples // count)), np.nan)
    for which, at, y in parts(structure, table, record, 'rest', 0.0, count):
        out[which, at : at + len(y)] = y.T
    whole = structure.simulate(table, record)
    expected = [means(row, count) for row in whole]
    np.testing.assert_allclose(out, expected, rtol=0.0, atol=1e-12 * np.abs(whole).max())


def test_a_decimated_record_is_simulated_finer_part_by_part() -> None:
    """As many samples as the decimated record has, whatever is left over of the recorded one."""
    command = commands.sweep(5000.0, 10.0, 0.0, 5.0, 2e-3)[:-3]
    record = Record(command, 0.9 * command, 1.0 / 5000.0, stiffness=250e3)
    fit = prepare([record], []).fit
    factor = fit.factors[0]
    assert factor > 1 and len(record) % factor
    finer = Data(fit.records, fit.masks, fit.initials, fit.recorded, fit.origins, finer=True)
    structure = Structure(('backlash',))
    theta = structure.neutral(THETA)[np.newaxis]
    y = structure.simulate(theta, record)[0]
    expected = means(y, factor)[fit.masks[0]]
    np.testing.assert_allclose(finer.simulate(structure, theta)[0], expected, rtol=0.0, atol=1e-15)


@pytest.mark.filterwarnings('error')
def test_what_diverges_is_not_finite_and_nothing_else() -> None:
    """Absurd parameters are seen by who asked for them; the others beside them are as alone."""
    y = np.random.default_rng(1).standard_normal((4096, 2))
    y[1000:, 1] = np.inf * (-1.0) ** np.arange(3096)
    run = iter([(np.arange(2), at, y[at : at + 2048]) for at in (0, 2048)])
    out = np.concatenate([part for _, _, part in _decimated(run, 4, len(y))])
    assert not np.isfinite(out[260:, 1]).any()
    np.testing.assert_allclose(out[:, 0], means(y[:, 0], 4), rtol=0.0, atol=1e-14)
