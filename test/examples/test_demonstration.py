"""The demonstration: real processes, and what it makes of a bag."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.messages import header, message
from examples.demonstration import __main__ as command
from examples.demonstration.processes import Nodes, executable
from examples.demonstration.run import prepare
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


@pytest.mark.ros
def test_a_dying_node_is_reported(tmp_path: Path) -> None:
    """The end of its log is in the message, and the others are stopped."""
    _need_nodes()
    with Nodes() as nodes:
        node = nodes.start('lab_bridge', {'file': str(tmp_path / 'missing.csv')}, tmp_path)
        node.process.wait(30.0)
        with pytest.raises(InputError, match=r'missing\.csv'):
            nodes.check()


_HOLDER = """
import sys, time
from pathlib import Path
from examples.demonstration.processes import Nodes, end_in_order
end_in_order()
with Nodes() as nodes:
    node = nodes.start('recorder', {'bag': str(Path(sys.argv[1], 'bag'))}, Path(sys.argv[1]))
    print(node.process.pid, flush=True)
    time.sleep(60.0)
"""


@pytest.mark.ros
@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGHUP])
def test_whoever_is_ended_ends_its_nodes(tmp_path: Path, number: signal.Signals) -> None:
    """A node must not outlive the process that started it, however that is told to end."""
    _need_nodes()
    command = [sys.executable, '-c', _HOLDER, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as holder:
        assert holder.stdout is not None
        node = int(holder.stdout.readline())
        os.kill(node, 0)
        holder.send_signal(number)
        assert holder.wait(30.0) != 0
    with pytest.raises(ProcessLookupError):
        os.kill(node, 0)


@pytest.mark.ros
@pytest.mark.timeout(240)
def test_demo_from_end_to_end(tmp_path: Path) -> None:
    """Nothing lost, replay identical, everything promised is there."""
    _need_nodes()
    out = tmp_path / 'out'
    arguments = ['--seconds', '12', '--rate', '200', '--window', '3', '--no-diagnosis']
    command = [sys.executable, '-m', 'examples.demonstration', '--out', str(out)]
    done = subprocess.run([*command, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json.loads((out / 'summary.json').read_text())
    assert summary['schema'] == 'examples.demonstration/1'
    assert set(summary['samples'].values()) == {13 * 200 + 1}
    assert summary['replay_identical'] is True
    assert summary['windows'] >= 5
    assert set(summary['moments']) == {'beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3'}
    assert (out / 'bag' / 'metadata.yaml').exists()
    assert {p.name for p in out.glob('*.png')} >= {'bands.png', 'parameters.png'}


def _need_nodes() -> None:
    try:
        executable('estimator')
    except InputError as error:
        pytest.skip(str(error))
