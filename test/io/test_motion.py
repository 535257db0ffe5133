"""Records that move in degrees, counts or volts: kept, spoken, and never mixed with metres."""

import json
import re
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

import actuator_glue as ag
from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import decoded
from actuator_glue.io.bag_records import read_records, write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.export import write
from actuator_glue.motion import speaking, spoken
from actuator_glue.online.collect import Collector
from actuator_glue.online.playback import stream
from actuator_glue.records import Record
from actuator_glue.report import style
from actuator_glue.report.style import png
from actuator_glue.setups import StreamSetup, from_message

BAGS = Path(__file__).resolve().parents[2] / 'bags'
RATE, COUNT = 200.0, 2000
TIME = np.arange(COUNT) / RATE
COMMAND = 2e-3 * np.sin(0.3 * TIME**2)
MEASURED = np.roll(COMMAND, 3)


def record(motion: str = 'deg', **more) -> Record:
    """Return a test of 2 degrees, 2 volts, 2000 counts."""
    return Record(COMMAND, MEASURED, 1.0 / RATE, 0.0, motion=motion, **more)


@pytest.mark.parametrize(
    ('text', 'told'),
    [
        ('held-out error 36.2 -> 10.0 um', 'held-out error 36.2 -> 10.0 mdeg'),
        ('rms [um]', 'rms [mdeg]'),
        ('TI at the end mm^2', 'TI at the end deg^2'),
        ('N/(m s^2)', 'Nm/(kdeg s^2)'),
        ('alpha_2 N/m', 'alpha_2 Nm/kdeg'),
        ('41 um (40.2 to 41.9)', '41 mdeg (40.2 to 41.9)'),
        ('velocity [mm/s]', 'velocity [deg/s]'),
        ('beyond 10 m; 3 kN', 'beyond 10 kdeg; 3 kNm'),
        ('<td>um</td><td>m</td>', '<td>mdeg</td><td>kdeg</td>'),
        ('m', 'kdeg'),
        (r'residual [um/$\sqrt{\mathrm{Hz}}$]', r'residual [mdeg/$\sqrt{\mathrm{Hz}}$]'),
        ('/data/m/mm/um.csv: command_mm of test mm.csv, --noise-mm', ''),
        ('a hold m. of A/m/b, 2 min, 3 ms, 5 N.m', ''),
    ],
)
def test_sizes_are_said_in_the_unit_of_the_motion(text: str, told: str) -> None:
    """Wherever they stand; paths, names and other units are left alone, and metres are metres."""
    assert spoken(text, 'deg') == (told or text)
    assert spoken(text) == spoken(text, 'm') == text
    with speaking('deg'):
        assert spoken(text) == (told or text)


def test_figures_speak_it() -> None:
    """Labels of axes, as the figure is drawn."""
    with mpl.rc_context():
        figure = Figure()
        axes = figure.add_subplot()
        axes.set_ylabel('residual [um]')
        png(figure)
        assert axes.get_ylabel() == 'residual [um]'
        with speaking('V'):
            png(figure)
    assert axes.get_ylabel() == 'residual [mV]'


@pytest.mark.parametrize('suffix', ['.csv', '.mat', '.h5', '.parquet'])
@pytest.mark.parametrize('motion', ['deg', 'counts', 'V', 'mA', '%'])
def test_files_keep_it(tmp_path: Path, motion: str, suffix: str) -> None:
    """Written in its unit and read back the same."""
    write(tmp_path / f'a{suffix}', record(motion))
    back = ag.load(tmp_path / f'a{suffix}')
    assert back.motion == motion
    np.testing.assert_allclose(back.command, COMMAND, rtol=1e-12, atol=1e-18)
    assert repr(back).endswith(f'zoh, in {motion})')


@pytest.mark.parametrize('motion', ['m', 'deg', 'counts'])
def test_bags_keep_it(tmp_path: Path, motion: str) -> None:
    """Bit for bit; and a bag of before it was told is in metres."""
    with BagWriter(tmp_path / 'bag') as bag:
        write_record(bag, record(motion))
    (back,) = read_records(tmp_path / 'bag')
    assert back.motion == motion
    np.testing.assert_array_equal(back.measured, MEASURED)
    (set_up,) = (m for _, m in decoded(tmp_path / 'bag', ('TestSetup',)))
    assert set_up.motion == motion
    (streamed,) = (item for item in stream(back) if isinstance(item, StreamSetup))
    assert streamed.same_test(from_message(set_up))
    (older,) = (m for _, m in decoded(BAGS / 'free', ('TestSetup',)))
    assert older.motion == ''
    assert from_message(older).motion == 'm'
    assert not streamed.same_test(replace(streamed, motion='V'))


