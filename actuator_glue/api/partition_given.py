"""A hybrid test as callers give it: itself, as a file, or by the name of one that comes along."""

from __future__ import annotations

from os import PathLike, fspath

from actuator_glue.given import of_kind
from actuator_glue.hybrid.partition import Partition
from actuator_glue.io.partition import read_partition


def partition_given(given: Partition | PathLike[str] | str) -> Partition:
    """Return a partition that was given itself, as its YAML file or by its name.

    Raises:
        InputError: something else was given, or a file that cannot be used.
    """
    if isinstance(given, Partition):
        return given
    of_kind(given, 'partition', (str, PathLike), 'a Partition, its YAML file, or its name')
    return read_partition(fspath(given))
