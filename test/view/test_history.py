"""What is kept of a test, and what a page is sent of it."""

import json
import struct

import numpy as np
import pytest
from stream import (
    RATE,
    band,
    block,
    carried,
    diagnosis,
    feed,
    frame,
    intake,
    posterior,
    setup,
)

from actuator_glue.errors import InputError
from actuator_glue.view.frames import Frames, Wanted, parse_wanted
from actuator_glue.view.history import ROWS, History
from actuator_glue.view.timeline import Timeline


def decode(data: bytes) -> tuple[dict, np.ndarray]:
    """Return JSON and rows of a frame."""
    (length,) = struct.unpack_from('<I', data)
    head = json.loads(data[4 : 4 + length])
    numbers = np.frombuffer(data[4 + length :], '<f4')
    rows = numbers[: (1 + len(ROWS)) * head['count']].reshape(1 + len(ROWS), -1)
    assert head['rows'] == ['time', *ROWS]
    return head, rows


def row(rows: np.ndarray, name: str) -> np.ndarray:
    """Return a row of a frame."""
    return rows[1 + ROWS.index(name)]


def trends(data: bytes) -> dict[str, np.ndarray]:
    """Return times, weights and parameters (mean, standard deviation, prior) of a frame."""
    head, _ = decode(data)
    told = head['trends']
    columns = np.frombuffer(data, '<f4', offset=len(data) - _size(told))
    columns = columns.reshape(-1, told['count']) if told['count'] else np.empty((99, 0))
    found = {'time': columns[0]}
    for i, name in enumerate(told['weights'], 1):
        found[name] = columns[i]
    for i, one in enumerate(told['parameters']):
        start = 1 + len(told['weights']) + 3 * i
        found[one['name']] = columns[start : start + 3]
    return found


def _size(told: dict) -> int:
    return 4 * told['count'] * (1 + len(told['weights']) + 3 * len(told['parameters']))


def test_a_frame_is_what_was_measured() -> None:
    """Times, samples in mm, band, and the state of that moment."""
    head, rows = decode(frame(intake(12.0), Wanted(None, 1.0, 4000)))
    assert (head['stop'], head['newest'], head['count']) == (12.0, 12.0, 1000)
    expected = block(11000, 1000)
    np.testing.assert_allclose(head['start'] + rows[0], np.arange(11000, 12000) / RATE, atol=1e-6)
    command, measured = expected.command * 1e3, expected.measured * 1e3
    np.testing.assert_allclose(row(rows, 'command'), command, atol=1e-6)
    np.testing.assert_allclose(row(rows, 'measured'), measured, atol=1e-6)
    np.testing.assert_allclose(row(rows, 'force'), expected.force * 1e-3, atol=1e-6)
    np.testing.assert_allclose(row(rows, 'upper') - row(rows, 'lower'), 0.8, atol=1e-5)
    np.testing.assert_allclose(row(rows, 'error'), command - measured, atol=1e-6)
    np.testing.assert_allclose(row(rows, 'residual'), 0.0, atol=1e-3)
    np.testing.assert_allclose(row(rows, 'residual_lower'), -400.0, atol=1e-2)
    np.testing.assert_allclose(row(rows, 'residual_upper'), 400.0, atol=1e-2)
    assert head['state']['posterior']['parameters'][0]['mean'] == 123.4
    assert head['state']['setup']['stiffness'] == 250e3


def test_degrees_are_told_as_degrees() -> None:
    """Units of curves, parameters, what happened and what was found; numbers stay."""
    made = intake(5.0)
    made.take('TestSetup', setup('deg', 0.0))
    made.take('PosteriorMoments', posterior(9, backlash=1.0))
    made.take('Diagnosis', diagnosis('error 36.2 -> 10.0 um'))
    plain, _ = decode(frame(intake(5.0), Wanted()))
    head, rows = decode(frame(made, Wanted(None, 1.0, 4000)))
    assert plain['units'] == {'mm': 'mm', 'um': 'um', 'kN': 'kN'}
    assert head['units'] == {'mm': 'deg', 'um': 'mdeg', 'kN': 'kNm'}
    assert row(rows, 'command').max() == pytest.approx(2.0, rel=1e-3)
    (one,) = head['state']['posterior']['structures']
    assert [(p['mean'], p['unit']) for p in one['parameters']] == [(123.4, '1/s'), (40.0, 'mdeg')]
    assert head['state']['diagnosis']['summary'] == 'error 36.2 -> 10.0 mdeg'
    assert head['state']['diagnosis']['experiments'][0].startswith('a slow triangle wave')
    assert ' of 0.5 deg without' in head['state']['diagnosis']['experiments'][0]
    assert 'error 36.2 -> 10.0 mdeg (asked for)' in [entry['text'] for entry in head['log']]
    assert head['state']['setup']['actuator'] == 'north'


