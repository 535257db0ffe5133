"""LabVIEW's text files in all variants of their headings: read as lvm-read does."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import lvm_read
import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from actuator_glue.io.laboratory import read
from actuator_glue.io.look import look

PERIOD = 2e-3
WORDS = {'\t': 'Tab', ',': 'Comma', ';': 'Semicolon'}
NAMES = ['Command', 'Measured', 'Load cell (bridge 1)', 'Untitled 3']
UNITS = {'Command': 'mm', 'Measured': 'um', 'Load cell (bridge 1)': 'kN', 'Untitled 3': ''}
MICRO = {'mm': 1e-3, 'um': 1e-6}
# Lines of the file's heading that say nothing of the samples; any may be missing.
ASIDE = {
    'Reader_Version': '2',
    'Operator': 'user, second shift',
    'Project': '',
    'Description': 'a sweep: 0.1 to 10 Hz',
    'File_Type': '',
    'Time_Pref': 'Relative',
}


@dataclass(frozen=True)
class Variant:
    """What a writer of such files chooses."""

    x: str  # X_Columns
    signs: tuple[str, str]  # between entries, and before decimals
    names: tuple[str, ...]
    segments: tuple[int, ...]  # rows of each
    comment: str | None
    aside: tuple[str, ...]
    end: str
    special: bool
    padded: bool
    samples: bool
    digits: int
    late: float  # X0 of the first segment [s]
    seed: int


def written(path: Path, form: Variant) -> None:
    """Write a file as LabVIEW does."""
    by, decimal = form.signs
    multi = form.x == 'Multi'
    padded = form.padded or multi  # lvm-read counts the columns of such a file by that
    each = 2 if multi else 1
    width = 1 + each * len(form.names) - multi

    def of_channels(key: str, entries: list[str]) -> str:
        line = by.join([key, (by * each).join(entries)])
        return line + by * (width - each * (len(entries) - 1) - 1 if padded else 0)

    entries = {'Writer_Version': '2', **{key: ASIDE[key] for key in form.aside}}
    entries |= {'Separator': WORDS[by], 'Decimal_Separator': decimal}
    entries |= {'X_Columns': form.x, 'Multi_Headings': 'Yes' if form.segments[1:] else 'No'}
    entries |= {'Date': '2024/05/03', 'Time': '10:00:00.123'}
    lines = ['LabVIEW Measurement' + by * padded]
    lines += [f'{key}{by}{value}' for key, value in entries.items()]
    lines += ['***End_of_Header***' + by * padded, by * padded]
    rng = np.random.default_rng(form.seed)
    begin = 0
    for rows in form.segments:
        # Each segment has a clock of its own; its date says by how much it is later.
        clock = f'10:00:{0.123 + begin * PERIOD:013.10f}'
        if form.special:
            lines += ['***Start_Special***', f'Gain{by}7', '***End_Special***']
        every = [''] * len(form.names)
        lines.append(of_channels('Channels', [str(len(form.names))]))
        lines += [of_channels('Samples', [str(rows) for _ in every])] * form.samples
        lines.append(of_channels('Date', ['2024/05/03' for _ in every]))
        lines.append(of_channels('Time', [clock for _ in every]))
        lines.append(of_channels('Y_Unit_Label', [UNITS[name] for name in form.names]))
        lines.append(of_channels('X_Dimension', ['Time' for _ in every]))
        first = f'{form.late:.{form.digits}E}'.replace('.', decimal)
        lines.append(of_channels('X0', [first for _ in every]))
        step = f'{PERIOD:.{form.digits}E}'.replace('.', decimal)
        lines.append(of_channels('Delta_X', [step for _ in every]))
        lines.append('***End_of_Header***' + by * (width if padded else 0))
        heads = [name for one in form.names for name in (('X_Value', one) if multi else (one,))]
        lines.append(by.join([*([] if multi else ['X_Value']), *heads, 'Comment']))
        for i, values in enumerate(30.0 * rng.standard_normal((rows, len(form.names)))):
            time = '' if form.x == 'No' else f'{form.late + i * PERIOD:.6f}'
            told = [f'{value:.{form.digits}f}' for value in values]
            row = [e for one in told for e in ((time, one) if multi else (one,))]
            row = [entry.replace('.', decimal) for entry in ([] if multi else [time]) + row]
            row += [form.comment] if form.comment is not None and i == rows // 2 else []
            lines.append(by.join(row).replace('.', decimal))
        begin += rows
        lines.append('')
    text = form.end.join(lines[:-1]) + form.end
    path.write_text(text, encoding='utf-8', newline='')


def variants() -> st.SearchStrategy[Variant]:
    """Return every choice of the writer."""
    return st.builds(
        Variant,
        st.sampled_from(['No', 'One', 'Multi']),
        st.sampled_from([('\t', '.'), ('\t', ','), (';', ','), (';', '.'), (',', '.')]),
        st.integers(2, 4).map(lambda count: tuple(NAMES[:count])),
        st.lists(st.integers(20, 40), min_size=1, max_size=3).map(tuple),
        st.sampled_from([None, 'touched it']),
        st.lists(st.sampled_from(sorted(ASIDE)), unique=True).map(tuple),
        st.sampled_from(['\n', '\r\n']),
        st.booleans(),
        st.booleans(),
        st.booleans(),
        st.integers(6, 9),
        st.sampled_from([0.0, 0.5]),
        st.integers(0, 2**32 - 1),
    )


@settings(
    max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(form=variants())
def test_every_variant_is_read_as_lvm_read_does(tmp_path: Path, form: Variant) -> None:
    """Names, units, every value and every time, of all segments; nothing is refused."""
    path = tmp_path / 'a.lvm'
    written(path, form)
    theirs = lvm_read.read(str(path), read_from_pickle=False, dump_file=False)
    assert theirs['Segments'] == len(form.segments)
    parts = [theirs[i] for i in range(len(form.segments))]
    heads = parts[0]['Channel names']
    table = np.concatenate([part['data'][:, : len(heads)] for part in parts])
    units = [unit for unit in parts[0]['Y_Unit_Label']][:: 2 if form.x == 'Multi' else 1]
    found = {str(column.name): column for column in look(path).columns}
    channels = [name for name in heads if name not in ('X_Value', 'Comment')]
    assert [name for name in found if name != 'X_Value'] == channels
    for name, unit in zip(channels, units, strict=False):
        np.testing.assert_array_equal(found[name].values, table[:, heads.index(name)])
        assert found[name].unit == unit
    record = read(path)
    for role, name in (('command', 'Command'), ('measured', 'Measured')):
        metres = table[:, heads.index(name)] * MICRO[UNITS[name]]
        np.testing.assert_allclose(getattr(record, role), metres, rtol=1e-15)
    steps = [part['Delta_X'][0] for part in parts]
    assert steps == [PERIOD] * len(parts)
    assert record.period == PERIOD
    if form.x != 'No':
        own = np.concatenate([part['data'][:, 0] for part in parts])
        later = np.repeat(np.cumsum([0, *form.segments[:-1]]) * PERIOD, form.segments)
        np.testing.assert_allclose(found['X_Value'].values, own + later, atol=1e-9)
    assert record.start_ns % 10**10 == round((0.123 + parts[0]['X0'][0]) * 1e9)
