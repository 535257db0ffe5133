"""What the true structure, refitted, leaves on the held-out record: the aim of a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from case import Case

from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import Scorer, splits_of
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record


def floor(case: Case) -> float:
    """Rms of the noise that was added to the held-out record [m]."""
    return float(np.sqrt(np.mean((case.measured[2] - case.clean[2]) ** 2)))


def refitted(case: Case, records: Sequence[Record]) -> float:
    """Held-out rms error of the true structure, refitted to the sweeps [m]; NaN if not ours."""
    names = [n for n in case.effects if n in CATALOGUE]
    if case.kind == 'unknown':
        return float('nan')
    fit, held = Data.whole(records[:2]), Data.whole(records[2:])
    refits = Refits(fit, CATALOGUE.searched())
    refits.scorer = Scorer.of(fit, splits_of(fit, refits.base().error))
    trial = refits.trial(())
    for name in names:
        if CATALOGUE[name].variance is None and name != 'hum':
            trial = refits.polish(refits.add(trial, name))
    error = held.target - held.simulate(Structure(trial.effects), trial.fit.theta)[0]
    return float(np.sqrt(np.mean(error**2)))