def test_the_past_has_its_own_state() -> None:
    """Scrolled back, the page shows what was known then, not what is known now."""
    made = intake(5.0)
    made.take('PosteriorMoments', posterior(99, 7.0))
    head, _ = decode(frame(made, Wanted(3.0, 1.0, 100)))
    assert head['stop'] == 3.0
    assert head['state']['posterior']['window'] == 2
    assert decode(frame(made, Wanted()))[0]['state']['posterior']['window'] == 99


def test_a_force_that_is_not_measured_is_nothing() -> None:
    """All else is there."""
    made = intake(0.0)
    silent = block(0, 100)
    silent.force = ()
    made.take('SampleBlock', silent)
    _, rows = decode(frame(made, Wanted(None, 0.1, 4000)))
    assert np.isnan(row(rows, 'force')).all() and np.isfinite(row(rows, 'error')).all()


def test_weights_over_the_whole_test_and_since_when() -> None:
    """What was carried, its share, since when it is, and since when it is above one half."""
    data = frame(intake(90.0), Wanted())
    found = trends(data)
    told = [carried(window) for window in range(90)]
    np.testing.assert_allclose(found['time'], np.arange(1, 91), atol=1e-3)
    for name, column in (('Eq. (2)', 'Eq2'), ('backlash', 'backlash')):
        expected = [weights.get(column, np.nan) for weights in told]
        np.testing.assert_allclose(found[name], expected, atol=1e-6)
    np.testing.assert_allclose(found['beta_1'][:, -1], [123.4, 2.5, 0.0], atol=1e-4)
    state = decode(data)[0]['state']
    play, friction = state['posterior']['structures']
    first = next(i for i, weights in enumerate(told) if weights.get('backlash', 0.0) > 0.5)
    assert (play['name'], play['since'], play['leads']) == ('backlash', 21.0, first + 1.0)
    assert (friction['since'], friction['leads']) == (21.0, None)
    size = play['parameters'][1]
    assert [size[key] for key in ('word', 'unit', 'mean', 'sd')] == ['backlash', 'um', 40.0, 1.0]


def test_what_a_page_has_of_trends_is_not_sent_again() -> None:
    """New ones are, and where the page goes back those of that time."""
    made = intake(30.0)
    frames = Frames(made)
    first, again = (decode(frames.next(Wanted(), 0.0))[0] for _ in range(2))
    assert first['trends']['count'] == 30 and 'trends' not in again and 'log' not in again
    feed(made, 30_000, 1000)
    # However many windows a second: of those that come soon it waits for the last.
    assert 'trends' not in decode(frames.next(Wanted(), 0.1))[0] and frames.owing
    assert decode(frames.next(Wanted(), 0.6))[0]['trends']['count'] == 31 and not frames.owing
    back = frames.next(Wanted(12.5, 5.0, 100), 0.7)
    assert trends(back)['time'].max() == pytest.approx(12.0)
    assert set(trends(back)) == {'time', 'Eq. (2)', 'beta_1'}


def test_an_older_posterior_carries_one_structure() -> None:
    """Messages that tell no structures are of the effects of their model."""
    made = intake(1.0)
    old = posterior(1)
    del old.structures, old.weights
    made.take('PosteriorMoments', old)
    (one,) = decode(frame(made, Wanted()))[0]['state']['posterior']['structures']
    assert (one['name'], one['weight'], one['parameters']) == ('backlash', 1.0, [])


def test_decimation_keeps_peaks_and_the_band_outside() -> None:
    """A spike of one sample among 10 000 is seen; points are bounded."""
    made = History(20_000)
    rows = {'command': np.zeros(10_000), 'measured': np.zeros(10_000)}
    rows['measured'][4321] = 5e-3
    made.add_samples(0, 1e-3, rows)
    half = np.linspace(1e-3, 2e-3, 10_000)
    made.add_band(0, {'lower': -half, 'median': 0 * half, 'upper': half})
    curves = made.curves(0, 10_000, 400)
    assert len(curves.times) <= 400
    measured, lower, upper = (curves.rows[ROWS.index(n)] for n in ('measured', 'lower', 'upper'))
    assert measured.max() == 5.0
    assert abs(curves.times[measured.argmax()] - 4.321) < 0.05
    assert (upper >= np.interp(curves.times, np.arange(10_000) * 1e-3, half * 1e3) - 1e-6).all()
    np.testing.assert_array_equal(lower, -upper)


