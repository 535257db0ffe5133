"""Forces that remember: friction that holds as a spring until it slips, a damper on a spring."""

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.model.commands import sweep
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.effects.terms.expression import read
from actuator_glue.model.parameters import Parameter
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])
FORCE = 400.0
SLIPS = term(
    'slips',
    'force: f = f + held*(x - play(x, way))/way',
    (
        Parameter('held', 'N', 0.0, 1e4, 'friction', 0.0),
        Parameter('way', 'm', 1e-7, 1e-1, 'where it is reached', 1e-5),
    ),
)


def sweeping(stiffness: float, rate: float = 512.0) -> Record:
    """A sweep of 2 mm to 10 Hz, linear between samples."""
    u = sweep(rate, 3.0)
    return Record(u, u, 1.0 / rate, stiffness=stiffness, hold='linear')


def moved(record: Record, effect: Structure, *sizes: float) -> Array:
    """Displacement [m]."""
    return effect.simulate(np.array([*THETA, *sizes]), record)


def by_fine_steps(record: Record, force: float, way: float, steps: int) -> Array:
    """Displacement by Heun's rule: Eq. (2) with the slope of friction beside the oil's."""
    beta_1, into, alpha_2, alpha_3 = THETA
    k, h = record.known_stiffness(), record.period / steps
    x = q = kept = 0.0
    out = np.zeros(len(record))

    def slopes(x: float, q: float, u: float) -> tuple[float, float]:
        bent = x - np.clip(kept, x - way, x + way)
        f = k * x + force * bent / way
        pull = q - alpha_3 * f
        # Behind `way`, in its direction, friction grows no more.
        slides = abs(bent) >= way * (1.0 - 1e-12) and pull * bent > 0.0
        stiff = alpha_2 + k + (0.0 if slides else force / way)
        return pull / stiff, into * (u - x) - beta_1 * q

    for i in range(1, len(record)):
        for j in range(steps):
            u = np.interp([j / steps, (j + 1) / steps], [0, 1], record.command[i - 1 : i + 1])
            v, dq = slopes(x, q, u[0])
            v_end, dq_end = slopes(x + h * v, q + h * dq, u[1])
            x, q = x + 0.5 * h * (v + v_end), q + 0.5 * h * (dq + dq_end)
            kept = float(np.clip(kept, x - way, x + way))
        out[i] = x
    return out


@pytest.mark.slow
@pytest.mark.parametrize('stiffness', [0.0, 250e3])
def test_against_fine_steps(stiffness: float) -> None:
    """Friction of 5 and 50 um that holds back 40 um."""
    record = sweeping(stiffness)
    without = moved(record, Structure(()))
    for way in (5e-6, 50e-6):
        found = moved(record, Structure((SLIPS,)), FORCE, way)
        expected = by_fine_steps(record, FORCE, way, 100)
        assert 1e6 * np.std(found - without) > 20.0
        assert 1e6 * np.std(found - expected) < 0.2


@pytest.mark.parametrize('stiffness', [0.0, 250e3])
def test_what_it_is_where_it_always_or_never_slips(stiffness: float) -> None:
    """Over no way dry friction, over a long one a specimen that is stiffer."""
    record = sweeping(stiffness)
    dry = moved(record, Structure(('coulomb-friction',)), FORCE)
    errors = [
        1e6 * np.std(moved(record, Structure((SLIPS,)), FORCE, w) - dry) for w in (1e-6, 1e-7)
    ]
    assert errors[0] < 0.5
    assert errors[1] < 0.15 * errors[0]
    way = 2e-2
    held = moved(record, Structure((SLIPS,)), FORCE, way)
    spring = moved(sweeping(stiffness + FORCE / way), Structure(()))
    assert 1e6 * np.abs(held - spring).max() < 0.01


