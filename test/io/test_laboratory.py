"""Laboratory files: what is read, and one clear message for what is not."""

import argparse
import os
import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from actuator_glue.cli._save import add_out
from actuator_glue.errors import InputError
from actuator_glue.even_times import uniform_period
from actuator_glue.io import formats
from actuator_glue.io.channel_map import Channel, ChannelMap, parse_channel_map, read_channel_map
from actuator_glue.io.export import write
from actuator_glue.io.laboratory import read
from actuator_glue.io.load import load_records
from actuator_glue.records import Record

ROOT = Path(__file__).resolve().parents[2]
MTS_MAP = ROOT / 'config' / 'channels' / 'mts.yaml'
MTS = Path(os.environ.get('ACTUATOR_GLUE_MTS', ROOT.parent / 'shared' / 'data' / 'mts'))


def csv(path: Path, header: str, rows: list[str] | None = None) -> Path:
    """Write a CSV of a header and rows."""
    rows = rows or [f'{i * 1e-3:.3f},{i},{i * 0.5},{i * 2}' for i in range(10)]
    path.write_text('\n'.join([header, *rows]) + '\n')
    return path


def test_units_are_in_the_names(tmp_path: Path) -> None:
    """Each unit the issue names, and both ways to write it."""
    for name, column, factor in (
        ('m', 'command_m', 1.0),
        ('mm', 'Command [mm]', 1e-3),
        ('um', 'command_um', 1e-6),
        ('in', 'command_in', 0.0254),
    ):
        path = csv(tmp_path / f'{name}.csv', f'time_s,{column},measured_mm,force_kN')
        record = read(path)
        np.testing.assert_allclose(record.command, np.arange(10) * factor, rtol=1e-15)
        np.testing.assert_allclose(record.measured, np.arange(10) * 0.5e-3, rtol=1e-15)
        assert record.force is not None
        np.testing.assert_allclose(record.force, np.arange(10) * 2e3, rtol=1e-15)
        assert record.period == 1e-3


@pytest.mark.parametrize('delimiter', [',', ';', '\t', ' '])
def test_delimiters_are_found(tmp_path: Path, delimiter: str) -> None:
    """Comma, semicolon, tab and blanks; other columns are not looked at."""
    header = delimiter.join(['comment', 'time_ms', 'measured_mm', 'command_mm'])
    rows = [delimiter.join(['text', str(i), str(i * 0.5), str(i)]) for i in range(10)]
    record = read(csv(tmp_path / 'a.txt', header, rows))
    np.testing.assert_allclose(record.command, np.arange(10) * 1e-3)
    assert record.force is None


@pytest.mark.parametrize(
    ('header', 'words'),
    [
        ('time_s,command,measured_mm,force_N', 'command_m or command_mm'),
        ('time,command_mm,measured_mm,force_N', "'time' has no unit"),
        ('time_s,command_furlong,measured_mm,force_N', "unit 'furlong'"),
        ('time_s,command_MM,measured_mm,force_N', "unit 'MM'"),
        ('time_s,command_mm,mesured_mm,force_N', 'no column for measured'),
        ('time_s,command_mm,command_m,measured_mm', 'two columns are called command'),
        ('0.0,1,2,3', 'first line must name the columns'),
        ('a,b,c,d', 'no column for time'),
    ],
)
def test_a_header_that_cannot_be_used(tmp_path: Path, header: str, words: str) -> None:
    """Missing or unknown unit, missing or doubled column, no header."""
    path = csv(tmp_path / 'a.csv', header)
    with pytest.raises(InputError, match=words) as caught:
        read(path)
    assert str(path) in str(caught.value)


def rows(time: list[float], command: str = '1') -> list[str]:
    """Return rows with these times."""
    return [f'{t!r},{command},0,0' for t in time]


GRID = [i * 1e-3 for i in range(10)]


