"""replay of a bag in which the estimator began again: each run is repeated by itself."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_replay import put

from actuator_glue import replay as replayed
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import choose_model
from actuator_glue.io import messages
from actuator_glue.io.bag_reader import messages as bag_messages
from actuator_glue.io.bag_records import read_records
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.model.parameters import NAMES
from actuator_glue.online import conversion
from actuator_glue.online.job import WindowResult
from actuator_glue.online.playback import replay, stream
from actuator_glue.online.replay_comparison import published
from actuator_glue.online.settings import EstimatorSettings

QUICK = {'evaluations': 4000, 'start_evaluations': 6000, 'settle': 0.3}
SETTINGS = EstimatorSettings(window=2.0, hop=1.0, **QUICK)
OTHERS = EstimatorSettings(window=1.6, hop=0.8, **QUICK)
TOPICS = {
    'EstimatorSetup': '/estimator_setup',
    'PosteriorMoments': '/posterior',
    'PosteriorDraws': '/posterior_draws',
    'PredictionBand': '/prediction_band',
}
Said = list[tuple[str, conversion.Head, conversion.Fields]]


def said(
    record: Any, start: int, stop: int, settings: EstimatorSettings, known: Carried | None = None
) -> tuple[Said, Said]:
    """Return what an estimator that hears some of a record announces, and what it finds.

    It starts from what is `known`, if anything.
    """
    model, part = choose_model(), record.slice(start, stop)
    begins = conversion.Head(part.start_ns, '')
    announced = [
        ('EstimatorSetup', begins, conversion.estimator_setup(settings, model, 0, 0, known))
    ]
    found: Said = []
    for result in replay(stream(part), settings, model, carried=known):
        if isinstance(result, WindowResult):
            found.append(('PosteriorMoments', *conversion.posterior(result, 0.1)))
            found.append(('PosteriorDraws', *conversion.draws(result)))
            for band in result.scored:
                found.append(('PredictionBand', *conversion.prediction(band, part.actuator)))
    return announced, found


@pytest.fixture(scope='module')
def runs(short_bag: Path) -> list[tuple[int, Said]]:
    """What two runs of an estimator say, and the sample before which each says it."""
    (record,) = read_records(short_bag)
    assert record.rate == pytest.approx(100.0) and len(record) >= 800
    first, second = said(record, 0, 448, SETTINGS), said(record, 448, len(record), OTHERS)
    # The node is killed in its first window behind the last that it published.
    return [(0, first[0]), (448, first[1]), (512, second[0]), (2**62, second[1])]


@pytest.fixture
def recorded(short_bag: Path, runs: list[tuple[int, Said]], tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes the bag of both runs, perhaps changed."""

    def make(change: Callable[[list[tuple[int, Said]]], Any] = lambda runs: runs) -> Path:
        bag, left = tmp_path / 'runs', [(at, list(one)) for at, one in runs]
        left = change(left) or left
        with BagWriter(bag) as writer:
            for kind, topic in TOPICS.items():
                writer.add_topic(topic, kind)

            def say(before: float) -> None:
                while left and left[0][0] <= before:
                    for kind, head, fields in left.pop(0)[1]:
                        put(writer, TOPICS[kind], kind, head, fields)

            for found in bag_messages(short_bag):
                content = messages.deserialize(found.type, found.data)
                say(content.index)
                writer.add_topic(found.topic, found.type)
                writer.write(found.topic, content, found.log_time)
            say(float('inf'))
        return bag

    return make


def test_each_run_is_repeated_and_compared_by_itself(run, recorded: Callable[..., Path]) -> None:
    """Both have a window 0, and settings of their own; the set-up came before the first only."""
    done = run('replay', recorded(), '--json', '-')
    assert done.code == 0, done.err
    content = done.json
    assert content['identical'] is True and content['compared']['unrepeatable'] == []
    named = [(w['run'], w['window']) for w in content['windows']]
    assert named[:4] == [(1, 0), (1, 1), (1, 2), (2, 0)] and named[-1][1] >= 1
    assert content['compared']['posteriors'] == len(named)
    assert 'the estimator began 2 times in this bag' in done.err
    assert '1:0' in done.err + done.out and '2:0' in done.err + done.out


