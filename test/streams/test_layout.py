"""Layouts: what a file may say, and that packets carry what was put in."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from streaming import layout

from actuator_glue.errors import InputError
from actuator_glue.streams.layout import PLAIN, TYPES
from actuator_glue.streams.layout_file import parse_layout, read_layout
from actuator_glue.streams.lines import Lines
from actuator_glue.streams.packed import Packed

ROOT = Path(__file__).resolve().parents[2]
BOTH = [{'name': 'command', 'unit': 'mm'}, {'name': 'measured', 'unit': 'mm'}]


@pytest.mark.parametrize('path', sorted(ROOT.glob('config/layouts/*.yaml')), ids=lambda p: p.name)
def test_shipped_layouts_can_be_used(path):
    found = read_layout(path)
    assert found.rate and (found.forward or 'counter' in found.fields)
    assert Packed(found, found.rate).size > 0


@pytest.mark.parametrize(
    ('content', 'told'),
    [
        (None, 'must be a mapping'),
        ({}, 'sample is missing'),
        ({'sample': 3}, 'list of at most'),
        ({'sample': [3]}, r'sample\[0\] must be a mapping'),
        ({'sample': BOTH[:1]}, 'no field called measured'),
        ({'sample': [*BOTH, BOTH[0]]}, 'two fields are called command'),
        ({'sample': [{'name': 'command'}, BOTH[1]]}, 'has no unit'),
        ({'sample': [{'name': 'command', 'unit': 'furlong'}, BOTH[1]]}, "unit 'furlong'"),
        ({'sample': [{**BOTH[0], 'type': 'f64'}, BOTH[1]]}, 'use one of float64'),
        ({'sample': [{**BOTH[0], 'type': ['f64']}, BOTH[1]]}, 'use one of float64'),
        ({'sample': [{**BOTH[0], 'scale': 0}, BOTH[1]]}, 'scale is 0'),
        ({'sample': [{**BOTH[0], 'count': 2}, BOTH[1]]}, 'command is one value'),
        ({'sample': BOTH, 'byteorder': 'big'}, 'did you mean byte_order'),
        ({'sample': BOTH, 'byte_order': 'middle'}, 'use one of little, big'),
        ({'sample': BOTH, 'rate': 1e9}, 'outside'),
        ({'sample': BOTH, 'samples': 0}, 'at least 1'),
        ({'sample': BOTH, 'samples': 5000}, 'larger than UDP carries'),
        ({'sample': BOTH, 'packet': [BOTH[0]]}, 'two fields are called command'),
        ({'sample': [{'name': 'x', 'count': 10_001}, *BOTH]}, 'at least 1'),
        ({'sample': BOTH, 'stiffness': -1}, 'stiffness'),
    ],
)
def test_what_cannot_be_is_refused_with_a_reason(content, told):
    with pytest.raises(InputError, match=told):
        parse_layout(content, 'test')


def test_a_packet_as_a_controller_packs_it():
    """Big-endian: counter per packet, two samples of int16 volts after four bytes of padding."""
    volts = {'type': 'int16', 'unit': 'mm', 'scale': 0.01}
    found = layout(
        [{'name': 'command', **volts}, {'name': 'measured', **volts, 'offset': 1.0}],
        packet=[
            {'name': 'counter', 'type': 'uint16'},
            {'name': 'spare', 'type': 'uint8', 'count': 4},
        ],
        samples=2,
        byte_order='big',
        rate=1000,
    )
    data = struct.pack('>H4xhhhh', 65_535, 100, -200, 300, -400)
    data += struct.pack('>H4xhhhh', 0, 1, 2, 3, 4)
    packed = Packed(found, 1000.0)
    assert packed.size == 14
    rows, bad = found.rows(packed.decoded(data), 0)
    assert not bad and found.modulus == 131_072
    assert rows.counter.tolist() == [131_070, 131_071, 0, 1]
    assert np.allclose(rows.command, [1e-3, 3e-3, 1e-5, 3e-5])
    assert np.allclose(rows.measured, [-1e-3, -3e-3, 1.02e-3, 1.04e-3])


@given(
    kinds=st.tuples(*[st.sampled_from(sorted(TYPES))] * 3),
    order=st.sampled_from(['little', 'big']),
    many=st.integers(1, 5),
    head=st.booleans(),
    counts=st.sampled_from(['packets', 'samples']),
)
def test_what_is_packed_is_what_is_unpacked(kinds, order, many, head, counts):
    counter = {'name': 'counter', 'type': kinds[2]}
    values = [
        {'name': 'command', 'type': kinds[0], 'unit': 'mm'},
        {'name': 'measured', 'type': kinds[1], 'unit': 'mm', 'scale': 0.5},
    ]
    found = layout(
        values if head else [*values, counter],
        packet=[counter] if head else [],
        samples=many,
        byte_order=order,
        counts=counts,
    )
    whole = np.arange(3 * many) % 60
    sent = {'counter': whole * 1.0, 'command': 1e-3 * whole, 'measured': 0.5e-3 * whole}
    packed = Packed(found, 1000.0)
    packets = packed.encoded(sent)
    assert len(packets) == 3 and all(len(p) == packed.size for p in packets)
    rows, bad = found.rows(packed.decoded(b''.join(packets)), 0)
    assert not bad
    assert np.allclose(rows.command, sent['command'], atol=1e-9)
    assert np.allclose(rows.measured, sent['measured'], atol=1e-9)
    assert rows.counter.tolist() == whole.tolist()


def test_a_counter_that_is_no_number_is_left_out_and_told():
    found = layout([{'name': 'counter'}, *BOTH])
    table = np.array([[0.0, 1, 1], [np.nan, 2, 2], [1e300, 3, 3], [np.inf, 4, 4], [1.0, 5, 5]])
    rows, bad = found.rows(Packed(found, 1.0).decoded(table.tobytes()), 0)
    assert bad == 3 and rows.counter.tolist() == [0, 1]
    assert np.allclose(rows.command, [1e-3, 5e-3])


def test_lines_by_place_and_by_name():
    by_place = Lines(layout(BOTH, delimiter=';'))
    values, bad = by_place.decoded([b'1.5;2.5\r', b'x;y', b'3', b'4;5;6', b'\xff;1'])
    assert bad == 3 and values['command'].tolist() == [1.5, 4.0]
    named = [{**BOTH[0], 'column': 'u'}, {**BOTH[1], 'column': 'x'}]
    by_name = Lines(layout(named, header=True))
    values, bad = by_name.decoded([b'x,t,u', b'1,2,3'])
    assert not bad and values['command'].tolist() == [3.0] and values['measured'].tolist() == [1.0]
    by_name.begin()
    assert by_name.decoded([b'a,b,c', b'1,2,3'])[1] == 2


def test_lines_have_no_packets():
    """A layout of datagrams for lines: refused before the stream begins, not at its first line."""
    for packets in ({'packet': [{'name': 'counter'}]}, {'samples': 10}):
        with pytest.raises(InputError, match='a line holds one sample'):
            Lines(layout(BOTH, **packets))


def test_lines_bring_back_every_bit():
    lines = Lines(PLAIN)
    rng = np.random.default_rng(1)
    sent = {name: rng.standard_normal(50) for name in ('time', 'command', 'measured', 'force')}
    sent['counter'] = np.arange(50.0)
    values, bad = lines.decoded(lines.encoded(sent))
    assert not bad
    assert all(np.array_equal(values[name], sent[name]) for name in sent)