def test_neighbours_do_not_matter(rng_seed: int) -> None:
    """What one parameter set remembers is its own, whatever Newton's steps its neighbours need."""
    rng = np.random.default_rng(rng_seed)
    record = sweeping(250e3)
    forces, ways = rng.uniform(10.0, 1000.0, 40), rng.uniform(1e-6, 1e-4, 40)
    table = np.column_stack([np.tile(THETA, (40, 1)), forces, ways])
    together = Structure((SLIPS,)).simulate(table, record)
    for i in rng.integers(0, 40, 3):
        assert np.array_equal(moved(record, Structure((SLIPS,)), forces[i], ways[i]), together[i])


def test_neighbours_do_not_matter_beside_a_specimen_that_yields(rng_seed: int) -> None:
    """Its state is sought by the same Newton steps; it was refined with those of neighbours."""
    rng = np.random.default_rng(rng_seed)
    record, structure = sweeping(250e3), Structure(('specimen-yield', SLIPS))
    sizes = np.column_stack([rng.uniform(1.0, 1000.0, 40), np.geomspace(1e-6, 1e-4, 40)])
    table = np.column_stack([np.tile([*THETA, 0.1, 1e-3, 2.0], (40, 1)), sizes])
    together = structure.simulate(table, record)
    for i in rng.integers(0, 40, 3):
        assert np.array_equal(structure.simulate(table[i], record), together[i])


def test_blocks_are_the_whole(rng_seed: int) -> None:
    """A stream remembers from block to block, and its force is what the piston works against."""
    rng = np.random.default_rng(rng_seed)
    record = sweeping(250e3)
    theta = [*THETA, FORCE, 2e-5]
    stream = Stream(
        Structure((SLIPS,)), theta, stiffness=250e3, period=record.period, hold='linear'
    )
    cuts = np.sort(rng.integers(0, len(record), 20))
    parts = [stream.step(block) for block in np.split(record.command, cuts)]
    y, force = (np.concatenate(rows) for rows in zip(*parts, strict=True))
    assert np.allclose(y, moved(record, Structure((SLIPS,)), FORCE, 2e-5), rtol=0.0, atol=1e-12)
    rest = force - 250e3 * y
    assert np.abs(rest).max() == pytest.approx(FORCE, rel=0.02)


@pytest.mark.parametrize('name', ['integral(x)', 'limit_rate(x, a)'])
def test_other_memory_is_refused(name: str) -> None:
    """It says where such a function can act."""
    with pytest.raises(InputError, match=r'column 18: .* it can act at command, valve, flow only'):
        read(f'force: f = f + a*{name}', ('a',))


def relaxing(record: Record, more: float, time: float, steps: int) -> Array:
    """Displacement by Heun's rule: a spring beside the specimen, held by a dashpot."""
    beta_1, into, alpha_2, alpha_3 = THETA
    k, h = record.known_stiffness(), record.period / steps
    x = q = held = 0.0
    out = np.zeros(len(record))

    def slopes(x: float, q: float, held: float, u: float) -> tuple[float, float, float]:
        # d(held)/dt = more k v - held/time; alpha_2 v + df/dt = q - alpha_3 f.
        v = (q - alpha_3 * (k * x + held) + held / time) / (alpha_2 + k * (1.0 + more))
        return v, into * (u - x) - beta_1 * q, more * k * v - held / time

    for i in range(1, len(record)):
        for j in range(steps):
            u = np.interp([j / steps, (j + 1) / steps], [0, 1], record.command[i - 1 : i + 1])
            a = slopes(x, q, held, u[0])
            b = slopes(x + h * a[0], q + h * a[1], held + h * a[2], u[1])
            x, q, held = (
                value + 0.5 * h * (first + last)
                for value, first, last in zip((x, q, held), a, b, strict=True)
            )
        out[i] = x
    return out


@pytest.mark.parametrize(('more', 'time'), [(0.5, 0.02), (1.0, 0.2)])
def test_a_specimen_that_relaxes(more: float, time: float) -> None:
    """Below 0.1 um rms of what it does."""
    record = sweeping(2e6)
    found = moved(record, Structure(('specimen-relaxation',)), more, time)
    expected = relaxing(record, more, time, 20)
    assert 1e6 * np.std(found - moved(record, Structure(()))) > 20.0
    assert 1e6 * np.std(found - expected) < 0.1
