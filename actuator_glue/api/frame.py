"""Numbers of a result as a table of pandas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from actuator_glue.errors import InputError

if TYPE_CHECKING:
    from pandas import DataFrame


def frame(rows: Sequence[Mapping[str, Any]], index: str) -> DataFrame:
    """Return rows as a table.

    Args:
        rows: values by column; columns that a row lacks are empty in it.
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
    return pandas.DataFrame(rows).set_index(index)
