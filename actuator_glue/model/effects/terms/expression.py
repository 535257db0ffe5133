"""The text of an effect, `place: symbol = expression`, read into a tree; nothing is executed."""

from __future__ import annotations

import ast
import math
from dataclasses import dataclass
from typing import Final, Literal, NoReturn, TypeAlias, get_args

from actuator_glue.errors import InputError
from actuator_glue.model.effects.terms.filters import FILTERS
from actuator_glue.model.effects.terms.tree import Tree
from actuator_glue.model.parameters import NAMES as BASE

Place: TypeAlias = Literal['command', 'valve', 'flow', 'piston', 'specimen', 'sensor']


# What a place changes, and what else is known there: u command, e control error, q flow (as rate
# of force), f force, x displacement and v velocity of the piston, t time. At the sensor x is y.
SIGNAL: Final = {
    'command': 'u',
    'valve': 'e',
    'flow': 'q',
    'specimen': 'f',
    'piston': 'f',
    'sensor': 'y',
}
KNOWN: Final = {
    'command': 'uqfxvt',
    'valve': 'euqfxvt',
    'flow': 'qeufxvt',
    'specimen': 'fxvqeut',
    'piston': 'fxvqeut',
    'sensor': 'yxt',
}
PLACES: Final[dict[str, Place]] = {**{p: p for p in get_args(Place)}, 'force': 'piston'}
# Constant during a test; not at the sensor, where a record is all there is.
CONSTANTS: Final = (*BASE, 'k')
# Functions and how many arguments they take.
FUNCTIONS: Final = dict.fromkeys(
    ['abs', 'sign', 'sqrt', 'exp', 'log', 'sin', 'cos', 'tanh', 'atan'], 1
) | {
    'min': 2,
    'max': 2,
    'clip': 3,
    'dead': 2,
}
# Functions that remember; all arguments but the first hold during a test. A force is one of the
# step's end, sought by Newton's steps: what is carried over must not depend on how many.
MEMORY: Final = {'lag': 2, 'integral': 1, 'play': 2, 'limit_rate': 2}
REMEMBERING: Final = ('command', 'valve', 'flow')
FORCES: Final = ('specimen', 'piston')
_OF_FORCES: Final = ('play', 'lag')
_REMEMBER: Final = MEMORY | {name: count for name, (count, _) in FILTERS.items()}
_LONGEST: Final = 2000
# Each has its argument five times: one of another, and so on, would fill the memory.
_FILTERS: Final = 4
_WHICH: Final = ('second', 'third')
_OPERATORS: Final[dict[type[ast.operator], str]] = {
    ast.Add: 'add',
    ast.Sub: 'sub',
    ast.Mult: 'mul',
    ast.Div: 'div',
    ast.Pow: 'pow',
}


@dataclass(frozen=True, slots=True)
class Expression:
    """What an effect does to the signal of its place.

    Attributes:
        place: where it acts.
        tree: the signal after it.
        exact: with neutral parameters that is the signal before it, to the bit. Where it is not,
            the program sees to it.
    """

    place: Place
    tree: Tree
    exact: bool = False


def reserved() -> frozenset[str]:
    """Return the words that cannot be a parameter's name."""
    return frozenset({*'uqefxvty', 'pi', *CONSTANTS, *FUNCTIONS, *_REMEMBER})


def read(text: str, parameters: tuple[str, ...]) -> Expression:
    """Return the expression of `place: symbol = expression`.

    Raises:
        InputError: something that is no expression of what is known there; says the column.
    """
    named, colon, equation = (part.strip() for part in text.partition(':'))
    if not colon or named not in PLACES:
        raise InputError(
            f'{text!r} does not begin with a place and a colon; places: {", ".join(PLACES)}'
        )
    place = PLACES[named]
    symbol, sign, right = equation.partition('=')
    signal = SIGNAL[place]
    if not sign or symbol.strip() != signal:
        raise InputError(f'{text!r}: at the {place} an equation has the form {signal} = ...')
    return Expression(place, _Reader(text, right, place, parameters).tree())


