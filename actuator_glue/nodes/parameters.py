"""Node parameters: declared with description, unit and range, checked all at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from actuator_glue.errors import InputError


@dataclass(frozen=True, slots=True)
class Spec:
    """One parameter of a node.

    Attributes:
        name: its name.
        default: value where nothing is given; its type is the parameter's.
        meaning: one line for people.
        unit: SI unit, '1' or empty where there is none.
        lower: smallest value of a number.
        upper: largest value of a number.
        read_only: given at the start only, because other things are built on it.
        choices: the words allowed.
        secret: taken and then hidden: neither `get` nor /parameter_events shows it.
    """

    name: str
    default: bool | int | float | str | list[float] | list[str]
    meaning: str
    unit: str = ''
    lower: float | None = None
    upper: float | None = None
    read_only: bool = False
    choices: tuple[str, ...] = ()
    secret: bool = False

    def descriptor(self) -> ParameterDescriptor:
        """Return what `ros2 param describe` and rqt_reconfigure show."""
        unit = f' [{self.unit}]' if self.unit else ''
        words = f'; one of: {", ".join(self.choices)}' if self.choices else ''
        found = ParameterDescriptor(
            description=f'{self.meaning}{unit}{words}',
            read_only=self.read_only,
            additional_constraints=words.removeprefix('; '),
        )
        if self.lower is not None and self.upper is not None:
            if isinstance(self.default, int):
                found.integer_range = [
                    IntegerRange(from_value=int(self.lower), to_value=int(self.upper), step=0)
                ]
            elif isinstance(self.default, float):
                found.floating_point_range = [
                    FloatingPointRange(from_value=self.lower, to_value=self.upper, step=0.0)
                ]
        return found


class Parameters:
    """The declared parameters of one node.

    Args:
        node: the node.
        specs: its parameters.
        check: called with all values as they would become; raises InputError to refuse them.
        changed: called with the names that were changed at run time.

    Raises:
        InputError: a value given at the start has the wrong type or is out of range.
    """

    HIDDEN = '(hidden)'

    def __init__(
        self,
        node: Node,
        specs: Sequence[Spec],
        check: Callable[[Mapping[str, Any]], None],
        changed: Callable[[set[str]], None],
    ) -> None:
        self._node = node
        self._specs = {spec.name: spec for spec in specs}
        self._check = check
        self._secrets: dict[str, Any] = {}
        self._offered: dict[str, Any] = {}
        for spec in specs:
            self._declare(spec)
        self._check_all(self.values())
        node.add_pre_set_parameters_callback(self._hide)
        node.add_on_set_parameters_callback(self._validate)
        node.add_post_set_parameters_callback(
            lambda given: changed({p.name for p in given if p.name in self._specs})
        )

    def __getitem__(self, name: str) -> Any:
        if name in self._secrets:
            return self._secrets[name]
        value = self._node.get_parameter_or(name).value
        # To ROS an empty list has no type: what was given as one is not set.
        return list(value or ()) if isinstance(self._specs[name].default, list) else value

    def values(self) -> dict[str, Any]:
        """Return all values by name."""
        return {name: self[name] for name in self._specs}

    def _declare(self, spec: Spec) -> None:
        hidden = spec.secret
        if hidden:
            given = self._node._parameter_overrides.get(spec.name)
            self._secrets[spec.name] = spec.default if given is None else given.value
        try:
            self._node.declare_parameter(
                spec.name, spec.default, spec.descriptor(), ignore_override=hidden
            )
        except (InvalidParameterTypeException, InvalidParameterValueException) as error:
            given = self._node._parameter_overrides.get(spec.name)
            value, kind = None if given is None else given.value, type(spec.default)
            whole = kind is float and type(value) is int
            hint = f'write {value}.0, as ROS takes a number without a point for another type; '
            raise InputError(
                f'parameter {spec.name} = {value!r} cannot be used: {hint if whole else ""}'
                f'{spec.descriptor().description}, of type {kind.__name__} ({error})'
            ) from error

    def _check_all(self, values: Mapping[str, Any]) -> None:
        for name, value in values.items():
            spec = self._specs[name]
            if value is None or (spec.secret and not isinstance(value, type(spec.default))):
                raise InputError(
                    f'parameter {name} = {[] if value is None else value!r} cannot be used: '
                    f'{spec.descriptor().description}, of type {type(spec.default).__name__}'
                )
            choices = spec.choices
            if choices and value not in choices:
                raise InputError(f'{name} = {value!r} is not one of {", ".join(choices)}')
        self._check(values)

    def _hide(self, given: list[Parameter]) -> list[Parameter]:
        """Take secrets out of what is about to be set, stored and told to everybody."""
        self._offered.clear()
        shown = []
        for parameter in given:
            spec = self._specs.get(parameter.name)
            if spec is not None and spec.secret and isinstance(parameter.value, str):
                if parameter.value != self.HIDDEN:
                    self._offered[parameter.name] = parameter.value
                parameter = Parameter(parameter.name, Parameter.Type.STRING, self.HIDDEN)
            shown.append(parameter)
        return shown

    def _validate(self, given: list[Parameter]) -> SetParametersResult:
        new = {p.name: p.value for p in given if p.name in self._specs}
        new = {name: value for name, value in new.items() if not self._specs[name].secret}
        offered, self._offered = self._offered, {}
        try:
            self._check_all(self.values() | new | offered)
        except InputError as error:
            return SetParametersResult(successful=False, reason=str(error))
        self._secrets |= offered
        return SetParametersResult(successful=True)
