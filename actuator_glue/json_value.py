"""What JSON can hold of results: objects of dataclasses, numbers of numpy's, null for NaN."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, TypeAlias

Json: TypeAlias = dict[str, Any]


def json_value(value: Any) -> Any:
    """Return a value JSON can hold.

    A dataclass is the object that its `to_json` gives, or that of its fields; numpy's arrays and
    numbers are lists and numbers; NaN and infinity are null.
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return json_value(value.to_json()) if hasattr(value, 'to_json') else json_fields(value)
    if isinstance(value, dict):
        return {str(k): json_value(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [json_value(v) for v in value]
    if hasattr(value, 'tolist'):
        return json_value(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def json_fields(value: Any) -> Json:
    """Return the JSON object of a dataclass's fields."""
    return {f.name: json_value(getattr(value, f.name)) for f in dataclasses.fields(value)}


class JsonObject:
    """A dataclass whose JSON object has its fields."""

    __slots__ = ()

    def to_json(self) -> Json:
        """Return the JSON object."""
        return json_fields(self)