@pytest.mark.parametrize('silent', [True, False])
def test_a_prior_drifts_from_where_its_own_run_began(
    recorded: Callable[..., Path], short_bag: Path, silent: bool
) -> None:
    """Samples stand before it: of a run without a posterior, or of a recorder that came first."""
    (record,) = read_records(short_bag)
    spread = 0.05 * np.random.default_rng(1).standard_normal((400, 4))
    known = Carried(NAMES, np.array([134.0, 1.1e9, 2.5e5, 0.5]) * np.exp(spread))
    settings = replace(SETTINGS, prior='calibration', drift=50.0)
    announced, found = said(record, 330, len(record), settings, known)
    before = [(0, announced)] if silent else []
    done = replayed(recorded(lambda runs: [*before, (330, announced), (2**62, found)]))
    assert done.identical and len(done.windows) >= 2, done.compared


def test_what_differs_is_named_with_its_run(run, recorded: Callable[..., Path]) -> None:
    def change(runs: list[tuple[int, Said]]) -> None:
        fields = dict(runs[3][1][0][2])
        fields['mean'] = np.nextafter(fields['mean'], np.inf)
        runs[3][1][0] = (*runs[3][1][0][:2], fields)

    done = run('replay', recorded(change), '--json', '-')
    assert done.code == 1
    assert done.json['compared']['differing'] == ['run 2, window 0: posterior differs in mean']


def test_a_run_killed_while_it_published_is_no_difference(recorded: Callable[..., Path]) -> None:
    """The posterior of its last window is in the bag, the bands that this scored are not."""

    def change(runs: list[tuple[int, Said]]) -> None:
        while runs[1][1][-1][0] != 'PosteriorMoments':
            runs[1][1].pop()

    found = replayed(recorded(change))
    assert found.identical and found.compared is not None
    (lost,) = found.compared.unrepeatable
    assert lost.startswith('run 1, window 2: ') and 'are not compared: the run' in lost


def test_last_results_may_be_recorded_after_the_next_setup(recorded: Callable[..., Path]) -> None:
    """Topics have no order among each other."""

    def change(runs: list[tuple[int, Said]]) -> list[tuple[int, Said]]:
        last = max(i for i, one in enumerate(runs[1][1]) if one[0] == 'PosteriorMoments')
        late, runs[1][1][last:] = runs[1][1][last:], []
        runs[2] = (448, runs[2][1] + late)
        return runs

    found = replayed(recorded(change))
    assert found.identical, found.compared
    assert [w.run for w in found.windows].count(1) == 3


def test_windows_of_a_run_without_its_setup_are_named(recorded: Callable[..., Path]) -> None:
    found = replayed(recorded(lambda runs: [runs[0], runs[1], runs[3]]))
    assert found.identical and {w.run for w in found.windows} == {1}
    assert found.compared is not None and found.compared.unrepeatable
    assert all(
        line.startswith('run 2, window ') and 'EstimatorSetup of its run' in line
        for line in found.compared.unrepeatable
    )


def test_a_model_asked_for_before_the_first_window_begins_no_run() -> None:
    def setup(actuator: str) -> SimpleNamespace:
        fields = conversion.estimator_setup(SETTINGS, choose_model(), 0, 0)
        return SimpleNamespace(header=SimpleNamespace(frame_id=actuator), **fields)

    named = [('x/EstimatorSetup', setup(name)) for name in ('', 'rig')]
    (one,) = published(named)
    assert len(one.models) == 2
    # Latched messages of an earlier run that has no posterior in the bag.
    (last,) = published([*named, ('x/EstimatorSetup', setup(''))])
    assert len(last.models) == 1
