"""The demonstration: real processes, and what it makes of a bag."""

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from actuator_glue.api.simulation import Command, simulate
from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.messages import header, message
from actuator_glue.model.parameters import NAMES
from actuator_glue.online.job import WindowResult
from actuator_glue.online.playback import replay, stream
from actuator_glue.online.replay_comparison import ReplayComparison
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.records import Array, Record
from examples.demonstration import __main__ as command
from examples.demonstration import domain, pictures
from examples.demonstration.outcome import SessionOutcome
from examples.demonstration.processes import Nodes, executable
from examples.demonstration.session import prepare
from examples.demonstration.sources import STIFFNESS, Truth, simulator
from examples.demonstration.watch import Watch


def test_watch_counts_what_is_flushed(tmp_path: Path) -> None:
    """Each sample once, however often one looks, and before the bag is finished."""
    watch = Watch(tmp_path / 'bag')
    watch.update()
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/samples', 'SampleBlock')
        for i in range(30):
            block = message(
                'SampleBlock',
                header=header(i, 'a'),
                period=1e-3,
                index=10 * i,
                command=np.zeros(10),
                measured=np.zeros(10),
                force=np.empty(0),
            )
            writer.write('/samples', block, i)
            if i % 7 == 0:
                writer.flush()
                watch.update()
                assert watch.samples == 10 * (i + 1)
    watch.update()
    watch.update()
    assert watch.samples == 300


