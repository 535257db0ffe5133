"""A bag shows at each time what was known then: by when things were received, not by stamps."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import Nodetype
from stream import frame

from actuator_glue.io import messages
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.remarks import Note, refuse
from actuator_glue.view.frames import Wanted
from actuator_glue.view.history import ROWS
from actuator_glue.view.intake import Intake, read_bag
from actuator_glue.view.timeline import LONGEST_GAP, Timeline

RATE = 200.0
BEGIN = 1_700_000_000_000_000_000  # ns
BLOCK = 20  # samples
LATENCY = 3_000_000  # ns, of the recorder where it does not stand still


def blank(name: str, **given: Any) -> Any:
    """Return a message whose other fields are empty."""
    filled = {}
    for field, kind in messages.typestore().fielddefs[messages.full_name(name)][1]:
        if kind[0] == Nodetype.NAME:
            filled[field] = messages.header(0, '')
        elif kind[0] == Nodetype.BASE:
            base = kind[1][0]
            filled[field] = '' if base == 'string' else 0.0 if 'float' in base else 0
        else:
            base = kind[1][0][1][0]
            filled[field] = (
                [] if base == 'string' or kind[1][0][0] == Nodetype.NAME else np.empty(0, base)
            )
    return messages.message(name, **filled | given)


class Bag:
    """What a recorder takes; times are seconds since the test began."""

    def __init__(self) -> None:
        self.taken: list[tuple[float, str, str, Any]] = []

    def samples(self, start: float, stop: float, *, index: int = 0, taken: float = 0.0) -> None:
        """Sample blocks from `start` to `stop`; those before `taken` are taken then."""
        for at in np.arange(round(start * RATE), round(stop * RATE), BLOCK):
            values = 1e-3 * np.sin(np.arange(at, at + BLOCK) / 30.0)
            block = blank(
                'SampleBlock',
                period=1 / RATE,
                index=int(at - round(start * RATE) + index),
                command=values,
                measured=values,
            )
            self.take(max((at + BLOCK) / RATE, taken), '/samples', 'SampleBlock', block)

    def diagnosis(self, at: float, summary: str, *, stamp: float = 0.0) -> None:
        """A diagnosis that was received then, whatever its stamp says."""
        header = messages.header(BEGIN + round(1e9 * stamp), '')
        found = blank('Diagnosis', header=header, summary=summary, verdict='none')
        self.take(at, '/diagnosis', 'Diagnosis', found)

    def band(self, at: float, start: float, stop: float, half: float, *, scored: bool) -> None:
        """A band over a stretch that was received then."""
        count = round((stop - start) * RATE)
        band = blank(
            'PredictionBand',
            kind='total',
            index=round(start * RATE),
            period=1 / RATE,
            levels=np.array([0.95]),
            median=np.zeros(count),
            lower=np.full(count, -half),
            upper=np.full(count, half),
            scored=scored,
            forecast=True,
            widest_level=0.95,
        )
        self.take(at, '/prediction_band', 'PredictionBand', band)

    def take(self, at: float, topic: str, kind: str, content: Any) -> None:
        """Put a message where the recorder would."""
        self.taken.append((at, topic, kind, content))

    def read(self, path: Path, *, sort: bool = True, note: Note = refuse) -> Intake:
        """Write it in the order of time, or in the order that it was put together in; read it."""
        if sort:
            self.taken.sort(key=lambda found: found[0])
        with BagWriter(path) as writer:
            for at, topic, kind, content in self.taken:
                writer.add_topic(topic, kind)
                writer._last_time = -1  # times may go back where bags were put together
                writer.write(topic, content, BEGIN + round(1e9 * at) + LATENCY)
        return read_bag(path, note=note)


def seen(made: Intake, at: float | None) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return head and rows of the frame that a slider at a time gives."""
    data = frame(made, Wanted(at, 5.0, 4000))
    (length,) = struct.unpack_from('<I', data)
    head = json.loads(data[4 : 4 + length])
    numbers = np.frombuffer(data[4 + length :], '<f4')
    rows = numbers[: (1 + len(ROWS)) * head['count']].reshape(1 + len(ROWS), -1)
    return head, dict(zip(['time', *ROWS], rows, strict=True))


