"""The demonstration: real processes, and what it makes of a bag."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from actuator_glue.demo.bag import Content
from actuator_glue.demo.processes import Nodes, executable
from actuator_glue.demo.run import prepare
from actuator_glue.demo.watch import Watch
from actuator_glue.errors import InputError
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.messages import header, message
from actuator_glue.records import Record


def band(index: int, values: np.ndarray, kind: str = 'total') -> SimpleNamespace:
    """Return a scored band around values, one level."""
    return SimpleNamespace(
        kind=kind,
        index=index,
        levels=np.array([0.9]),
        lower=values - 1.0,
        median=values,
        upper=values + 1.0,
        coverage=np.array([0.5]),
        width=np.array([2.0]),
    )


def content(*bands: SimpleNamespace) -> Content:
    """Return a bag's content: 100 samples from running index 1000 on."""
    samples = np.linspace(0.0, 1e-3, 100)
    record = Record(samples, samples, 1e-3, 0.0, first_index=1000)
    return Content(record, 100, [], bands=list(bands))


def test_bands_are_joined_where_they_lie() -> None:
    """Two hops in a row give one band; what no band covers is NaN."""
    joined = content(
        band(1010, np.arange(20.0)),
        band(1030, np.arange(20.0, 50.0)),
        band(1010, np.zeros(5), 'x'),
    ).stitched('total')
    assert joined is not None and len(joined) == 100
    np.testing.assert_array_equal(joined.median[10:60], np.arange(50.0))
    np.testing.assert_array_equal(joined.lower[0, 10:60], np.arange(50.0) - 1.0)
    assert np.isnan(joined.median[:10]).all() and np.isnan(joined.median[60:]).all()


def test_bands_beyond_the_record_are_cut() -> None:
    """A band that reaches out of the record counts as far as the record goes."""
    joined = content(band(1090, np.arange(20.0)), band(995, np.arange(10.0))).stitched('total')
    assert joined is not None
    np.testing.assert_array_equal(joined.median[90:], np.arange(10.0))
    np.testing.assert_array_equal(joined.median[:5], np.arange(5.0, 10.0))
    assert content().stitched('total') is None


def test_coverage_weighs_bands_by_their_samples() -> None:
    """Ten samples count for less than thirty."""
    short, long = band(1000, np.zeros(10)), band(1010, np.zeros(30))
    short.coverage = np.array([1.0])
    assert content(short, long).coverage('total') == {'0.9': pytest.approx(0.625)}
    assert content(short, long).mean_width('total', 0.9) == 2.0


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


@pytest.mark.ros
def test_a_dying_node_is_reported(tmp_path: Path) -> None:
    """The end of its log is in the message, and the others are stopped."""
    _need_nodes()
    with Nodes() as nodes:
        node = nodes.start('lab_bridge', {'file': str(tmp_path / 'missing.csv')}, tmp_path)
        assert nodes.wait_for_end(node, 30.0)
        with pytest.raises(InputError, match=r'missing\.csv'):
            nodes.check()


_HOLDER = """
import sys, time
from pathlib import Path
from actuator_glue.demo.processes import Nodes, end_in_order
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
    command = [sys.executable, '-m', 'actuator_glue.cli.main', 'demo', '--out', str(out)]
    done = subprocess.run([*command, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json.loads((out / 'summary.json').read_text())
    assert summary['schema'] == 'actuator_glue.demo/1'
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
