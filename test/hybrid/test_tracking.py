"""The tracking numbers of a calibration: known actuators, and what calibrate hands out."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.api.diagnosis import _fitted, _tracking
from actuator_glue.api.drawn import Drawn
from actuator_glue.api.frequency_response import frequency_response
from actuator_glue.api.hybrid_meaning import hybrid_meaning
from actuator_glue.api.tracking import record_tracking, records_tracking
from actuator_glue.hybrid.actuator import actuator
from actuator_glue.hybrid.indicators import TargetMotion, lag_by_blocks
from actuator_glue.hybrid.stability import tracking
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.structure import Structure

NAMES = ('beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3')
THETA = np.array([133.65, 1.1005e9, 2.4927e5, 0.006])


def drawn(structure: Structure, draws: np.ndarray) -> Drawn:
    """Return draws (m, p) of a structure, without records."""
    return Drawn(draws, structure.names, (), draws[0], structure, None, (), (), ())


def test_a_pure_delay_is_told_as_one() -> None:
    """The piston repeats the command ten samples later, but for what Eq. (2) makes of it."""
    sine = ag.Command('sine', rate=1000.0, duration=20.0, high=2.0)
    record = ag.simulate(
        sine, stiffness=250e3, theta=THETA, effects={'delay': {'delay': 0.01}},
        sensors=ag_sensors(),
    )  # fmt: skip
    draws = np.tile([*THETA, 0.01], (8, 1))
    found = record_tracking(draws, (*NAMES, 'delay'), Structure(['delay']), record, 'rest')
    plain = record_tracking(draws[:, :4], NAMES, Structure(), record, 'rest')
    for name in ('delay_at_1_hz_s', 'fei_delay_s', 'J1_s'):
        late = found.predicted[name].median - plain.predicted[name].median
        assert late == pytest.approx(0.01, abs=1.1e-3 if name == 'J1_s' else 2e-4)
    assert found.predicted['hsem'].median < plain.predicted['hsem'].median < 0.0
    for name, value in found.measured.items():
        assert value == pytest.approx(found.predicted[name].median, rel=1e-6, abs=1e-12)

    late = record_tracking(draws, (*NAMES, 'delay'), Structure(['delay']), record, 'rest', 5000)
    assert late.predicted['fei_delay_s'].median == pytest.approx(
        found.predicted['fei_delay_s'].median, rel=0.01
    )
    assert late.predicted['ti_m2'].median < found.predicted['ti_m2'].median


def ag_sensors() -> object:
    """Sensors without noise."""
    from actuator_glue.api.simulation import Sensors

    return Sensors(noise=0.0, force_noise=0.0)


def test_a_diagnosis_tells_of_the_records_it_was_fitted_to() -> None:
    """Records from before a change of the machine are left out of the fit."""
    theta = np.array([235.0, 5.0e10, 4.23e6, 3.3])
    records = [
        replace(ag.simulate(theta=theta, stiffness=250e3, seed=i), source=name)
        for i, name in enumerate(('before.csv', 'after.csv'))
    ]
    found = SimpleNamespace(
        names=Structure(()).names,
        model=Structure(()),
        joint=np.tile(theta, (8, 1)),
        setup=None,
        sampling=({'source': 'after.csv', 'fitted_rate_hz': records[1].rate / 2},),
    )
    (told,) = _tracking(found, _fitted(found, records), records)
    assert told.source == 'after.csv'


def test_a_calibration_and_a_diagnosis_count_the_same_samples(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A record at 1 kHz, of which a diagnosis fits means of three; it starts amid a motion.

    With impulses, which are no motion: the record's own numbers are the same from both, and so
    are those of equal draws.
    """
    record = ag.simulate(ag.Command(duration=12.0, high=8.0), stiffness=250e3, seed=3)
    measured = record.measured.copy()
    measured[[5000, 7000, 9000]] += 3e-4
    given = replace(record, measured=measured, source='a.csv').slice(2100, 12000)
    theta, seen = np.tile(THETA, (8, 1)), {}

    def recorded(draws: object, *rest: object) -> tuple[()]:
        seen['calibrate'] = records_tracking(theta, *rest)
        return ()

    monkeypatch.setattr('actuator_glue.api.calibration.records_tracking', recorded)
    ag.calibrate(given, evaluations=12_000)
    (source,) = {r.source for r in seen['calibrate']}
    found = SimpleNamespace(
        names=Structure(()).names,
        model=Structure(()),
        joint=theta,
        setup=None,
        sampling=({'source': given.source, 'fitted_rate_hz': 250.0},),
    )
    (diagnosed,), (calibrated,) = (
        _tracking(found, _fitted(found, [given]), [given]),
        seen['calibrate'],
    )
    assert source == 'a.csv' and set(diagnosed.measured) >= {'fei_delay_s', 'J1_s', 'J2'}
    assert diagnosed.measured == calibrated.measured
    assert diagnosed.predicted == calibrated.predicted
    clean = record.slice(2100, 12000)
    (whole,) = records_tracking(theta, NAMES, Structure(()), [clean])
    assert diagnosed.measured['J3'] == pytest.approx(whole.measured['J3'], rel=0.02)


