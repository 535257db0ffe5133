"""Files that are no text, text in other codings, and messages about what a file holds."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.cli.main import main
from actuator_glue.errors import LONGEST, InputError
from actuator_glue.io.channel_map import read_channel_map
from actuator_glue.io.laboratory import read
from actuator_glue.io.look import look

TIME = np.arange(50) * 0.01
ROWS = [[f'{t:.2f}', f'{math.sin(t)!r}', f'{math.cos(t)!r}'] for t in TIME.tolist()]
HEAD = ['time_s', 'command_mm', 'measured_mm']
BYTES = bytes(range(256)) * 50


def text(delimiter: str = ',', quote: str = '', decimal: str = '.') -> str:
    """Return fifty samples as delimited text."""
    rows = [HEAD, *([v.replace('.', decimal) for v in row] for row in ROWS)]
    return '\n'.join(delimiter.join(f'{quote}{v}{quote}' for v in row) for row in rows) + '\n'


@pytest.mark.parametrize('suffix', ['.csv', '.mat', '.txt'])
@pytest.mark.parametrize(
    ('content', 'name'),
    [
        (b'PK\x03\x04' + b'\0' * 26 + b'[Content_Types].xml' + BYTES, 'Excel'),
        (b'PK\x03\x04' + b'\0' * 26 + b'draws.npy' + BYTES, 'NumPy'),
        (b'\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1' + BYTES, 'Excel'),
        (b'PAR1' + BYTES, 'Parquet'),
        (b'TDSm' + BYTES, 'TDMS'),
        (b'\x89HDF\r\n\x1a\n' + BYTES, 'HDF5'),
        (b'SQLite format 3\0' + BYTES, 'rosbags-convert'),
        (b'\x89MCAP0\r\n' + BYTES, 'MCAP'),
        (b'\x1f\x8b' + BYTES, 'gzip'),
        (b'CDF\1' + BYTES, 'netCDF'),
        (b'FEA1' + BYTES, 'Feather'),
        (pickle.dumps(dict.fromkeys(HEAD, ROWS)), 'pickle'),
        (pickle.dumps(dict.fromkeys(HEAD, ROWS), protocol=2), 'pickle'),
        (BYTES, 'binary|MATLAB'),
        (bytes(range(1, 256)) * 50, 'binary|MATLAB'),
    ],
)
def test_what_is_no_text_is_named(tmp_path: Path, content: bytes, name: str, suffix: str) -> None:
    """One short printable message that names the format, as a record and as a channel map."""
    path = tmp_path / f'file{suffix}'
    path.write_bytes(content)
    for use in (read, read_channel_map):
        with pytest.raises(InputError, match=name) as caught:
            use(path)
        message = str(caught.value)
        assert str(path) in message
        assert message.isprintable()
        assert len(message) <= LONGEST


@pytest.mark.parametrize('coding', ['utf-8', 'utf-8-sig', 'utf-16'])
@pytest.mark.parametrize(
    ('content', 'name'),
    [
        ('{"time_s": [0.0, 0.1], "command_mm": [1.0, 2.0]}', 'JSON'),
        ('[0.0, 1.0, 2.0]\n[0.1, -2.0, 1e-3]\n', 'JSON'),
        ('[{"time_s": 0.0, "command_mm": 1.0},\n {"time_s": 0.1, "command_mm": 2.0}]', 'JSON'),
        ('<?xml version="1.0"?>\n<Workbook>', 'XML'),
        ('\n<TABLE><tr><td>time_s</td></tr>', 'HTML'),
    ],
)
def test_text_that_is_no_table_is_named(
    tmp_path: Path, content: str, name: str, coding: str
) -> None:
    """Web services and old spreadsheets save such under names of tables."""
    path = tmp_path / 'a.xls'
    path.write_bytes(content.encode(coding))
    for use in (read, look):
        with pytest.raises(InputError, match=f'this is .*{name}.*, not a table of numbers; save'):
            use(path)


@pytest.mark.parametrize(
    'head', ['{"run": 5}', '{\n"run": 5\n}', '<?xml version="1"?>', 'FEA1 model']
)
def test_a_table_below_such_a_head_is_read(tmp_path: Path, head: str) -> None:
    path = tmp_path / 'a.csv'
    path.write_text(f'{head}\n{text()}')
    made = tmp_path / 'map.yaml'
    assert main(['map', str(path), '--out', str(made)]) == 0
    assert read(path, channels=made).rate == 100.0


@pytest.mark.parametrize(
    'encoding', ['utf-8', 'utf-8-sig', 'utf-16', 'utf-16-le', 'utf-16-be', 'utf-32']
)
def test_unicode_text_of_any_coding_is_read(tmp_path: Path, encoding: str) -> None:
    """Spreadsheets save UTF-16 as "Unicode text", with a mark or without."""
    path = tmp_path / 'a.txt'
    path.write_bytes(text('\t').encode(encoding))
    record = read(path)
    np.testing.assert_allclose(record.command, np.sin(TIME) * 1e-3, rtol=1e-12)
    assert len(record) == 50


@pytest.mark.parametrize(
    ('delimiter', 'decimal'), [(',', '.'), (',', ','), (';', ','), ('\t', '.'), (' ', '.')]
)
def test_quoted_numbers_are_numbers(tmp_path: Path, delimiter: str, decimal: str) -> None:
    """Quotes about every entry, the decimal comma within them included."""
    path = tmp_path / 'a.csv'
    path.write_text(text(delimiter, '"', decimal))
    np.testing.assert_allclose(read(path).measured, np.cos(TIME) * 1e-3, rtol=1e-12)


def test_a_record_is_no_channel_map(tmp_path: Path) -> None:
    """Given as its own map it is told in a line, however large it is."""
    path = tmp_path / 'a.csv'
    for content in (text(), text(quote='"'), text() * 500):
        path.write_text(content)
        with pytest.raises(InputError, match='channel map') as caught:
            read(path, channels=path)
        assert len(str(caught.value)) < 250


@pytest.mark.parametrize(
    ('column', 'words'),
    [
        ('{column: Time [s], unit: s}', r"quotes .*'Time \[s\]'"),
        ('{column: [s], unit: s}', r"quotes .*'Time \[s\]'"),
        ('{column: t, unit: [s]}', 'without brackets'),
    ],
)
def test_brackets_without_quotes_get_a_hint(tmp_path: Path, column: str, words: str) -> None:
    """YAML takes [s] for a list; the message says what to write."""
    path = tmp_path / 'map.yaml'
    other = '{column: 2, unit: mm}'
    path.write_text(f'time: {column}\ncommand: {other}\nmeasured: {other}\n')
    with pytest.raises(InputError, match=words):
        read_channel_map(path)


def test_messages_are_short_printable_and_survive_a_pipe() -> None:
    """Start and end stay: what is wrong, and what to do."""
    error = InputError('wrong: ' + '\x1b[31m\n\0' * 500 + ' do this')
    message = str(error)
    assert len(message) <= LONGEST
    assert message.isprintable()
    assert message.startswith('wrong: \\x1b[31m\\n\\x00')
    assert message.endswith(' do this')
    assert str(pickle.loads(pickle.dumps(error))) == message


@pytest.mark.parametrize('name', ['zarr.json', '.zgroup'])
def test_a_zarr_store_is_named(tmp_path: Path, name: str) -> None:
    """Its files one by one are no records."""
    (tmp_path / name).write_text('{}')
    with pytest.raises(InputError, match='this is a Zarr store, which is not read; save HDF5 or'):
        read(tmp_path)