def known(made: Intake, at: float | None) -> str:
    """Return the diagnosis that is shown at a time."""
    return seen(made, at)[0]['state'].get('diagnosis', {}).get('summary', '')


def test_what_was_found_after_the_last_sample_is_shown_then(tmp_path: Path) -> None:
    """Seventeen seconds after it: the slider goes on to there, and samples stay in sight."""
    bag = Bag()
    bag.samples(0.0, 30.0)
    bag.diagnosis(47.0, 'found', stamp=30.0)
    made = bag.read(tmp_path / 'bag')
    assert [known(made, at) for at in (10.0, 29.9, 30.0, 46.9)] == [''] * 4
    assert known(made, 47.1) == known(made, None) == 'found'
    head, rows = seen(made, None)
    assert head['newest'] == pytest.approx(47.0, abs=0.05)
    assert np.isfinite(rows['measured']).sum() == pytest.approx(2.5 * RATE, abs=2)


@pytest.mark.parametrize('sort', [True, False], ids=['by time', 'as put together'])
def test_a_pause_takes_its_time(tmp_path: Path, sort: bool) -> None:
    """What is found between two tests is shown there, in whatever order the file holds it."""
    bag = Bag()
    bag.diagnosis(27.0, 'of the first', stamp=9.0)
    bag.samples(0.0, 10.0)
    bag.samples(30.0, 40.0)
    bag.diagnosis(39.0, 'of the second', stamp=12.0)
    made = bag.read(tmp_path / 'bag', sort=sort)
    assert [known(made, at) for at in (10.0, 26.9)] == ['', '']
    assert [known(made, at) for at in (27.1, 38.9)] == ['of the first'] * 2
    assert known(made, 39.1) == known(made, 40.0) == 'of the second'
    head, rows = seen(made, 31.0)
    assert head['newest'] == pytest.approx(40.0, abs=0.05)
    shown = head['start'] + rows['time'][np.isfinite(rows['measured'])]
    assert (shown.min(), shown.max()) == pytest.approx((30.0, 31.0), abs=0.05)


def test_a_recorder_that_stood_still_makes_nothing_known_early(tmp_path: Path) -> None:
    """It took 17 s of samples in one go, and what was said of them just before."""
    bag = Bag()
    bag.samples(0.0, 10.0)
    bag.samples(10.0, 60.0, index=2000, taken=27.0)
    bag.diagnosis(26.99, 'found')
    made = bag.read(tmp_path / 'bag')
    assert [known(made, at) for at in (10.0, 12.0, 26.9)] == ['', '', '']
    assert known(made, 27.1) == 'found'
    assert seen(made, None)[0]['newest'] == pytest.approx(60.0, abs=0.05)


def test_a_band_is_shown_from_when_it_was_known(tmp_path: Path) -> None:
    """One that came late is absent before; a score that comes later does not change what was."""
    bag = Bag()
    bag.samples(0.0, 10.0)
    bag.band(1.0, 2.0, 3.0, 1e-3, scored=False)  # in time
    bag.band(5.0, 3.0, 4.0, 2e-3, scored=False)  # late
    bag.band(6.0, 2.0, 3.0, 9e-3, scored=True)
    made = bag.read(tmp_path / 'bag')

    def upper(slider: float, at: float) -> float:
        head, rows = seen(made, slider)
        return float(rows['upper'][np.argmin(np.abs(head['start'] + rows['time'] - at))])

    assert upper(2.6, 2.5) == upper(7.0, 2.5) == pytest.approx(1.0)
    assert np.isnan(upper(4.9, 3.5))
    assert upper(5.1, 3.5) == pytest.approx(2.0)
    # Scored, and nothing of it before: it is the band, from then on.
    bag = Bag()
    bag.samples(0.0, 10.0)
    bag.band(6.0, 2.0, 3.0, 9e-3, scored=True)
    made = bag.read(tmp_path / 'other')
    assert np.isnan(upper(5.0, 2.5))
    assert upper(6.1, 2.5) == pytest.approx(9.0)