def test_calibrate_hands_them_out() -> None:
    """One set a record, intervals that hold the record's own number, JSON and report."""
    record = ag.simulate(ag.Command(rate=200.0, duration=20.0), stiffness=250e3, seed=3)
    found = ag.calibrate(record, evaluations=24_000, seed=5)
    (of,) = found.tracking
    for name in ('J2', 'fei_amplitude', 'fei_delay_s'):
        band = of.predicted[name]
        assert band.lower <= band.median <= band.upper
        assert of.measured[name] == pytest.approx(band.median, rel=0.02)
    told = json.loads(json.dumps(found.to_json()['tracking']))[0]
    assert told['predicted']['J2']['median'] == of.predicted['J2'].median
    assert any('bandwidth' in row[0] for row in of.rows())


@pytest.mark.parametrize('lag', [-37, 0, 5, 200])
def test_the_lag_of_a_long_test_is_found_block_by_block(lag: int) -> None:
    """The same as by one transform of the whole."""
    rng = np.random.default_rng(1)
    target = np.cumsum(rng.standard_normal(10_001))
    target -= target.mean()
    moved = np.roll(target, lag) + 0.01 * rng.standard_normal(len(target))
    assert lag_by_blocks(target, moved, 512) == lag
    assert TargetMotion(target, 1.0).criteria(moved).j1 == lag


# Effects, their parameters and the specimen's stiffness [N/m]: lags beyond half a turn within
# 50 Hz, and a payload on a light damper that turns by half of one within a fraction of a hertz.
LATE = [
    (('valve-lag',), (0.015,), 250e3),
    (('delay',), (0.06,), 250e3),
    (('delay', 'valve-lag', 'sensor-lag'), (0.03, 0.004, 0.01), 0.0),
    (('payload-inertia',), (300.0, 3.0), 2e6),
]


@pytest.mark.parametrize(('effects', 'values', 'stiffness'), LATE)
def test_a_lag_beyond_half_a_turn_is_no_lead(
    effects: tuple[str, ...], values: tuple[float, ...], stiffness: float
) -> None:
    """Few frequencies are told the delay that a fine grid from rest up tells."""
    structure, asked = Structure(effects), (5.0, 20.0, 50.0)
    draws = np.array([[*TABLE_2, *values]])
    draws = draws * np.exp(1e-3 * np.random.default_rng(0).standard_normal((20, draws.shape[1])))
    made = actuator(draws, structure.names, structure.entries, np.full(20, stiffness))
    hertz = np.arange(1, 5001) * 0.01
    s = np.broadcast_to(2j * np.pi * hertz, (20, len(hertz)))
    at = np.searchsorted(hertz, np.array(asked) - 1e-6)

    def true(system: object) -> np.ndarray:
        response = system.response(s) * np.exp(-s * made.delay[:, None])
        return -np.unwrap(np.angle(response), axis=1)[:, at] / (2.0 * np.pi * np.array(asked))

    expected = true(made.system)
    assert (expected * asked > 0.5).any()
    np.testing.assert_allclose(tracking(made, asked).delay, expected, atol=1e-9)
    recorded = made.system._replace(C=np.broadcast_to(made.shown, made.system.C.shape))
    expected = np.median(true(recorded), axis=0)
    for i, f in enumerate(asked):
        one = frequency_response(drawn(structure, draws), stiffness, [f])
        assert one.delay.median[0] == pytest.approx(expected[i], abs=1e-9)
        assert one.phase.median[0] == pytest.approx(-360.0 * f * expected[i], abs=1e-6)


def test_what_a_late_actuator_means_for_a_test_at_10_hz() -> None:
    """Half a turn is 50 ms there; an actuator of 51 ms does not lead by 49."""
    stiffness, w = 250e3, 2.0 * np.pi * 10.0
    partition = ag.Partition(
        mass=1000.0,
        damping=2.0 * 0.05 * 1000.0 * w,
        stiffness=1000.0 * w**2 - stiffness,
        specimen=ag.Specimen(0.0, 0.0, stiffness),
        rate=1000.0,
    )
    structure, draws = Structure(['delay']), np.tile([*TABLE_2, 0.0225], (4, 1))
    late = drawn(structure, draws)
    told = hybrid_meaning(partition, lambda k, f: frequency_response(late, k, [f]).delay)
    assert 'at 10 Hz the actuator lags by 51.17 ms (51.17 to 51.17)' in told