def test_windows_of_a_stream_move_as_it_does() -> None:
    """What is kept of it for a diagnosis speaks its unit."""
    collector = Collector(5.0)
    for item in stream(record('deg')):
        (collector.setup if isinstance(item, StreamSetup) else collector.push)(item)
    assert {kept.motion for kept in collector.records()} == {'deg'}


def test_a_replay_speaks_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a bag as of records; the bag is shown without a stiffness in newtons over volts."""
    test = ag.simulate(ag.Command(rate=RATE, duration=8.0), stiffness=0.0, seed=3)
    with BagWriter(tmp_path / 'bag') as bag:
        write_record(bag, replace(test, motion='V'))
    assert main(['info', str(tmp_path / 'bag')]) == 0
    assert ', no specimen, hold zoh' in capsys.readouterr().out
    assert main(['replay', str(tmp_path / 'bag'), '--hop', '3']) == 0
    assert 'rms [mV]' in capsys.readouterr().out
    found = ag.replay(replace(test, motion='V'), hop=3.0)
    assert found.motion == ag.Replay.load(found.save(tmp_path / 'r.npz')).motion == 'V'
    assert 'rms [mV]' in repr(found) and 'um' not in repr(found)


def test_commands_speak_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Ranges, limits and refusals; the next command is in metres again."""
    write(tmp_path / 'a.csv', record('counts', force=np.ones(COUNT)))
    assert main(['info', str(tmp_path / 'a.csv'), '--json', str(tmp_path / 'a.json')]) == 0
    shown = capsys.readouterr().out
    assert '2 kcounts' in shown
    assert ' mm' not in shown
    told = json.loads((tmp_path / 'a.json').read_text())['files'][0]['records'][0]
    assert told['motion'] == 'counts'
    write(tmp_path / 'b.csv', replace(record('m'), stiffness=250e3))
    assert main(['info', str(tmp_path / 'b.csv')]) == 0
    assert '2 mm' in capsys.readouterr().out
    far = Record(1e3 * COMMAND, 1e3 * MEASURED, 1.0 / RATE, 0.0, motion='deg')
    write(tmp_path / 'c.csv', far)
    assert main(['info', str(tmp_path / 'c.csv')]) == 2
    assert 'command moves over 4 kdeg, and 2 kdeg are the most' in capsys.readouterr().err


def test_what_metres_alone_can_have_is_refused(tmp_path: Path) -> None:
    """A stiffness in N/m, tests of two motions together, channels of two, a torque."""
    with pytest.raises(InputError, match='the motion is in deg: give 0'):
        replace(record(), stiffness=250e3)
    with pytest.raises(InputError, match="motion 'furlong' is unknown"):
        record('furlong')
    with pytest.raises(InputError, match=r"set-up of 'a': .* and the motion is in deg"):
        StreamSetup(250e3, 1.0 / RATE, 'a', motion='deg')
    with pytest.raises(InputError, match='one moves in deg and another in m;'):
        ag.calibrate([record(), replace(record('m'), command=-COMMAND)])
    head = 'time_s,{},{}{}\n' + '\n'.join(f'{i * 0.01},{i % 7},{i % 5},0' for i in range(99))
    for names, said in (
        (('command_deg', 'measured_mm', ',x'), 'command has unit .deg.*mm per deg'),
        (('command_mm', 'measured_V', ',x'), "measured has unit 'V'.*mm per V"),
        (('command_deg', 'measured_counts', ',x'), 'counts per deg'),
        (('command_mm', 'measured_mm', ',force_Nm'), 'a torque'),
    ):
        (tmp_path / 'a.csv').write_text(head.format(*names))
        with pytest.raises(InputError, match=said):
            ag.load(tmp_path / 'a.csv')
    (tmp_path / 'a.csv').write_text(head.format('command_rad', 'measured_deg', ',force_kNm'))
    assert ag.load(tmp_path / 'a.csv').motion == 'deg'


def test_arrays_may_be_angles() -> None:
    """As they may be millimetres."""
    made = Record.from_arrays(TIME, np.radians(1e3 * COMMAND), MEASURED, unit='rad')
    assert made.motion == 'deg'
    np.testing.assert_allclose(made.command, COMMAND, atol=1e-15)