def test_only_own_leavings_are_removed(tmp_path: Path) -> None:
    """Somebody else's file in the folder survives the next run."""
    for name in ('bag', 'nodes', 'mine'):
        (tmp_path / name).mkdir()
    for name in ('summary.json', 'bands.png', 'notes.txt'):
        (tmp_path / name).write_text('x')
    prepare(tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {'nodes', 'mine', 'notes.txt'}


def test_missing_workspace_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a sourced workspace the message says what to run."""
    monkeypatch.setenv('AMENT_PREFIX_PATH', '/nowhere')
    with pytest.raises(InputError, match='make setup'):
        executable('estimator')


@pytest.mark.parametrize(
    ('arguments', 'said'),
    [
        (['--channels', 'map.yaml'], 'belongs to --data'),
        (['--seconds', '1'], 'shorter than the window'),
        (['--data', 'missing.csv'], 'missing.csv'),
    ],
)
def test_unusable_arguments_say_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    """Before any node is started."""
    assert command.main(['--out', str(tmp_path / 'out'), *arguments]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / 'out' / 'nodes').exists()


def test_results_are_not_overwritten_unasked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As with every command."""
    (tmp_path / 'summary.json').write_text('precious')
    assert command.main(['--out', str(tmp_path)]) == 2
    assert 'exists already; choose another name, or add --force' in capsys.readouterr().err
    assert (tmp_path / 'summary.json').read_text() == 'precious'


def test_two_processes_never_share_a_domain(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Nor is one taken where a participant of somebody else listens."""
    two = range(1, 3)
    # Locks of their own: other tests of this machine hold domains, too.
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    monkeypatch.setenv('TMPDIR', str(tmp_path))
    monkeypatch.setattr(domain, 'DOMAINS', two)
    monkeypatch.setattr(domain, '_inhabited', lambda number: False)
    text = (
        'import sys\nfrom examples.demonstration import domain\n'
        'domain.DOMAINS = range(1, 3)\ndomain._inhabited = lambda number: False\n'
        'print(domain.free_domain(), flush=True)\nsys.stdin.read()\n'
    )
    held = len(domain._held)
    with subprocess.Popen(
        [sys.executable, '-c', text], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout is not None and other.stdin is not None
        theirs = int(other.stdout.readline())
        assert {theirs, domain.free_domain()} == set(two)
        with pytest.raises(InputError, match='all in use'):
            domain.free_domain()
        other.stdin.close()
        assert other.wait(60.0) == 0
    assert domain.free_domain() == theirs
    for lock in domain._held[held:]:
        lock.close()
    del domain._held[held:]


def test_a_domain_with_a_participant_is_not_free() -> None:
    """Whoever that is: its first participant listens at a port of its own."""
    free = domain.free_domain()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        participant.bind(('127.0.0.1', 7410 + 250 * free))
        assert domain._inhabited(free)
    assert not domain._inhabited(free)
    domain._held.pop().close()


def test_a_parameter_that_drifts_is_followed(tmp_path: Path, rng_seed: int) -> None:
    """The oil's warming is in every window's 95 %; told of no drift, the estimator stays behind.

    Errors last from window to window: in 8 of 330 runs those of one parameter were outside for
    more than two fifths of the windows, in none those of all together (79 % inside at least). The
    largest error was 4.2 standard deviations, the next 3.2: none beyond 6 (95 % interval 0 to
    0.9 % of runs).
    """
    # As the demonstration's, and as far as 3 % in a test that is short.
    source = simulator(20.0, 200.0, None, 'none', tmp_path / 'truth.json', rng_seed)
    assert source.truth is not None
    share = 0.03 / 20.0 / source.truth.growth.max()
    growth = float(share * source.truth.growth.max())
    truth = replace(source.truth, growth=share * source.truth.growth)
    name, rate = source.drift_of[0].split('=')
    record = simulate(
        Command(duration=20.0, rate=200.0),
        stiffness=STIFFNESS,
        theta=source.truth.start,
        effects={'gain-drift': {'gain_drift': growth}},
        seed=rng_seed,
    )
    steps = np.random.default_rng(rng_seed).standard_normal((600, 4))
    known = Carried(NAMES, source.truth.start * np.exp([0.003, 0.003, 0.004, 0.05] * steps))
    settings = EstimatorSettings(window=4.0, time_budget=0.5, prior='sequential', seed=rng_seed)
    follows = replace(settings, drift_of=(f'{name}={share * float(rate):.3g}',))
    off = _off(record, follows, known, truth)
    assert len(off) > 12 and np.abs(off).max() < 6.0
    assert (np.abs(off) < 1.96).mean() > 0.6
    stays = replace(settings, drift=0.0, contradiction='alarm')
    assert _off(record, stays, known, truth)[-1, 1] < -4.0


def _off(record: Record, settings: EstimatorSettings, known: Carried, truth: Truth) -> Array:
    """How far each window's mean is from the truth, in its standard deviations, (windows, 4)."""
    results = replay(stream(record), settings, carried=known)
    found = [r for r in results if isinstance(r, WindowResult) and r.moments is not None]
    windows = [
        SimpleNamespace(
            effects=[],
            samples=len(r.window.record),
            index=r.window.record.first_index,
            period=r.window.record.period,
        )
        for r in found
    ]
    mean, sd = (np.array([getattr(r.moments, c) for r in found]) for c in ('mean', 'stddev'))
    return (mean - truth.over(windows)) / sd


@pytest.mark.ros
def test_a_dying_node_is_reported(tmp_path: Path) -> None:
    """The end of its log is in the message, and the others are stopped."""
    _need_nodes()
    with Nodes() as nodes:
        node = nodes.start('lab_bridge', {'file': str(tmp_path / 'missing.csv')}, tmp_path)
        node.process.wait(60.0)
        with pytest.raises(InputError, match=r'missing\.csv'):
            nodes.check()


_HOLDER = """
import sys, time
from pathlib import Path
from examples.demonstration import domain
from examples.demonstration.outcome import SessionOutcome
from examples.demonstration.processes import Nodes, end_in_order
end_in_order()
with Nodes() as nodes:
    for name in 'ab':
        folder = Path(sys.argv[1], name)
        folder.mkdir()
        node = nodes.start('recorder', {'bag': str(folder / 'bag')}, folder)
        print(node.process.pid, flush=True)
    time.sleep(600.0)
"""


@pytest.mark.ros
@pytest.mark.parametrize(
    'numbers',
    [(signal.SIGTERM,) * 2, pytest.param((signal.SIGHUP, signal.SIGINT), marks=pytest.mark.slow)],
)
def test_whoever_is_ended_ends_its_nodes(tmp_path: Path, numbers: list[signal.Signals]) -> None:
    """A node must not outlive the process that started it, however and often that is told."""
    _need_nodes()
    command = [sys.executable, '-c', _HOLDER, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as holder:
        assert holder.stdout is not None
        nodes = [int(holder.stdout.readline()) for _ in 'ab']
        for number in numbers:
            holder.send_signal(number)
            time.sleep(0.02)
        assert holder.wait(60.0) != 0
    for node in nodes:
        with pytest.raises(ProcessLookupError):
            os.kill(node, 0)


@pytest.mark.ros
@pytest.mark.timeout(240)
def test_demo_from_end_to_end(tmp_path: Path) -> None:
    """Nothing lost, replay identical, everything promised is there; the drift is followed.

    Its seed is fixed: only a computer too slow for the windows fails it by chance.
    """
    _need_nodes()
    out = tmp_path / 'out'
    # A window that starts anew takes several hops while others compile: time for five.
    arguments = ['--seconds', '18', '--rate', '200', '--window', '3', '--no-diagnosis']
    arguments += ['--effect', 'none']
    command = [sys.executable, '-m', 'examples.demonstration', '--out', str(out)]
    done = subprocess.run([*command, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json.loads((out / 'summary.json').read_text())
    assert summary['schema'] == 'examples.demonstration/1'
    assert set(summary['samples'].values()) == {19 * 200 + 1}
    assert summary['replay_identical'] is True
    assert summary['windows'] >= 5
    assert set(summary['moments']) == {'beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3'}
    assert not any(p['prior_dominated'] for p in summary['moments'].values())
    assert min(summary['truth_inside_95'].values()) > 0.6
    drift = summary['drift']['alpha_1_beta_0']
    assert abs(drift['followed'] - drift['true']) < 4.0 * drift['stddev'] < drift['true']
    assert (out / 'bag' / 'metadata.yaml').exists()
    assert {p.name for p in out.glob('*.png')} >= {'bands.png', 'parameters.png', 'prior.png'}


def _need_nodes() -> None:
    try:
        executable('estimator')
    except InputError as error:
        pytest.skip(str(error))


def windows(effects: list[list[str]], inside: list[bool]) -> SimpleNamespace:
    """What a bag holds of as many windows: effects of each, and whether it holds the truth."""
    truth = np.array([134.0, 1.1e9, 2.5e5, 0.5])
    posteriors = [
        SimpleNamespace(
            effects=names,
            structures=[' + '.join(names) or 'Eq. (2)'],
            weights=[1.0],
            mean=truth * (1.01 if right else 1.03),
            stddev=0.01 * truth,
            index=1000 * i,
            samples=5000,
            period=1e-3,
        )
        for i, (names, right) in enumerate(zip(effects, inside, strict=True))
    ]
    record = SimpleNamespace(first_index=0)
    health = {'estimator': {'windows dropped': '3', 'windows failed': '0'}}
    return SimpleNamespace(posteriors=posteriors, record=record, truth=truth, health=health)


@pytest.mark.parametrize(
    ('last', 'wrong', 'said'),
    [
        (['backlash', 'gain-drift'], 1, []),
        (['gain-drift', 'backlash'], 2, ['beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3']),
        (['coulomb-friction'], 0, ['at the end coulomb-friction had the largest weight']),
        ([], 0, ['at the end Eq. (2) had the largest weight, not backlash + gain-drift']),
    ],
)
def test_the_live_chain_is_held_to_what_it_promises(
    last: list[str], wrong: int, said: list[str]
) -> None:
    """Windows before the first addition do not count; one of ten after it may miss the truth."""
    effects = [[]] * 5 + [['backlash']] * 9 + [last]
    content = windows(effects, [False] * 5 + [True] * (10 - wrong) + [False] * wrong)
    outcome = SessionOutcome(
        'a simulator',
        0,
        content,  # type: ignore[arg-type]  # stands for a bag's
        ReplayComparison(),
        np.tile(content.truth, (15, 1)),
        hidden=('backlash', 'gain-drift'),
    )
    broken = outcome.broken_promises()
    assert len(broken) == len(said)
    assert all(text in line for text, line in zip(said, broken, strict=True))
    assert outcome.explanations()[0] == (5.0, 'Eq. (2) 100%')
    assert outcome.explanations()[1] == (10.0, 'backlash 100%')
    assert not replace(outcome, hidden=()).broken_promises()
    assert outcome.answered == 15 / 18
    content.health['estimator']['windows failed'] = '20'
    assert '39% of the windows have a posterior, not 50%' in outcome.broken_promises()


def test_only_the_default_demonstration_promises_what_it_finds(tmp_path: Path) -> None:
    """Other effects may be tied, and a short test ends before an answer."""
    usual = simulator(90.0, 1000.0, None, 'backlash', tmp_path / 't', 1)
    assert usual.promises and set(usual.hidden) == {'backlash', 'gain-drift'}
    assert not simulator(60.0, 1000.0, None, 'backlash', tmp_path / 't', 1).promises
    assert not simulator(90.0, 1000.0, None, 'delay', tmp_path / 't', 1).promises


def test_weights_of_explanations_are_drawn_over_time_with_the_truth_marked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = windows(
        [[]] * 5 + [['backlash']] * 4 + [['gain-drift', 'backlash']] * 6, [True] * 15
    )
    content.posteriors[9].structures = ['gain-drift + backlash', 'Eq. (2)']
    content.posteriors[9].weights = [0.7, 0.3]
    kept: list[Any] = []
    monkeypatch.setattr(pictures.style, 'save', lambda figure, path: kept.append(figure))
    pictures.explanations(
        content,  # type: ignore[arg-type]  # stands for a bag's
        tmp_path / 'p.png',
        ('backlash', 'gain-drift'),
    )
    (axes,) = kept[0].axes
    labels = [text.get_text() for text in kept[0].legends[0].get_texts()]
    assert labels == ['gain-drift + backlash (the truth)', 'Eq. (2)', 'backlash']
    bands = dict(zip(labels, axes.collections, strict=True))
    corners = bands[labels[0]].get_paths()[0].vertices
    # 70 % in the window that ends at 14 s, all from then on, nothing before.
    assert {float(y) for x, y in corners if x > 14.5} <= {0.0, 70.0, 100.0}
    assert max(y for x, y in corners if x < 13.0) == 0.0
    assert 'at the end gain-drift + backlash, 100%' in kept[0].get_suptitle()
