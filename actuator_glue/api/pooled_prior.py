"""What all earlier tests of an actuator say of its next one, as a file that `--prior` takes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from actuator_glue.api import store
from actuator_glue.api.calibration_data import as_prior
from actuator_glue.inference.carried import Carried
from actuator_glue.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class PooledPrior:
    """Draws of what the next test will find; scatter of days and drift until then are in them.

    Attributes:
        names: the parameters, (p,).
        draws: shape (m, p), SI units.
        source: what it was made from.
    """

    schema: ClassVar[str] = 'actuator_glue.prior/1'

    names: tuple[str, ...]
    draws: Array
    source: str

    def save(self, path: Path | str) -> Path:
        """Write it to one .npz file and return its path.

        Raises:
            InputError: the file cannot be written.
        """
        return store.save(path, self.schema, self)

    def carried(self) -> Carried:
        """Return the draws as a prior."""
        return as_prior(self.names, self.draws)