def test_a_gap_is_empty_and_a_new_stream_goes_on() -> None:
    """Lost samples are nothing; an index that goes back is appended; a new rate starts anew."""
    made = intake(1.0)
    made.take('SampleBlock', block(1100, 50))
    head, rows = decode(frame(made, Wanted(None, 0.15, 4000)))
    assert np.isnan(row(rows, 'measured')[:100]).all()
    assert np.isfinite(row(rows, 'measured')[100:]).all()
    made.take('SampleBlock', block(0, 50))
    head, rows = decode(frame(made, Wanted(None, 0.05, 4000)))
    np.testing.assert_allclose(row(rows, 'measured'), block(0, 50).measured * 1e3, atol=1e-6)
    assert head['newest'] == 1.2
    slow = block(0, 50)
    slow.period = 0.01
    made.take('SampleBlock', slow)
    head, _ = decode(frame(made, Wanted()))
    assert head['newest'] == 0.5
    assert head['state']['setup']['actuator'] == 'north'


def test_twenty_minutes_take_no_more_than_one() -> None:
    """Rings are filled over and over; events are bounded; what is kept is right."""
    made = intake(60.0, capacity=1 << 15)
    before = made.history._ring.nbytes
    feed(made, 60_000, 1_140_000, size=500)
    assert made.history._ring.nbytes == before
    # What lasts is kept once, what changes as long as the samples that it belongs to.
    kept = {kind: len(events) for (kind, _), events in made.history._events.items()}
    assert kept['health'] == kept['response'] == 1 and 30 < kept['posterior'] < 40
    head, rows = decode(frame(made, Wanted(None, 1.0, 4000)))
    assert (head['newest'], head['oldest']) == (1200.0, pytest.approx(1200.0 - 32.768))
    np.testing.assert_allclose(
        row(rows, 'measured'), block(1_199_000, 1000).measured * 1e3, atol=1e-6
    )
    assert len(frame(made, Wanted(None, 1e6, 4000))) < 300_000
    # Of the whole test, coarser: what it is explained by is known from its beginning.
    found = trends(frame(made, Wanted()))
    assert (found['time'][0], found['time'][-1]) == (1.0, 1200.0) and len(found['time']) <= 601


def test_a_band_of_another_stream_does_no_harm() -> None:
    """Far ahead, far behind, of uneven size: it is passed over."""
    made = intake(2.0)
    shown = frame(made, Wanted())
    odd = band(500, 100)
    odd.lower = odd.lower[:-3]
    for wrong in (band(10**9, 100), odd):
        made.take('PredictionBand', wrong)
    assert decode(frame(made, Wanted()))[1].tobytes() == decode(shown)[1].tobytes()


@pytest.mark.parametrize(
    'text',
    [
        '',
        '[]',
        '{}',
        '{"stop": "x", "span": 1, "points": 100}',
        '[' * 900,
        '{"stop": NaN, "span": 1, "points": 100}',
        '{"stop": 1, "span": 1e9, "points": 100}',
        '{"stop": 1, "span": 1, "points": -1}',
        '{"stop": 1, "span": 1, "points": Infinity}',
    ],
)
def test_requests_that_are_none(text: str) -> None:
    """Whatever a page sends, nothing but InputError comes out."""
    with pytest.raises(InputError):
        parse_wanted(text)


@pytest.mark.parametrize(
    ('field', 'value', 'told'),
    [
        ('period', np.inf, 'period inf s'),
        ('period', np.nan, 'period nan s'),
        ('period', 1e-300, 'period 1e-300 s'),
        ('period', 0.0, 'period 0 s'),
        ('index', 2**63, 'running index'),
    ],
)
def test_a_block_without_a_place_in_time_is_refused(field: str, value: float, told: str) -> None:
    """It says so once; what is shown stays, and the next block goes on."""
    test = intake(2.0)
    before = frame(test, Wanted())
    bad = block(2000, 50)
    setattr(bad, field, value)
    with pytest.raises(InputError, match=told):
        test.take('SampleBlock', bad)
    assert frame(test, Wanted()) == before
    test.take('SampleBlock', block(2050, 50))
    assert decode(frame(test, Wanted()))[0]['newest'] == pytest.approx(2.1)


@pytest.mark.parametrize('placed', [False, True])
def test_a_period_that_differs_in_its_last_digits_keeps_the_history(placed: bool) -> None:
    """A driver that measures its clock writes another period into each block."""
    rng = np.random.default_rng(3)
    history, timeline = History(1000), Timeline()
    for first in range(0, 400, 50):
        period = (1.0 + 1e-9 * rng.uniform(-1.0, 1.0)) / RATE
        place = timeline.add(first, 50, period, round(1e9 * (first + 50) / RATE))
        rows = {'command': np.ones(50), 'measured': np.ones(50)}
        history.add_samples(first, period, rows, place if placed else None)
    assert timeline.places == timeline.capacity == history.measured_to == 400
    curves = history.curves(0, 400, 400)
    assert len(curves.times) == 400 and not np.isnan(curves.rows[ROWS.index('measured')]).any()
