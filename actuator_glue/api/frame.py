"""Numbers of a result as a table of pandas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from actuator_glue.errors import InputError

if TYPE_CHECKING:
    from pandas import DataFrame


def frame(content: Sequence[Mapping[str, Any]] | Mapping[str, Any], index: str) -> DataFrame:
    """Return rows or columns as a table.

    Args:
        content: columns by name, or rows, each with its values by column; columns that a row
            lacks are empty in it.
        index: the column by which rows are called.

    Raises:
        InputError: pandas is not installed; the message says what to install.
    """
    try:
        import pandas
    except ImportError as error:
        raise InputError(
            "a table needs pandas; install it with `pip install 'actuator_glue[lab]'`"
        ) from error
    return pandas.DataFrame(content).set_index(index)
