"""Hostile input: whatever bytes, lines and layouts come, nothing raises, hangs or grows."""

import resource
import socket
import struct
import time
from contextlib import closing
from itertools import islice, zip_longest

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from streaming import free_port, layout, listen

from actuator_glue.errors import InputError
from actuator_glue.io.yaml_file import parse
from actuator_glue.streams.layout import PLAIN, TYPES
from actuator_glue.streams.layout_file import parse_layout
from actuator_glue.streams.lines import LONGEST, Lines
from actuator_glue.streams.packed import Packed
from actuator_glue.streams.reception import Reception
from actuator_glue.streams.transports.openfresco import Copy, usual

FRESCO = usual(layout([{'name': n, 'unit': 'm'} for n in ('command', 'measured')]))

yamls = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4)
    ),
    max_leaves=12,
)
entry = st.fixed_dictionaries(
    {},
    optional={
        'name': st.sampled_from(['command', 'measured', 'force', 'time', 'counter', 'x']) | yamls,
        'type': st.sampled_from(sorted(TYPES)) | yamls,
        'unit': st.sampled_from(['m', 'mm', 's', 'kN']) | yamls,
        'scale': st.floats() | yamls,
        'offset': st.floats() | yamls,
        'count': st.integers(-2, 20_000) | yamls,
        'column': st.integers(-2, 20_000) | st.text(max_size=4) | yamls,
    },
)
layouts = st.fixed_dictionaries(
    {'sample': st.lists(entry, max_size=6) | yamls},
    optional={
        'packet': st.lists(entry, max_size=3) | yamls,
        'samples': st.integers(-2, 20_000) | yamls,
        'rate': st.floats() | yamls,
        'byte_order': st.sampled_from(['little', 'big']) | yamls,
        'delimiter': yamls,
        'forward': yamls,
        'stiffness': yamls,
    },
)


def datagrams():
    """Datagrams of the right size with any contents, and of any size."""
    numbers = st.tuples(
        st.integers(0, 2**32 - 1), *[st.floats(allow_nan=True, allow_infinity=True)] * 4
    )
    return st.one_of(
        numbers.map(lambda v: struct.pack('<Idddd', *v)),
        st.binary(min_size=36, max_size=36),
        st.binary(max_size=200),
    )


def swallow(messages):
    """Give datagrams to a listener over the loopback device, and what it finds to a reception."""
    port = free_port()
    reception = Reception(PLAIN, 1000.0)
    with closing(listen(f'udp://127.0.0.1:{port}')) as listener:
        with closing(socket.socket(type=socket.SOCK_DGRAM)) as out:
            for number, message in enumerate(messages):
                out.sendto(message, ('127.0.0.1', port))
                if number % 100 == 99:
                    taken(listener, reception)
            taken(listener, reception)
        counts = listener.counts + reception.counts
    return counts


def taken(listener, reception):
    """What a listener has, handed on; stamps and indices are such as a message can carry."""
    for rows in listener.receive(0.002):
        for samples in reception.push(rows, time.monotonic()):
            assert 0 <= samples.index < 2**62
            assert len(samples.command) == len(samples.measured) > 0


@given(st.lists(datagrams(), max_size=60))
def test_no_datagram_raises(messages):
    counts = swallow(messages)
    assert counts['messages'] + counts['malformed'] >= len(messages)


@given(st.lists(st.binary(max_size=300) | st.text(max_size=80).map(str.encode), max_size=40))
def test_no_line_raises(lines):
    port = free_port(socket.SOCK_STREAM)
    reception = Reception(PLAIN, 1000.0, in_order=True)
    with closing(listen(f'tcp://127.0.0.1:{port}')) as listener:
        with closing(socket.create_connection(('127.0.0.1', port))) as out:
            out.sendall(b'\n'.join(lines) + b'\n')
            for _ in range(5):
                taken(listener, reception)
        assert len(listener._rest) <= LONGEST


@given(
    st.lists(st.binary(max_size=3000), max_size=10),
    st.lists(st.binary(max_size=3000), max_size=10),
)
def test_nothing_on_openfrescos_wire_raises(client, site):
    copy = Copy(FRESCO)
    for one, other in zip_longest(client, site, fillvalue=b''):
        copy.from_client(one)
        copy.from_site(other)
    assert len(copy._asked) <= 65


@given(st.tuples(*[st.integers(-3, 300)] * 11), st.binary(max_size=6000))
def test_no_handshake_of_openfresco_raises(words, data):
    copy = Copy(FRESCO)
    copy.from_client(struct.pack('<11i', *words) + data)
    copy.from_site(data)


@given(layouts | yamls)
def test_no_layout_raises_but_for_its_reason(content):
    try:
        found = parse_layout(content, 'test')
    except InputError as error:
        assert len(str(error)) <= 520
        return
    # What is taken can be used.
    size = Packed(found, found.rate or 1000.0).size
    values = Packed(found, found.rate or 1000.0).decoded(bytes(size))
    found.rows(values, 0, 1000.0)
    if not found.packet and found.samples == 1:
        Lines(found).decoded([b'1,2,3'])


@given(st.text(max_size=300) | layouts.map(lambda c: yaml.dump(c, allow_unicode=True)))
def test_no_yaml_raises_but_for_its_reason(text):
    try:
        parse_layout(parse(text, 'test'), 'test')
    except InputError as error:
        assert str(error)


@pytest.mark.parametrize('text', ['[' * 100_000, '!!python/object/apply:os.system ["true"]'])
def test_yaml_neither_recurses_nor_makes_objects(text):
    with pytest.raises(InputError, match='is not YAML'):
        parse(text, 'test')


def test_yaml_that_multiplies_itself_takes_no_memory():
    """Nine levels of nine aliases: 387 million entries, if anybody wrote them out."""
    levels = ['a0: &a0 [x]'] + [
        f'a{i}: &a{i} [{", ".join([f"*a{i - 1}"] * 9)}]' for i in range(1, 10)
    ]
    with pytest.raises(InputError, match="unknown entry 'a0'"):
        parse_layout(parse('\n'.join(levels), 'test'), 'test')


def noisy(rng):
    """A datagram: mostly of the stream, some wild, some no datagrams at all."""
    number = 0
    while True:
        kind = rng.random()
        number += 1
        if kind < 0.7:
            yield struct.pack('<Idddd', number % 2**32, number * 1e-3, 1.0, 2.0, 3.0)
        elif kind < 0.8:
            yield rng.bytes(36)
        elif kind < 0.9:
            yield rng.bytes(int(rng.integers(0, 100)))
        else:
            number += int(rng.integers(-300, 300))


@pytest.mark.slow
def test_a_hundred_thousand_hostile_datagrams_leave_memory_as_it_is():
    rng = np.random.default_rng(1)
    swallow(islice(noisy(rng), 20_000))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    counts = swallow(islice(noisy(rng), 100_000))
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert counts['messages'] > 50_000 and counts['malformed'] > 5_000
    assert grown < 4_000  # kB


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize(
    ('test', 'examples'),
    [
        (test_no_line_raises, 3000),
        (test_no_datagram_raises, 3000),
        (test_nothing_on_openfrescos_wire_raises, 20_000),
        (test_no_handshake_of_openfresco_raises, 20_000),
        (test_no_layout_raises_but_for_its_reason, 20_000),
        (test_no_yaml_raises_but_for_its_reason, 20_000),
    ],
)
def test_the_same_at_length(test, examples):
    settings(max_examples=examples, deadline=None)(test)()
