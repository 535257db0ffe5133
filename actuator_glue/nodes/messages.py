"""Field dictionaries to ROS messages."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from typing import Any

import numpy as np

from actuator_glue.online.conversion import Head


def fill(message: Any, head: Head, fields: Mapping[str, Any]) -> Any:
    """Return a message with its header and fields set; real numbers that are not given are NaN.

    A message begins with zeros, which would be read as known.
    """
    seconds, nanoseconds = divmod(head.stamp_ns, 1_000_000_000)
    message.header.stamp.sec = int(seconds)
    message.header.stamp.nanosec = int(nanoseconds)
    message.header.frame_id = head.frame_id
    for name, kind in message.get_fields_and_field_types().items():
        if kind == 'double' and name not in fields:
            setattr(message, name, float('nan'))
    for name, value in fields.items():
        if isinstance(value, np.ndarray) and value.dtype == np.float64:
            # An array is taken as it is; a list would be checked number by number.
            value = array('d', value.tobytes())
        setattr(message, name, value)
    return message


def publish(publisher: Any, head: Head, fields: Mapping[str, Any]) -> None:
    """Publish a message of the publisher's type."""
    publisher.publish(fill(publisher.msg_type(), head, fields))