def test_a_set_up_and_what_a_node_says_have_their_time(tmp_path: Path) -> None:
    """As a diagnosis has; every node its own."""
    bag = Bag()
    bag.samples(0.0, 20.0)
    for at, stiffness in ((0.0, 1e5), (12.0, 2e5)):
        found = blank('TestSetup', actuator='north', specimen_stiffness=stiffness, rate=RATE)
        bag.take(at, '/test_setup', 'TestSetup', found)
    made = bag.read(tmp_path / 'bag')
    told = [seen(made, at)[0]['state']['setup']['stiffness'] for at in (1.0, 11.9, 12.1)]
    assert told == [1e5, 1e5, 2e5]


def test_weights_and_alarms_of_later_are_not_known_before(tmp_path: Path) -> None:
    """In whatever order the bag holds them: trends and log end at the time that is shown."""
    bag = Bag()
    bag.samples(0.0, 20.0)
    for at, play in ((12.0, 0.9), (6.0, 0.2), (9.0, 0.6)):
        told = blank(
            'PosteriorMoments',
            structures=['backlash', 'Eq. (2)'],
            weights=np.array([play, 1.0 - play]),
        )
        bag.take(at, '/posterior', 'PosteriorMoments', told)
    bag.diagnosis(8.0, 'found')
    made = bag.read(tmp_path / 'bag', sort=False)

    def shown(at: float) -> tuple[int, list[str]]:
        head = seen(made, at)[0]
        return head['trends']['count'], [entry['of'] for entry in head['log']]

    assert shown(5.9) == (0, [])
    assert shown(7.9) == (1, ['explanations'])
    assert shown(8.1) == (1, ['diagnosis', 'explanations'])
    assert shown(20.0)[0] == 3
    # Sure since then, not since it was first carried.
    first = seen(made, 20.0)[0]['state']['posterior']['structures'][0]
    assert (first['weight'], first['since'], first['leads']) == (
        0.9,
        pytest.approx(6.0, abs=0.05),
        pytest.approx(9.0, abs=0.05),
    )


def test_samples_of_another_rate_are_told(tmp_path: Path) -> None:
    """One axis has one rate: the last one is shown, and it is said how many samples are not."""
    bag = Bag()
    bag.samples(0.0, 1.0)
    values = np.zeros(50)
    slow = blank('SampleBlock', period=0.02, index=0, command=values, measured=values)
    bag.take(5.0, '/samples', 'SampleBlock', slow)
    told: list[str] = []
    made = bag.read(tmp_path / 'bag', note=told.append)
    assert ['200 samples before that are not shown' in line for line in told] == [True]
    assert seen(made, None)[0]['newest'] == pytest.approx(1.0)


def test_places_of_a_timeline() -> None:
    """A sender's clock 0.1 % off, a pause too long to show, a clock that was set back."""
    made = Timeline()
    for i in range(36_000):  # an hour
        made.add(100 * i, 100, 1e-3, BEGIN + round(1.001e8 * (i + 1)))
    at = BEGIN + round(1.8018e12)
    assert made.place(at) == pytest.approx(1_800_000, abs=200)
    assert made.place(0) == 0
    first = made.add(0, 100, 1e-3, BEGIN + round(9e12))
    assert (first, made.capacity) == (3_600_001, 3_600_101)
    made.add(100, 100, 1e-3, BEGIN + round(9e12) - round(2e9))
    assert made.place(BEGIN + round(9e12)) >= 3_600_101
    assert made.place(BEGIN + round(9e15)) == made.places + LONGEST_GAP