def test_a_calibration_speaks_it(tmp_path: Path) -> None:
    """The same numbers as in metres, with other units; kept where it is saved."""
    test = ag.simulate(ag.Command(rate=RATE, duration=10.0), stiffness=0.0, seed=3)
    options = {'evaluations': 12_000, 'seed': 5}
    plain = ag.calibrate(test, **options)
    turned = ag.calibrate(replace(test, motion='deg'), **options)
    np.testing.assert_array_equal(plain.draws, turned.draws)
    assert turned.motion == 'deg'
    assert ' mm' in repr(plain)
    assert repr(turned) == spoken(repr(plain), 'deg') != repr(plain)
    # Pictures, predictions and tables, and after it was saved and read.
    again = ag.Calibration.load(turned.save(tmp_path / 'turned.npz'))
    for found in (turned, again):
        assert found.motion == 'deg'
        assert not in_metres(found.plot())
        moved = found.predict(ag.Command('sine', rate=RATE, duration=1.0), 0.0)
        assert moved.plot().axes[0].get_ylabel() == 'displacement [deg]'
        assert ' mdeg ' in repr(moved)
        assert found.to_dataframe()['unit']['alpha_2'] == 'Nm/kdeg'
        assert not in_metres(found.plot_bands(replace(test, motion='deg')))
    with pytest.raises(InputError, match='and what was fitted moves in deg'):
        turned.predict(test)


def in_metres(figure: Figure) -> list[str]:
    """Return the texts of a figure that speak of metres or newtons."""
    texts = [text.get_text() for text in figure.findobj(Text)]
    assert any('deg' in text for text in texts)
    return [text for text in texts if re.search(r'\b([um]?m|k?N)(/|\b)(?!s)', text)]


@pytest.mark.parametrize(
    ('unit', 'axis', 'size'), [('deg', 'deg', 2.0), ('counts', 'kcounts', 0.002), ('V', 'V', 2.0)]
)
def test_a_picture_speaks_it(unit: str, axis: str, size: float, tmp_path: Path) -> None:
    """Labels and numbers are those of the file; before it is shown, and as it is written."""
    given = size / 2e-3 * COMMAND if axis == unit else 2.0 * COMMAND / 2e-3
    shown = ag.plot(Record.from_arrays(TIME, given, 0.5 * given, unit=unit))
    assert {a.get_ylabel() for a in shown.axes} - {''} == {
        f'displacement [{axis}]',
        f'tracking\nerror [{axis}]',
    }
    command, measured = (np.asarray(line.get_ydata()) for line in shown.axes[0].lines)
    assert np.abs(command).max() == pytest.approx(size, rel=1e-3)
    np.testing.assert_allclose(measured, 0.5 * command)
    shown.axes[0].set_title('limit [mm]')
    shown.savefig(tmp_path / 'a.png')  # not through our own writer
    assert shown.axes[0].get_title() == f'limit [{axis}]'
    assert [t.get_text() for t in shown.legends[0].get_texts()] == ['command', 'measured']


def test_the_command_plot_speaks_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each record in its own unit, whatever comes before it."""
    seen: list[list[str]] = []
    monkeypatch.setattr(
        style, 'save', lambda figure, path: seen.append([a.get_ylabel() for a in figure.axes])
    )
    write(tmp_path / 'a.csv', record('m'))
    write(tmp_path / 'b.csv', record('V'))
    files = [str(tmp_path / name) for name in ('a.csv', 'b.csv')]
    assert main(['plot', *files, '--out', str(tmp_path)]) == 0
    assert [labels[0] for labels in seen] == ['displacement [mm]', 'displacement [V]']


@pytest.mark.usefixtures('undrawn')
def test_a_diagnosis_speaks_it(tmp_path: Path) -> None:
    """Headline, picture, report and table, from the library as from the command line."""
    test = ag.simulate(ag.Command(rate=RATE, duration=8.0), stiffness=0.0, seed=3)
    with pytest.raises(InputError, match='holdout: moves in m, and the records move in deg'):
        ag.diagnose(replace(test, motion='deg'), holdout=test)
    found = ag.diagnose(replace(test, motion='deg'), effort=0.05, jobs=1)
    assert found.to_json()['motion'] == 'deg'
    assert ' mdeg' in found.summary() and ' um' not in found.summary()
    assert not in_metres(found.plot())
    again = ag.Diagnosis.load(found.save(tmp_path / 'd.npz'))
    page = again.report(tmp_path / 'd.html').read_text('utf-8')
    told = re.sub(r'<style.*?</style>|data:image/png;base64,[^"]*', '', page, flags=re.DOTALL)
    assert 'mdeg' in told
    assert not re.findall(r'[^<>]*\d (?:um|mm|kN)\b[^<>]*', told)
