"""Numbers of a result as a table of pandas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from actuator_glue.optional_library import library

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
    pandas = library('pandas', 'a table needs pandas', 'lab')
    table: DataFrame = pandas.DataFrame(content).set_index(index)
    return table
