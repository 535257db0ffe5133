"""What decides between structures: noise under stationary commands, forms held by a bound."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal
from trials import THETA

from actuator_glue.diagnosis.refits.candidates import mean_effects
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import Scorer, pooled, splits_of
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.thresholds import TRIED, Thresholds
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 128.0


def stationary(
    effects: tuple[str, ...], sizes: list[float], seed: int, fading: float = 0.0
) -> Data:
    """A random command between 0.1 and 7 Hz without and with a specimen, 10 um of noise.

    It may fade (1/s).
    """
    rng, n, records = np.random.default_rng(seed), int(40 * RATE), []
    for k in (0.0, 250e3):
        sos = signal.butter(3, [0.1, 7.0], 'bandpass', fs=RATE, output='sos')
        u = signal.sosfilt(sos, rng.standard_normal(n)) * np.minimum(1.0, np.arange(n) / 256)
        u *= np.exp(-fading * np.arange(n) / RATE)
        u *= 2e-3 / np.abs(u).max()
        y = Structure(effects).simulate(np.append(THETA, sizes), Record(u, u, 1 / RATE, k))
        records.append(Record(u, y + 1e-5 * rng.standard_normal(n), 1 / RATE, k))
    return Data.whole(records)


def beam(data: Data) -> BeamSearch:
    """The first step of a selection: Eq. (2) fitted, noise taken from what it leaves."""
    found = BeamSearch(Refits(data, mean_effects()), Thresholds(), lambda stage, share: None)
    found.renoise()
    return found


def test_structure_under_a_stationary_command_is_no_noise() -> None:
    """40 um of play: all of its error looks stationary, a forecast of left-out blocks does not."""
    found = beam(stationary(('backlash',), [4e-5], 1))
    error = found.refits.base().error
    looks = pooled(found.refits.data, splits_of(found.refits.data, error))[1]
    assert looks > 1.5e-5
    assert 0.97e-5 < found.noise < 0.75 * looks
    left = found.left(found.refits.trial(()))
    assert np.hypot(left, found.noise) == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-6)
    assert left > found.material


def test_noise_under_a_stationary_command_stays_noise() -> None:
    """A healthy machine: nothing can be forecast beyond chance."""
    found = beam(stationary((), [], 2))
    assert found.noise == pytest.approx(1e-5, rel=0.05)
    assert found.left(found.refits.trial(())) < 0.3 * found.noise


def test_a_transducer_may_bend_by_a_tenth_of_a_short_stroke() -> None:
    """180 um of y^2 at 1.5 mm, 75 1/m: found inside its bounds, the error down to the noise."""
    t = np.arange(int(24 * RATE)) / RATE
    u = 1.55e-3 * np.sin(np.pi * (8.0 / 24.0) * t**2)
    bent = Structure(('sensor-curve',))
    y = bent.simulate(np.append(THETA, [75.0, 0.0]), Record(u, u, 1 / RATE, 0.0))
    y += 1e-5 * np.random.default_rng(3).standard_normal(len(u))
    found = beam(Data.whole([Record(u, y, 1 / RATE, stiffness=0.0)]))
    trial = found.refits.polish(found.refits.add(found.refits.trial(()), 'sensor-curve'))
    assert trial.fit.theta[4] == pytest.approx(75.0, rel=0.02)
    assert trial.fit.rms < 1.05e-5


@pytest.mark.parametrize('seed', [1, 2])
def test_structure_under_a_shaking_that_fades_is_no_noise(seed: int) -> None:
    """A dead zone of 30 um: the motion is told from noise, what it leaves is not (18.8 um)."""
    found = beam(stationary(('valve-deadband',), [3e-5], seed, fading=0.08))
    data, error = found.refits.data, found.refits.base().error
    structure, noise = pooled(data, splits_of(data, data.target))
    assert noise**2 < 0.3 * (structure**2 + noise**2)
    assert pooled(data, splits_of(data, error))[1] > 1.8e-5
    assert 0.97e-5 < found.noise < 1.2e-5


@pytest.mark.parametrize(('size', 'alike'), [(3e-7, True), (2e-5, False)])
def test_what_leaves_structure_takes_no_place_of_a_whole(size: float, alike: bool) -> None:
    """A hundred nats of noise, beside slow structure that matters or does not."""
    found = beam(stationary((), [], 3))
    base, noise = found.refits.trial(()), found.refits.base().error
    at = np.arange(len(noise)) / RATE
    slow = np.sin(2 * np.pi * 0.3 * at) * np.sin(np.pi * at / 80) ** 2
    left = noise + size / slow.std() * slow
    other = replace(base, fit=replace(base.fit, error=left), scores=base.scores + 10.0)
    assert (found.behind(other, base) < 4.0) is alike


def test_all_that_remains_may_count_as_noise() -> None:
    """Play of 40 um under a stationary command: what is left has unit variance then."""
    found = beam(stationary(('backlash',), [4e-5], 4))
    data, error = found.refits.data, found.refits.base().error
    error = error * (1.0 + np.arange(len(error)) / len(error)) ** 4  # it grows: structure
    splits = splits_of(data, error)
    sizes = [
        float(np.mean(Scorer.of(data, splits, misfit=misfit).whiten(error) ** 2))
        for misfit in (True, False)
    ]
    assert sizes[0] == pytest.approx(1.0, rel=0.2)
    assert sizes[1] > 1.25 * sizes[0]


def payload_beside_a_skewed_clock(seed: int) -> Data:
    """Two sweeps, without and with a specimen: friction, a payload and a skewed clock."""
    names = ('coulomb-friction', 'payload-inertia', 'clock-skew')
    model, rng = Structure(names), np.random.default_rng(seed)
    t = np.arange(int(40 * RATE)) / RATE
    u = 2e-3 * np.sin(np.pi * (10.0 / 40.0) * t**2)
    theta = model.neutral(THETA)
    for name, size in (('coulomb-friction', 200.0), ('clock-skew', 3e-4)):
        theta[model.columns(name)] = size
    theta[model.columns('payload-inertia')] = 500.0
    records = []
    for k in (0.0, 250e3):
        y = model.simulate(theta, Record(u, u, 1 / RATE, k))
        records.append(Record(u, y + 1e-5 * rng.standard_normal(len(t)), 1 / RATE, k))
    return Data.whole(records)


@pytest.mark.slow
def test_what_was_not_tried_is_screened_beside_the_members(rng_seed: int) -> None:
    """Damping is tried, which with Eq. (2) alone looks like others; nothing is tried again."""
    found = beam(payload_beside_a_skewed_clock(rng_seed))
    refits = found.refits
    current = refits.trial(())
    for name in ('coulomb-friction', 'clock-skew'):
        current = refits.add(current, name)
    found.renoise(refits.finished(current))
    current, most = refits.trial(current.effects), TRIED
    alone = refits.promises.best(current, set(refits.names) - set(current.effects))[:most]
    tried = {t.added for t in found.overlooked(current)}
    assert len(tried) == most
    assert 'viscous-damping' in tried - set(alone)
    assert not {t.added for t in found.overlooked(current)} & tried


def test_the_nearest_structure_gives_the_noise() -> None:
    """By the error it leaves out of sample, not by nats: those may be of misfit alone."""
    found = beam(stationary(('gain',), [1.05], 41))
    refits = found.refits
    trials = [refits.add(refits.trial(()), name) for name in ('bias', 'gain', 'drift')]
    assert found._nearest(trials).added == 'gain'


def test_a_member_gives_way_to_what_has_more_weight_in_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of known structures the heaviest is told; a pair that is pruned to less is no exchange."""
    found = beam(stationary(('gain',), [1.05], 41))
    refits = found.refits
    bias, lag, gain = (refits.add(refits.trial(()), n) for n in ('bias', 'sensor-lag', 'gain'))
    found.renoise(gain)
    bias, lag, gain = (refits.trial(t.effects, t.added) for t in (bias, lag, gain))
    assert found.behind(gain, lag) < 0.0 < found.behind(bias, lag)
    better = found._exchanged(lag, [[bias, gain]])
    assert better is not None and better.effects == ('gain',)
    told, rivals = found.settle(lag, refitted=False)
    assert told.effects == ('gain',) and rivals['gain'][0].name == 'gain'
    monkeypatch.setattr(found, 'pruned', lambda _: bias)
    assert found._exchanged(lag, [[bias, gain]]) is None
