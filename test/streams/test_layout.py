"""Layouts: what a file may say, and that packets carry what was put in."""

import struct
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from streaming import layout, record

from actuator_glue.errors import InputError
from actuator_glue.streams.layout import PLAIN, TYPES
from actuator_glue.streams.layout_file import parse_layout, read_layout
from actuator_glue.streams.lines import Lines
from actuator_glue.streams.packed import Packed
from actuator_glue.streams.play import check
from actuator_glue.streams.reception import Reception

ROOT = Path(__file__).resolve().parents[2]
TURNING = [{'name': 'command', 'unit': 'rad'}, {'name': 'measured', 'unit': 'deg'}]
BOTH = [{'name': 'command', 'unit': 'mm'}, {'name': 'measured', 'unit': 'mm'}]


@pytest.mark.parametrize('path', sorted(ROOT.glob('config/layouts/*.yaml')), ids=lambda p: p.name)
def test_shipped_layouts_can_be_used(path):
    found = read_layout(path)
    assert found.rate and (found.forward or 'counter' in found.fields)
    assert Packed(found, found.rate).size > 0


@pytest.mark.parametrize('name', ['speedgoat.yaml', 'speedgoat'])
def test_a_shipped_layout_is_found_by_its_name(name, tmp_path, monkeypatch):
    """Wherever a node is started; a file of the working folder is meant first."""
    monkeypatch.chdir(tmp_path)
    assert read_layout(name).fields == read_layout(ROOT / 'config/layouts/speedgoat.yaml').fields
    Path(name).write_text((ROOT / 'config/layouts/labview_tcp.yaml').read_text())
    assert read_layout(name).actuator == 'labview'


@pytest.mark.parametrize('name', ['speedgoat.txt', 'nowhere/speedgoat.yaml', 'speedgot'])
def test_what_is_no_shipped_layout_is_said_with_those_that_are(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r'No such file.*dspace, labview_tcp, openfresco, speed'):
        read_layout(name)


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
        ({'sample': [{'name': 'counter', 'scale': 0.1}, *BOTH]}, 'counts as it is sent'),
        ({'sample': BOTH, 'byteorder': 'big'}, 'did you mean byte_order'),
        ({'sample': BOTH, 'byte_order': 'middle'}, 'use one of little, big'),
        ({'sample': BOTH, 'rate': 1e9}, 'outside'),
        ({'sample': BOTH, 'samples': 0}, 'at least 1'),
        ({'sample': BOTH, 'samples': 5000}, 'larger than UDP carries'),
        ({'sample': BOTH, 'packet': [BOTH[0]]}, 'two fields are called command'),
        ({'sample': [{'name': 'x', 'count': 10_001}, *BOTH]}, 'at least 1'),
        ({'sample': BOTH, 'stiffness': -1}, 'stiffness'),
        ({'sample': [{'name': 'command', 'unit': 'deg'}, BOTH[1]]}, 'command has unit .deg.'),
        (
            {'sample': [{**BOTH[0], 'column': 'x'}, {**BOTH[1], 'column': 'x'}]},
            'command and measured are both column x',
        ),
        (
            {'sample': [{**BOTH[0], 'column': 2}, BOTH[1]]},
            'command and measured are both column 2',
        ),
        ({'sample': TURNING, 'stiffness': 1e5}, 'the motion is in deg: give 0'),
    ],
)
def test_what_cannot_be_is_refused_with_a_reason(content, told):
    with pytest.raises(InputError, match=told):
        parse_layout(content, 'test')


def test_a_stream_of_angles_says_so():
    """One degree stands as 1e-3 m; a record of metres is not sent as angles, nor the reverse."""
    found = layout(TURNING)
    assert found.motion == 'deg' and PLAIN.motion == 'm'
    rows, _ = found.rows({'command': np.array([np.pi]), 'measured': np.array([90.0])}, 0, 1e3)
    np.testing.assert_allclose([rows.command[0], rows.measured[0]], [0.18, 0.09])
    turned = replace(record(), stiffness=0.0, motion='deg')
    check(turned, found)
    check(replace(turned, period=turned.period * (1.0 + 1e-5)), found)
    with pytest.raises(InputError, match='is in deg, and a packet without a layout carries m'):
        check(turned, PLAIN)
    with pytest.raises(InputError, match='is in m, and test carries deg'):
        check(record(), found)


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
    rows, left_out = found.rows(packed.decoded(data), 0, 1000.0)
    assert not left_out.total() and found.modulus == 131_072
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
    rows, left_out = found.rows(packed.decoded(b''.join(packets)), 0, 1000.0)
    assert not left_out.total()
    assert np.allclose(rows.command, sent['command'], atol=1e-9)
    assert np.allclose(rows.measured, sent['measured'], atol=1e-9)
    assert rows.counter.tolist() == whole.tolist()