class _Reader:
    def __init__(self, text: str, right: str, place: str, parameters: tuple[str, ...]) -> None:
        self._text, self._right, self._place = text, right.strip(), place
        self._parameters = parameters
        self._offset = len(text.rstrip()) - len(self._right)
        self._filters = 0

    def tree(self) -> Tree:
        if len(self._text) > _LONGEST:
            raise InputError(f'the equation has more than {_LONGEST} characters')
        try:
            return self._node(ast.parse(self._right, mode='eval').body)
        except SyntaxError as error:
            self._refuse(max((error.offset or 1) - 1, 0), error.msg)
        except (RecursionError, MemoryError):
            self._refuse(0, 'nested too deeply')

    def _refuse(self, column: int, why: str) -> NoReturn:
        at = self._offset + column
        raise InputError(f'{self._text!r}, column {at + 1}: {why}') from None

    def _node(self, node: ast.expr) -> Tree:
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return self._number(node, node.value)
        if isinstance(node, ast.Name):
            return self._name(node)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            inner = self._node(node.operand)
            return inner if isinstance(node.op, ast.UAdd) else Tree('neg', (inner,))
        if isinstance(node, ast.BinOp):
            name = _OPERATORS.get(type(node.op))
            if name is None:
                self._refuse(node.col_offset, 'only + - * / and ** (power) combine two values')
            left, right = self._node(node.left), self._node(node.right)
            if name == 'pow' and self._changes(right):
                self._refuse(node.right.col_offset, 'an exponent must not change during a test')
            return Tree(name, (left, right))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            return self._call(node, node.func.id)
        self._refuse(node.col_offset, 'only numbers, names, + - * / ** and functions are allowed')

    def _number(self, node: ast.expr, value: float) -> Tree:
        try:
            number = math.nan if isinstance(value, bool) else float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            self._refuse(node.col_offset, 'no number, or one too large')
        return Tree('number', value=number)

    def _name(self, node: ast.Name) -> Tree:
        name, place = node.id, self._place
        if name == 'pi':
            return Tree('number', value=math.pi)
        constants = () if place == 'sensor' else CONSTANTS
        known = KNOWN[place]
        if name in self._parameters or name in constants:
            return Tree('symbol', name=name)
        if len(name) == 1 and name in known:
            shown = 'y' if place == 'sensor' and name == 'x' else name
            return Tree('symbol', name=shown)
        words = ', '.join((*known, *self._parameters, *constants))
        self._refuse(
            node.col_offset, f'{name!r} is not known at the {self._place}; known: {words}'
        )

    def _call(self, node: ast.Call, name: str) -> Tree:
        count = FUNCTIONS.get(name, _REMEMBER.get(name))
        if count is None:
            words = ', '.join((*FUNCTIONS, *_REMEMBER))
            self._refuse(node.col_offset, f'no function {name!r}; there are {words}')
        if len(node.args) != count:
            self._refuse(node.col_offset, f'{name} takes {count} argument{"s" * (count > 1)}')
        places = (*REMEMBERING, *(FORCES if name in _OF_FORCES else ()))
        if name in _REMEMBER and self._place not in places:
            self._refuse(
                node.col_offset, f'{name} remembers: it can act at {", ".join(places)} only'
            )
        if name in FILTERS:
            self._filters += 1
            if self._filters > _FILTERS:
                self._refuse(node.col_offset, f'more than {_FILTERS} filters')
        arguments = tuple(self._node(a) for a in node.args)
        if name in _REMEMBER:
            for which, argument, where in zip(_WHICH, arguments[1:], node.args[1:], strict=False):
                if self._changes(argument):
                    self._refuse(
                        where.col_offset, f'the {which} argument of {name} holds during a test'
                    )
        if name not in FILTERS:
            return Tree(name, arguments)
        try:
            return FILTERS[name][1](*arguments)
        except ValueError as error:
            self._refuse(node.col_offset, f'{name}: {error}')

    def _changes(self, tree: Tree) -> bool:
        """Whether a value depends on what moves."""
        return not tree.words().isdisjoint('uqefxvty')
