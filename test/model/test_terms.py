"""Effects written as expressions: what is refused, and that they solve their equations."""

from __future__ import annotations

import pickle
from collections.abc import Iterator

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.model.commands import sweep
from actuator_glue.model.effects import CATALOGUE, scale
from actuator_glue.model.effects.terms.definition import entries, mapping
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.effects.terms.expression import read
from actuator_glue.model.parameters import TABLE_2, Parameter
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

U = sweep(256.0, duration=3.0, f0=0.0, f1=10.0, amplitude=2e-3)
K = 250e3
GOOD = {'bounds': [0, 1], 'neutral': 0}


def one(lower: float, upper: float, neutral: float = 0.0) -> tuple[Parameter, ...]:
    """Return the one parameter `own`."""
    return (Parameter('own', '1', lower, upper, 'its size', neutral),)


@pytest.fixture(autouse=True)
def _catalogue_as_it_was() -> Iterator[None]:
    yield
    for effect in CATALOGUE.registered():
        CATALOGUE.unregister(effect.name)


def simulated(equation: str, size: float, neutral: float = 0.0, **options: object) -> np.ndarray:
    """Return the response with a registered effect of this size."""
    low, high = min(2.0 * size, neutral), max(2.0 * size, neutral + 1e-9)
    CATALOGUE.register(term('own-effect', equation, one(low, high, neutral)), replace=True)
    record = Record(U, U, 1 / 256.0, K)
    return Structure(('own-effect',)).simulate([*TABLE_2, size], record, **options)


# An effect of the catalogue as an expression, and how far both schemes may be apart [m].
SAME = [
    ('valve: e = dead(e, own)', 'valve-deadband', 30e-6, 0.0, 1e-14),
    ('valve: e = e + own', 'valve-null', 5e-5, 0.0, 1e-14),
    ('flow: q = q*(1 + own*sign(q))', 'flow-asymmetry', 0.1, 0.0, 1e-14),
    ('flow: q = q*sqrt(max(1 - sign(q)*f*own, 0))', 'pressure-flow', 1e-3, 0.0, 1e-14),
    ('flow: q = clip(q, -own*alpha_2, own*alpha_2)', 'flow-saturation', 0.04, 2.0, 1e-14),
    ('flow: q = q*max(1 + own*t, 0)', 'gain-drift', 0.02, 0.0, 1e-14),
    ('command: u = own*u', 'gain', 1.03, 1.0, 2e-8),
    ('specimen: f = f + k*own*x**3', 'specimen-hardening', 8e4, 0.0, 2e-9),
    ('force: f = f + own*v', 'viscous-damping', 800.0, 0.0, 2e-7),
    ('sensor: y = x + own', 'bias', 1e-4, 0.0, 1e-18),
]


@pytest.mark.parametrize(('equation', 'name', 'size', 'neutral', 'apart'), SAME)
def test_an_expression_is_the_compiled_effect(
    equation: str, name: str, size: float, neutral: float, apart: float
) -> None:
    """What the catalogue computes with a stage of its own, written as an expression."""
    own = simulated(equation, size, neutral)
    record = Record(U, U, 1 / 256.0, K)
    expected = Structure((name,)).simulate([*TABLE_2, size], record)
    plain = Structure(()).simulate(TABLE_2, record)
    assert np.abs(expected - plain).max() > 5e-6, 'the case must show the effect'
    assert np.abs(own - expected).max() < apart
    assert np.abs(simulated(equation, neutral, neutral) - plain).max() < 1e-13


def test_neutral_is_eq_2_although_the_expression_has_no_value_there() -> None:
    """tanh(a e)/a at a = 0 is no number; the effect is off there all the same."""
    CATALOGUE.register(term('soft-valve', 'valve: e = tanh(own*e)/own', one(0.0, 1e4)))
    record, structure = Record(U, U, 1 / 256.0, K), Structure(('soft-valve',))
    theta = structure.neutral(np.repeat([TABLE_2], 3, axis=0))
    theta[1, 4] = 2000.0
    y = structure.simulate(theta, record)
    plain = Structure(()).simulate(TABLE_2, record)
    assert np.abs(y[[0, 2]] - plain).max() < 1e-13
    assert np.abs(y[1] - plain).max() > 1e-5