@pytest.mark.parametrize(
    ('lines', 'words'),
    [
        (rows([0.0]), r'1 sample\(s\)'),
        (rows([0.0, 0.001, 0.003, 0.002]), 'time goes back at sample 3'),
        (rows([0.0, 0.001, 0.001, 0.002]), 'time stands still at sample 2'),
        (rows([*GRID, 0.5, 0.501]), 'without samples after sample 9'),
        (rows([0.0, 0.001, 0.0014, 0.003, 0.004]), 'not uniform'),
        (rows([float('nan'), 0.001, 0.002]), 'time is NaN'),
        (rows(GRID, 'nan'), 'NaN or infinite'),
        (rows(GRID, '1e9'), 'check the unit'),
        (rows(GRID, 'abc'), "'abc'"),
        (rows(GRID, ''), "''"),
        (['0,1', '0.001,1'], 'cannot read the samples'),
        ([], 'no samples after'),
    ],
)
def test_samples_that_cannot_be_used(tmp_path: Path, lines: list[str], words: str) -> None:
    """One sample, time going back, gap, jitter, NaN, 1e6 m, text, short row, no row."""
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join(['time_s,command_mm,measured_mm,force_N', *lines]) + '\n')
    with pytest.raises(InputError, match=words) as caught:
        read(path)
    assert str(path) in str(caught.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    """Missing, empty, a folder."""
    with pytest.raises(InputError, match='no such file'):
        read(tmp_path / 'a.csv')
    (tmp_path / 'a.csv').write_text('')
    with pytest.raises(InputError, match='empty'):
        read(tmp_path / 'a.csv')
    with pytest.raises(InputError, match='folder'):
        read(tmp_path)


@settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(text=st.text(max_size=200), named=st.booleans())
def test_any_text_gives_a_record_or_one_message(tmp_path: Path, text: str, named: bool) -> None:
    """Whatever is in a text file, nothing but InputError comes out."""
    path = tmp_path / 'any.csv'
    head = 'time_s,command_mm,measured_mm\n' if named else ''
    path.write_text(head + text, encoding='utf-8', errors='surrogatepass')
    with pytest.raises(InputError):
        read(path)


def test_time_base_takes_rounded_and_skewed_clocks() -> None:
    """Rounded stamps give the rate back; a clock 20 ppm off is not rounded away."""
    count = np.arange(60_000)
    assert uniform_period(np.round(count / 1024, 4), 'x') == 1 / 1024
    assert uniform_period(1e9 + count * 5e-3, 'x') == 5e-3
    skewed = uniform_period(count * 1e-3 * (1 + 20e-6), 'x')
    assert skewed == pytest.approx(1e-3 * (1 + 20e-6), rel=1e-9)
    with pytest.raises(InputError, match='--resample 1024'):
        uniform_period(np.round(count / 1024, 3), 'x')


@pytest.mark.parametrize('suffix', ['.csv', '.mat'])
@pytest.mark.parametrize('stiffness', [None, 0.0, 250e3])
def test_export_and_back(
    tmp_path: Path, record: Record, suffix: str, stiffness: float | None
) -> None:
    """In m nothing is lost; in mm one rounding; stiffness, hold and name come back."""
    record = replace(record, stiffness=stiffness, hold='linear')
    for unit in ('m', 'mm'):
        path = tmp_path / f'{unit}{suffix}'
        write(path, record, unit=unit)
        back = read(path)
        assert back.stiffness == stiffness
        assert (back.hold, back.actuator, back.period) == ('linear', 'mts', 1e-3)
        assert back.start_ns == record.start_ns
        np.testing.assert_allclose(back.command, record.command, rtol=3e-16, atol=0)
        if unit == 'm':
            assert back.measured.tobytes() == record.measured.tobytes()
            assert back.force is not None
            assert record.force is not None
            assert back.force.tobytes() == record.force.tobytes()


def test_a_format_is_one_file(tmp_path: Path, record: Record) -> None:
    """Every module of io/formats reads what it writes, and its suffix is in the help."""
    folder, parser = Path(formats.__path__[0]), argparse.ArgumentParser()
    add_out(parser)
    names = {file.stem for file in folder.glob('[a-z]*.py')}
    assert len(set(map(id, formats.formats().values()))) == len(names)
    for suffix in formats.writable():
        write(tmp_path / f'a{suffix}', record, unit='m')
        assert read(tmp_path / f'a{suffix}').measured.tobytes() == record.measured.tobytes()
        assert suffix in parser.format_help()


def test_matlab_structs_and_damage(tmp_path: Path, record: Record) -> None:
    """Fields of a struct are found; a damaged file is told."""
    test = {'time_s': record.time, 'command_mm': record.command * 1e3}
    savemat(tmp_path / 'a.mat', {'test': {**test, 'measured_mm': record.measured[:, None] * 1e3}})
    np.testing.assert_allclose(read(tmp_path / 'a.mat').measured, record.measured)
    content = (tmp_path / 'a.mat').read_bytes()
    for cut in (0, 50, 128, 140, len(content) // 2):
        (tmp_path / 'c.mat').write_bytes(content[:cut])
        with pytest.raises(InputError, match=r'c\.mat'):
            read(tmp_path / 'c.mat')


def test_the_how_to_says_what_is_true(tmp_path: Path) -> None:
    """Its channel map is the shipped one, its CSV is read, its table names every entry."""
    text = (ROOT / 'docs' / 'howto_your_data.md').read_text()
    blocks = re.findall(r'```(\w*)\n(.*?)```', text, flags=re.DOTALL)
    described, topics = [yaml.safe_load(body) for kind, body in blocks if kind == 'yaml']
    assert parse_channel_map(topics, 'topics').topics
    shipped = read_channel_map(MTS_MAP)
    assert parse_channel_map(described, shipped.source) == shipped
    (example,) = [body for kind, body in blocks if body.startswith('time_s')]
    (tmp_path / 'a.csv').write_text(example)
    assert len(read(tmp_path / 'a.csv')) == 2
    for entry in (*fields(ChannelMap), *fields(Channel)):
        assert f'`{entry.name}`' in text or entry.name == 'source', entry.name


@pytest.mark.skipif(not MTS.is_dir(), reason=f'measured MTS records are not at {MTS}')
@pytest.mark.parametrize(('name', 'samples'), [('0A', 46_800), ('0p5A', 48_000), ('1A', 51_900)])
def test_measured_mts_records(name: str, samples: int) -> None:
    """The shipped map gives the sizes, rest noise and travel that the records' notes state."""
    path = MTS / f'mts_2022-05-25_chirp15Hz_MR{name}.txt'
    record = read(path, channels=MTS_MAP, stiffness=0.0)
    assert (len(record), record.period, record.actuator) == (samples, 1e-3, 'mts')
    rest = slice(0, 2000)
    assert abs(record.measured[rest].mean()) < 1e-9
    assert record.measured[rest].std() == pytest.approx(3e-6, rel=0.3)
    assert np.ptp(record.command) == pytest.approx(4e-3, rel=0.01)
    assert record.command.max() < 0.05e-3  # one-sided: 0 to -4 mm
    assert record.force is not None
    # 0 A moves 0.5 kN peak to peak; the force grows about five-fold at 0.5 A and 1 A.
    assert 400 < np.ptp(record.force) < 4000


@pytest.mark.skipif(not MTS.is_dir(), reason=f'measured MTS records are not at {MTS}')
def test_a_gap_in_the_sample_numbers_is_found(tmp_path: Path) -> None:
    """Rows taken out of a measured record are missed."""
    lines = (MTS / 'mts_2022-05-25_chirp15Hz_MR0A.txt').read_text().splitlines(keepends=True)
    path = tmp_path / 'cut.txt'
    path.write_text(''.join(lines[:5000] + lines[5003:]))
    with pytest.raises(InputError, match='jump from 4993 to 4997'):
        read(path, channels=MTS_MAP)


def test_load_takes_anything(tmp_path: Path, bag: Path, record: Record) -> None:
    """Bag and file together, stiffnesses one for all, per path, per record."""
    write(tmp_path / 'a.csv', record, unit='m')
    paths = [bag, tmp_path / 'a.csv']
    assert [r.stiffness for r in load_records(paths)] == [250e3, 250e3]
    assert [r.stiffness for r in load_records(paths, stiffness=0)] == [0.0, 0.0]
    assert [r.stiffness for r in load_records(paths, stiffness=[0, 5])] == [0.0, 5.0]
    assert [r.hold for r in load_records(paths, hold='linear')] == ['linear', 'linear']
    assert load_records(bag / 'bag_0.mcap')[0].measured.tobytes() == record.measured.tobytes()
    with pytest.raises(InputError, match='3 stiffnesses for 2 path'):
        load_records(paths, stiffness=[1, 2, 3])
    with pytest.raises(InputError, match='outside'):
        load_records(paths, stiffness=-1)
    with pytest.raises(InputError, match='no record'):
        load_records([])
