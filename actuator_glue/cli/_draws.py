"""Posterior draws of a calibration: read back, and drawn."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from actuator_glue.cli._output import say
from actuator_glue.cli._parser import claim
from actuator_glue.errors import InputError
from actuator_glue.records import Array, Record, source_name

if TYPE_CHECKING:
    from actuator_glue.model.exact import Initial

ENSEMBLE = 200  # draws that are simulated for a band
LEVEL = 0.95


@dataclass(frozen=True, slots=True, eq=False)
class Draws:
    """What `calibrate --draws` saves.

    Attributes:
        values: posterior draws, shape (m, p), SI units.
        best: draw of the highest likelihood, shape (p,).
        names: parameter of each column.
        units: their units.
        effects: effects the model has beyond Eq. (2).
        initial: state at a record's first sample, 'rest' or 'measured'.
        source: the file.
    """

    values: Array
    best: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    effects: tuple[str, ...]
    initial: str
    source: str

    @staticmethod
    def read(path: Path) -> Draws:
        """Return the draws of a file; registers the effects that it defines.

        Raises:
            InputError: it cannot be read, or is no file of draws.
        """
        import json
        import zipfile

        import numpy as np

        from actuator_glue.model.effects import CATALOGUE
        from actuator_glue.model.effects.terms.definition import entries

        try:
            with np.load(path, allow_pickle=False) as file:
                if 'definitions' in file and (own := json.loads(str(file['definitions']))):
                    for effect in entries(own, str(path)):
                        CATALOGUE.register(effect, replace=True)
                return Draws(
                    np.asarray(file['draws'], dtype=np.float64),
                    np.asarray(file['best'], dtype=np.float64),
                    tuple(map(str, file['names'])),
                    tuple(map(str, file['units'])),
                    tuple(map(str, file['effects'])),
                    str(file['initial']),
                    str(path),
                )
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise InputError(
                f'{path}: no draws as `calibrate --draws` saves them ({error})'
            ) from error

    def draw(self, folder: Path, args: argparse.Namespace) -> None:
        """Draw every parameter and every pair."""
        from actuator_glue.report import style
        from actuator_glue.report.posterior import posterior_figure

        path = claim(folder / f'{Path(self.source).stem}.{args.format}', args)
        style.save(posterior_figure(self.values, self.names, self.units), path)
        say(f'{path}: {len(self.values)} draws of {self.source}', args)

    def draw_bands(self, record: Record, path: Path, args: argparse.Namespace) -> None:
        """Draw the parameter band and the total predictive band over a record.

        Raises:
            InputError: the draws are of another model, or the stiffness is not known.
        """
        import numpy as np

        from actuator_glue.inference.bands import band
        from actuator_glue.inference.predictive import fit_residual, total_band
        from actuator_glue.model.structure import Structure
        from actuator_glue.report import style
        from actuator_glue.report.timeseries import band_at_zooms, even_zooms

        structure = Structure(self.effects)
        count = len(structure.names)
        if self.names[:count] != structure.names:
            raise InputError(f'{self.source}: draws of another model, {", ".join(self.names)}')
        chosen = np.linspace(0, len(self.values) - 1, min(ENSEMBLE, len(self.values)))
        theta = self.values[chosen.astype(np.intp), :count]
        initial: Initial = 'rest' if self.initial == 'rest' else 'measured'
        simulated = structure.simulate(theta, record, initial=initial)
        best = structure.simulate(self.best[:count], record, initial=initial)
        residual = fit_residual(record.measured - best, parameters=count)
        total = total_band(np.random.default_rng(0), simulated, residual, (LEVEL,))
        inside = (record.measured >= total.lower[0]) & (record.measured <= total.upper[0])
        limits = band(simulated, (LEVEL,))
        title = source_name(record.source)
        figure = band_at_zooms(
            record, limits, even_zooms(record), level=LEVEL, total=total, title=title
        )
        style.save(figure, path)
        say(
            f'{path}: {100 * LEVEL:.0f} % bands; the total one holds '
            f'{100 * float(inside.mean()):.1f} % of the samples it was made from',
            args,
        )