@pytest.mark.parametrize(
    ('equation', 'why'),
    [
        ('valve e = 2*e', 'place'),
        ('pump: e = 2*e', 'place'),
        ('valve: q = 2*q', 'e = ...'),
        ('valve: e = e + ', 'invalid syntax'),
        ('valve: e = e + own*w', "column 20: 'w' is not known at the valve"),
        ('sensor: y = y + own*v', "'v' is not known at the sensor"),
        ('valve: e = e.real', 'only numbers'),
        ('valve: e = __import__("os")', 'no function'),
        ('valve: e = (lambda: e)()', 'only numbers'),
        ('valve: e = e if own else u', 'only numbers'),
        ('valve: e = e^2', 'only + - * /'),
        ('valve: e = e**x', 'exponent'),
        ('valve: e = sinh(e)', "no function 'sinh'"),
        ('valve: e = min(e)', 'min takes 2'),
        ('valve: e = lag(e, x)', 'second argument of lag'),
        ('force: f = f + rate(x, own)', 'rate remembers'),
        ('valve: e = e + own*rate(e)', 'rate takes 2'),
        ('command: u = u + own*lowpass(u, 5, x)', 'third argument of lowpass'),
        ('command: u = u + own*bandpass(u, 5, 1.2)', 'below 1, not 1.2'),
        ('command: u = u + own*bandpass(u, 0, 0.2)', 'above 0 Hz'),
        ('command: u = u + own*' + 'rate(' * 50 + 'u' + ', 1)' * 50, 'more than 4 filters'),
        ('sensor: y = y + own*rate(y, 0.01)', 'rate remembers'),
        ('valve: e = e + True', 'no number'),
        ('valve: e = e + 1' + '0' * 400, 'too large'),
        ('valve: e = ' + '(' * 500 + 'e' + ')' * 500, 'column'),
        ('valve: e = ' + '-' * 1500 + 'e', 'nested'),
        ('valve: e = e + own*1' + ' ' * 2000, 'characters'),
    ],
)
def test_what_is_no_expression_is_refused(equation: str, why: str) -> None:
    """One error that says what and where."""
    with pytest.raises(InputError) as error:
        read(equation, ('own',))
    assert why in str(error.value)


@pytest.mark.parametrize(
    ('name', 'parameters', 'why'),
    [
        ('Own', one(0, 1), 'small letters'),
        ('own', (), 'needs a parameter'),
        ('own', one(0, 1, 2.0), 'hold the neutral value'),
        ('own', one(1, 1, 1.0), 'not below'),
        ('own', one(0.5, 1, 1.0), 'still there'),
        ('own', one(0, 1) * 2, 'one name'),
        ('own', (Parameter('x', '1', 0, 1, '', 0.0),), 'meaning of its own'),
    ],
)
def test_what_is_no_effect_is_refused(
    name: str, parameters: tuple[Parameter, ...], why: str
) -> None:
    """Names, bounds, and an effect that does not vanish at its neutral value."""
    with pytest.raises(InputError, match=why):
        term(name, 'valve: e = e + e*own' if parameters else 'valve: e = 2*e', parameters)


def test_names_are_unique() -> None:
    """Neither an effect nor a parameter is defined twice; the catalogue stays."""
    CATALOGUE.register(term('own-effect', 'valve: e = e + own', one(0, 1e-3)))
    CATALOGUE.register(term('own-effect', 'valve: e = e + own', one(0, 1e-3)))
    for name, words in (('own-effect', 'is there already'), ('other', 'belongs to own-effect')):
        with pytest.raises(InputError, match=words):
            CATALOGUE.register(term(name, 'valve: e = e - own', one(0, 1e-3)))
    delay = (Parameter('delay', 's', 0.0, 1.0, '', 0.0),)
    with pytest.raises(InputError, match='belongs to delay'):
        CATALOGUE.register(term('other', 'command: u = lag(u, delay)', delay))
    with pytest.raises(InputError, match='is there already'):
        CATALOGUE.register(term('gain', 'command: u = u + own', one(0, 1)), replace=True)
    with pytest.raises(InputError, match='not one that was registered'):
        CATALOGUE.unregister('gain')
    with pytest.raises(InputError, match='is not in the catalogue'):
        Structure(('own-efect',))


def test_definitions_come_back() -> None:
    """As a mapping, as files and messages hold it, and through a pipe."""
    made = term('own-effect', 'valve: e = e + own*integral(e)', one(0.0, 20.0), group='integral')
    assert entries(mapping([made])) == (made,)
    again = pickle.loads(pickle.dumps(made))
    assert again == made
    size = scale([Record(U, U, 1 / 256.0, K)], TABLE_2)
    assert again.starts(size) == made.starts(size)


@pytest.mark.parametrize(
    ('content', 'why'),
    [
        ([], 'no effects'),
        ({'a': 3}, 'needs a place'),
        ({'a': {'valve': 'e = e', 'sensor': 'y = y', 'parameters': {}}}, 'one place'),
        ({'a': {'valve': 'e = e + b', 'parametres': {}}}, "'parametres' is unknown"),
        ({'a': {'valve': 'e = e + b'}}, 'needs `parameters:`'),
        ({'a': {'valve': 'e = e + b', 'parameters': {'b': {'neutral': 0}}}}, 'bounds'),
        (
            {
                'a': {
                    'valve': 'e = e',
                    'parameters': {'b': {'bounds': [0, 1], 'neutral': 0, 'u': 1}},
                }
            },
            "'u' is unknown",
        ),
        (
            {'a': {'valve': 'e = e', 'parameters': {'b': {**GOOD, 'bounds': [0, 'x']}}}},
            'are numbers',
        ),
    ],
)
def test_definitions_are_checked(content: object, why: str) -> None:
    """Misspelt words are not passed over."""
    with pytest.raises(InputError, match=why):
        entries(content, 'own.yaml')