@pytest.mark.parametrize(
    ('kind', 'most', 'fits'),
    [
        ('int16', 32.767, True),
        ('int16', 32.768, False),
        ('int16', -32.768, True),
        ('uint16', -0.001, False),
        ('uint16', -0.0004, True),
        ('float32', 1e3, True),
    ],
)
def test_a_value_that_its_type_cannot_hold_is_not_sent_as_another(kind, most, fits):
    """It wrapped, as a counter does: a displacement jumped from one end to the other."""
    its = layout([BOTH[0], {**BOTH[1], 'type': kind, 'scale': 1e-3}])
    sent = {'command': np.zeros(2), 'measured': np.array([0.0, 1e-3 * most])}
    packed = Packed(its, 1000.0)
    if fits:
        values = packed.decoded(b''.join(packed.encoded(sent)))
        assert abs(its.fields['measured'].si(values['measured'])[1] - 1e-3 * most) < 6e-7
    else:
        with pytest.raises(InputError, match=f'measured is sent as .*no {kind} holds'):
            packed.encoded(sent)


def test_a_counter_that_is_no_number_is_left_out_and_told():
    found = layout([{'name': 'counter'}, *BOTH])
    table = np.array([[0.0, 1, 1], [np.nan, 2, 2], [1e300, 3, 3], [np.inf, 4, 4], [1.0, 5, 5]])
    rows, left_out = found.rows(Packed(found, 1.0).decoded(table.tobytes()), 0, 1.0)
    assert left_out == Counter(malformed=3) and rows.counter.tolist() == [0, 1]
    assert np.allclose(rows.command, [1e-3, 5e-3])


NUMBERED = [{**BOTH[0], 'column': 2}, {**BOTH[1], 'column': 4}]
NAMED = [{**BOTH[0], 'column': 'u'}, {**BOTH[1], 'column': 'x'}]


def test_lines_by_place_and_by_name():
    by_place = Lines(layout(BOTH, delimiter=';'))
    values, bad = by_place.decoded([b'1.5;2.5\r', b'x;y', b'3', b'4;5;', b'\xff;1', b'1_0;2'])
    assert bad == 4 and values['command'].tolist() == [1.5, 4.0]
    named = [{**BOTH[0], 'column': 'u'}, {**BOTH[1], 'column': 'x'}]
    by_name = Lines(layout(named, header=True))
    values, bad = by_name.decoded([b'x,t,u', b'1,2,3'])
    assert not bad and values['command'].tolist() == [3.0] and values['measured'].tolist() == [1.0]
    by_name.begin()
    assert by_name.decoded([b'a,b,c', b'1,2,3'])[1] == 2


@pytest.mark.parametrize('names', [b'x,t,u', b'\xef\xbb\xbfx,t,u', b'"x", "t", "u"'])
def test_columns_that_are_named_anew_have_their_new_order(names):
    """A program that is started again behind a relay: the connection stays, columns may differ."""
    lines = Lines(layout(NAMED, header=True))
    values, bad = lines.decoded([names, b'1,2,3', b'u,x', b'3,1', b'u,x', b'u,t', b'3,1'])
    assert values['command'].tolist() == [3.0] * 3 and values['measured'].tolist() == [1.0] * 3
    assert bad == 1 and 'u,t' in lines.odd
    assert lines.decoded([b'u,x,1', b'3,1'])[1] == 1


def test_a_name_of_two_columns_is_told():
    lines = Lines(layout(NAMED, header=True))
    assert lines.decoded([b'x,u,x'])[1] == 1 and 'column x is there twice' in lines.odd
    # Of those that nobody asks for any may be there twice.
    values, bad = lines.decoded([b'x,,u,,', b'1,0,2,0,'])
    assert not bad and values['command'].tolist() == [2.0]


