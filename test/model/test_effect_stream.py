"""Effects stepped block by block."""

from __future__ import annotations

import numpy as np
import pytest
from effect_records import EVERY, MANY, RATE, U, record, typical

from actuator_glue.errors import InputError
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure


@pytest.mark.parametrize('hold', ['zoh', 'linear'])
@pytest.mark.parametrize('names', [(), ('delay',), ('hum', 'drift'), MANY, EVERY])
def test_stream_is_the_simulation_in_any_blocks(names: tuple[str, ...], hold: str) -> None:
    """Blocks of any length give the same bits, and those of Structure.simulate."""
    r = record(hold=hold)
    quiet = tuple(n for n in names if CATALOGUE[n].variance is None)
    structure = Structure(quiet)
    theta = typical(quiet, r)
    stream = Stream(structure, theta, stiffness=250e3, period=r.period, hold=hold)
    whole, force = stream.step(U)
    expected = structure.simulate(theta, r)
    assert np.abs(whole - expected).max() < 1e-15 + 1e-9 * np.abs(expected).max()
    assert np.isfinite(force).all() and np.abs(force).max() > 100.0

    noisy = Structure(names)
    theta = typical(names, r)
    first, second = (
        Stream(
            noisy,
            theta,
            stiffness=250e3,
            period=r.period,
            hold=hold,
            rng=np.random.default_rng(3),
            noise_stddev=1e-6,
        )
        for _ in range(2)
    )
    whole, force = first.step(U)
    rng, at, parts = np.random.default_rng(4), 0, []
    while at < len(U):
        block = U[at : at + int(rng.integers(0, 60))]
        parts.append(second.step(block))
        at += len(block)
    assert np.array_equal(np.concatenate([p[0] for p in parts]), whole)
    assert np.array_equal(np.concatenate([p[1] for p in parts]), force)


def test_stream_refuses_what_it_cannot_do() -> None:
    """Look-ahead, missing generator, bad blocks: said, and the state stays."""
    period = 1.0 / RATE
    with pytest.raises(InputError, match='ahead of its command'):
        Stream(Structure(('clock-skew',)), [*TABLE_2, -1e-4], stiffness=0.0, period=period)
    with pytest.raises(InputError, match='random generator'):
        Stream(Structure(()), TABLE_2, stiffness=0.0, period=period, noise_stddev=1e-6)
    with pytest.raises(InputError, match='theta'):
        Stream(Structure(()), [*TABLE_2, 1.0], stiffness=0.0, period=period)
    stream = Stream(Structure(('delay',)), [*TABLE_2, 1e-3], stiffness=0.0, period=period)
    before, _ = stream.step(U[:500])
    with pytest.raises(InputError, match='finite'):
        stream.step([0.0, np.nan])
    after, _ = stream.step(U[500:])
    r = record(0.0)
    expected = Structure(('delay',)).simulate([*TABLE_2, 1e-3], r)
    assert np.array_equal(np.concatenate([before, after]), expected)
    stream.reset()
    assert np.array_equal(stream.step(U)[0], expected)