def test_typical_sizes_show_and_are_inside() -> None:
    """What a fit starts from changes the signal by a hundredth to a quarter."""
    made = CATALOGUE.register(term('own-effect', 'sensor: y = y + own*y**3', one(-1e5, 1e5)))
    record = Record(U, U, 1 / 256.0, K)
    sizes = np.array(made.starts(scale([record], TABLE_2)))[:, 0]
    assert len(sizes) >= 4 and (np.abs(sizes) <= 1e5).all() and sizes.min() < 0.0 < sizes.max()
    plain = Structure(()).simulate(TABLE_2, record)
    shown = simulated('sensor: y = y + own*y**3', float(np.abs(sizes).min())) - plain
    assert 0.003 < np.std(shown) / np.std(plain) < 0.1


@pytest.mark.parametrize(
    'equation',
    [
        'valve: e = e + own*integral(e)',
        'command: u = lag(u, own)',
        'force: f = f + own*tanh(v/1e-2)',
    ],
)
def test_blocks_and_neighbours_change_nothing(equation: str) -> None:
    """Bit for bit: a stream cut anywhere, a parameter set among others."""
    own = simulated(equation, 0.01)
    structure = Structure(('own-effect',))
    theta = np.array([*TABLE_2, 0.01])
    many = np.repeat([theta], 40, axis=0)
    many[1::2, 4] = 0.003
    record = Record(U, U, 1 / 256.0, K)
    assert np.array_equal(structure.simulate(many, record)[[0, 38]], [own, own])
    stream = Stream(structure, theta, stiffness=K, period=1 / 256.0)
    parts = [stream.step(part)[0] for part in np.split(U, [1, 2, 100, 101, 400])]
    assert np.array_equal(np.concatenate(parts), own)


def test_a_rate_is_what_a_lag_has_not_followed() -> None:
    """As much of it taken away as its time is the lag."""
    rate = simulated('command: u = u + own*rate(u, 0.02)', 0.01)
    assert np.array_equal(rate, simulated('command: u = u + own*((u - lag(u, 0.02))/0.02)', 0.01))
    late = simulated('command: u = u - own*rate(u, 0.02)', 0.02)
    assert np.abs(late - simulated('command: u = lag(u, own)', 0.02)).max() < 1e-12


@pytest.mark.parametrize('change', ['own*tanh(v/1e-2)', '0.1*own'])
def test_a_proportional_specimen_is_one_that_hardens_by_nothing(change: str) -> None:
    """The balance of forces with a force is native code there, and compiled here."""
    equation = f'force: f = f + {change}'
    own = simulated(equation, 1000.0)
    record = Record(U, U, 1 / 256.0, K)
    plain = Structure(()).simulate(TABLE_2, record)
    general = Structure(('own-effect', 'specimen-hardening'))
    y = general.simulate([*TABLE_2, 1000.0, 1e-9], record)
    assert np.abs(own - plain).max() > 1e-6, 'the case must show the effect'
    assert np.abs(own - y).max() < 1e-14


@pytest.mark.parametrize('place', ['command: u', 'valve: e', 'flow: q', 'force: f', 'sensor: y'])
def test_two_at_one_place_follow_one_another(place: str) -> None:
    """The second takes what the first has made: two gains are their product."""
    signal = place[-1]
    both = simulated(f'{place} = {signal}*(1 + own)*(1 - own)', 0.02)
    size = (Parameter('other', '1', 0.0, 1.0, '', 0.0),)
    CATALOGUE.register(term('other-effect', f'{place} = {signal}*(1 - other)', size))
    CATALOGUE.register(
        term('own-effect', f'{place} = {signal}*(1 + own)', one(0, 1)), replace=True
    )
    record, structure = Record(U, U, 1 / 256.0, K), Structure(('own-effect', 'other-effect'))
    two = structure.simulate([*TABLE_2, 0.02, 0.02], record)
    assert np.abs(two - both).max() < 1e-15
    alone = structure.simulate([*TABLE_2, 0.0, 0.02], record)
    assert np.abs(two - alone).max() > 1e-6


def test_time_counts_from_the_start_of_the_test() -> None:
    """In a window as in the whole record."""
    late = simulated('flow: q = q*max(1 + own*t, 0)', 0.02, origin=5.0)
    gain = simulated('flow: q = q*max(1 + own*(t + 5), 0)', 0.02)
    assert np.abs(late - gain).max() < 1e-15