@pytest.mark.parametrize(
    ('one', 'two', 'more'),
    [
        (2, 1, []),
        (4, 2, []),
        ('u', 'x', []),
        ('u', 1, []),
        (3, 'x', [{'name': 'spare', 'count': 3}]),
        ('u', None, [{'name': 'spare', 'count': 2}]),
        (None, 7, []),
        (None, None, [{'name': 'spare', 'count': 2}]),
    ],
)
def test_what_is_sent_is_found_in_its_column(one, two, more):
    """Columns went by the order of the layout: read by it, command and measured were exchanged."""
    its = [{**BOTH[0], 'column': one}, *more, {**BOTH[1], 'column': two}]
    lines = Lines(layout(its, header=one == 'u' or two == 'x'))
    sent = {'command': np.array([1e-3, 2e-3]), 'measured': np.array([3e-3, 4e-3])}
    if lines._places is None:
        assert lines.decoded([lines.head()])[1] == 0
    values, bad = lines.decoded(lines.encoded(sent))
    assert not bad
    assert values['command'].tolist() == [1.0, 2.0]
    assert values['measured'].tolist() == [3.0, 4.0]


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


@pytest.mark.parametrize(
    ('its', 'width', 'first'),
    [
        (layout(BOTH, delimiter=','), 2, []),
        (layout([BOTH[0], {'name': 'spare', 'count': 2}, BOTH[1]]), 4, []),
        (layout(NUMBERED), 4, [b'0,1,0,2']),
        (layout(NAMED, header=True), 3, [b't,u,x']),
    ],
    ids=['by place', 'some stepped over', 'by number', 'by name'],
)
@pytest.mark.parametrize('other', [1, -1, 3])
def test_a_line_with_another_number_of_entries_is_no_sample(its, width, first, other):
    """A decimal comma or one column more would put a value in another's place."""
    lines = Lines(its)
    lines.decoded(first)
    good = b','.join(b'1.5' for _ in range(width))
    odd = b','.join(b'9' for _ in range(width + other))
    values, bad = lines.decoded([good, odd, good, odd])
    assert bad == 2
    assert values['command'].tolist() == [1.5, 1.5] == values['measured'].tolist()


def test_decimal_commas_between_commas_are_refused():
    """`17,1,2340,1,2290`: five entries where three are told of."""
    its = layout([{'name': 'counter', 'type': 'uint32'}, *BOTH])
    values, bad = Lines(its).decoded([b'17,1,2340,1,2290', b'18,1.2340,1.2290'])
    assert bad == 1 and values['command'].tolist() == [1.2340]


@pytest.mark.parametrize(
    ('text', 'good'),
    [(b'16777217', True), (b'1.5e1', True), (b'1.67772E+07', False), (b'1e+06', False)],
)
def test_a_counter_printed_with_too_few_digits_counts_nothing(text, good):
    """`%g` prints every number from 16777150 to 16777249 alike: none of them is a repeated one."""
    its = layout([{'name': 'counter'}, *BOTH])
    values, bad = Lines(its).decoded([text + b',1,1'])
    assert bad == (not good) and len(values['command']) == good


@pytest.mark.parametrize('order', ['little', 'big'])
@pytest.mark.parametrize('where', ['sample', 'packet'])
def test_a_float32_counts_as_far_as_it_can(order, where):
    """Beyond 2^24 it gives two samples one number: they are told as what they are."""
    counter = {'name': 'counter', 'type': 'float32'}
    its = (
        layout([counter, *BOTH], byte_order=order)
        if where == 'sample'
        else layout(BOTH, packet=[counter], byte_order=order)
    )
    numbers = np.arange(2**24 - 3, 2**24 + 3)
    packed = Packed(its, 1000.0)
    sent = {'counter': numbers.astype(float), 'command': np.arange(6.0), 'measured': np.zeros(6)}
    rows, left_out = its.rows(packed.decoded(b''.join(packed.encoded(sent))), 0, 1000.0)
    assert left_out == Counter(coarse=3, malformed=0)
    assert rows.counter.tolist() == numbers[:3].tolist()
    assert rows.command.tolist() == [0.0, 1.0, 2.0]
    assert (
        'a float32, which tells samples apart for 4.66 h' in Reception(its, 1e3).warnings(None)[0]
    )


def test_a_float32_time_tells_the_order_as_long_as_it_can():
    """At 5 h its steps are 2 ms long: at 1 kHz two samples have one time."""
    its = layout([{'name': 'time', 'type': 'float32', 'unit': 's'}, *BOTH])
    time = np.array([8000.0, 16000.0, 18000.0])
    packed = Packed(its, 1000.0)
    sent = {'time': time, 'command': np.arange(3.0), 'measured': np.zeros(3)}
    data = packed.decoded(b''.join(packed.encoded(sent)))
    rows, left_out = its.rows(data, 0, 1000.0)
    assert left_out['coarse'] == 2 and rows.time.tolist() == [8000.0]
    rows, left_out = its.rows(data, 0, 100.0)
    assert not left_out.total() and rows.time.tolist() == time.tolist()
