"""Addresses, who may send, and keys."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from streaming import terms

from actuator_glue.errors import InputError
from actuator_glue.streams.address import Address, Allowed, parse_address
from actuator_glue.streams.reception import Reception
from actuator_glue.streams.seal import Seal, read_key
from actuator_glue.streams.transports import source, transports

SCHEMES = ('udp', 'tcp', 'lsl', 'openfresco')


def test_every_scheme_has_its_transport():
    assert set(transports()) == set(SCHEMES)


@pytest.mark.parametrize(
    ('text', 'found'),
    [
        ('udp://127.0.0.1:5005', Address('udp', '127.0.0.1', 5005)),
        ('tcp://[::1]:80', Address('tcp', '::1', 80)),
        ('openfresco://localhost:8090', Address('openfresco', 'localhost', 8090)),
        ('lsl:servo 1', Address('lsl', name='servo 1')),
    ],
)
def test_an_address_is_read_and_written(text, found):
    assert parse_address(text, SCHEMES) == found
    assert str(found) == text


@pytest.mark.parametrize(
    'text',
    [
        '',
        'udp',
        'udp:',
        'udp://',
        'udp://h',
        'udp://h:',
        'udp://h:0',
        'udp://h:99999',
        'udp://:5',
        'udp://h:٣',
        'http://h:1',
        'lsl:',
        "lsl:a' or 'b",
        'tcp://a b:1',
        'udp:h:1',
    ],
)
def test_what_is_no_address_is_told(text):
    with pytest.raises(InputError):
        parse_address(text, SCHEMES)


@given(st.text(max_size=60))
def test_no_text_breaks_the_reading_of_addresses(text):
    for given_text in (text, f'udp://{text}', f'lsl:{text}'):
        try:
            parse_address(given_text, SCHEMES)
        except InputError as error:
            assert str(error)


def test_only_this_machine_may_send_unless_others_are_named():
    alone, some = Allowed(), Allowed(['192.168.7.0/24', '10.0.0.5'])
    assert '127.0.0.1' in alone and '::1' in alone and '::ffff:127.0.0.1' in alone
    assert '192.168.7.9' not in alone
    assert '192.168.7.9' in some and '10.0.0.5' in some and '::ffff:10.0.0.5' in some
    assert '10.0.0.6' not in some and '127.0.0.1' not in some
    with pytest.raises(InputError, match='allow'):
        Allowed(['speedgoat'])


@pytest.mark.parametrize('scheme', ['udp', 'tcp', 'openfresco'])
def test_beyond_this_machine_senders_must_be_named(scheme):
    transport, address = source(f'{scheme}://0.0.0.0:5005')
    with pytest.raises(InputError, match='say which may send'):
        transport.listen(address, terms())


def test_a_key_is_long_enough_and_nobody_elses(tmp_path):
    path = tmp_path / 'key'
    path.write_text('0123456789abcdef0123\n')
    path.chmod(0o644)
    with pytest.raises(InputError, match='chmod 600'):
        read_key(path)
    path.chmod(0o600)
    assert read_key(path).sign(b'x') == Seal(b'0123456789abcdef0123').sign(b'x')
    path.write_text('short')
    with pytest.raises(InputError, match='16 to 4096 bytes'):
        read_key(path)
    with pytest.raises(InputError, match='cannot be read'):
        read_key(tmp_path / 'none')


@given(message=st.binary(max_size=100), other=st.binary(max_size=100))
def test_what_is_not_signed_by_the_key_is_not_opened(message, other):
    seal, thief = Seal(b'k' * 20), Seal(b'l' * 20)
    assert seal.opened(message + seal.sign(message)) == message
    assert seal.opened(message + thief.sign(message)) is None
    assert seal.opened(other) is None
    line = message.hex().encode()
    assert seal.opened_line(line + b' ' + seal.sign(line).hex().encode()) == line
    assert seal.opened_line(other) is None


def test_signed_messages_need_a_counter():
    """Else a recorded one could be sent again."""
    from streaming import layout

    bare = layout([{'name': n, 'unit': 'm'} for n in ('command', 'measured')])
    with pytest.raises(InputError, match='add a counter'):
        Reception(bare, 1000.0, signed=True)
