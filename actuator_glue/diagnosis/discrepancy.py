"""What may be there below what matters: a discrepancy of the catalogue's own shapes.

An effect too small to be added still pulls the parameters: 20 N of friction are immaterial in the
error and many standard deviations in alpha_3. So the likelihood of a posterior holds, beside
noise, responses to every effect that was not added, each of a random size. Their common scale, from
nothing to what would have been material, is unknown and integrated (Kennedy & O'Hagan
2001; its shapes are physics instead of a smooth process). All sizes act linearly and are
marginalised in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.diagnosis.score import Scorer
from actuator_glue.diagnosis.search import Search
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

# Scales tried, of the largest: the first, no discrepancy, is as likely as all the others.
_SCALES = np.concatenate([[0.0], 2.0 ** -np.arange(6.0, -1.0, -1.0)])
_SAME = 1e-10  # of the largest power: shapes that others hold


@dataclass(frozen=True)
class Discrepancy:
    """Normal discrepancies of whitened errors, of several scales.

    Attributes:
        shapes: orthogonal whitened shapes of unit length (s, N).
        powers: their variance at the largest scale (s,), of whitened noise.
    """

    shapes: Array
    powers: Array

    @classmethod
    def of(cls, search: Search, effects: tuple[str, ...], scorer: Scorer, size: float) -> Discrepancy:
        """Take the responses to all effects that a structure lacks.

        Args:
            search: what was tried, and the fit of Eq. (2) to which an effect is added.
            effects: those of the structure.
            scorer: the noise.
            size: rms of each response at the largest scale [m].
        """
        base, rows = search.base_theta, []
        for name in search.names:
            if name in effects:
                continue
            alone = Structure((name,))
            thetas = alone.starts(base, search.scale())
            smallest = thetas[np.argsort(np.abs(thetas[:, len(base)]), kind='stable')[:1]]
            seen = search.data.simulate(alone, smallest) - search.data.simulate(Structure(()), base)
            ...
        return cls.from_rows(np.array(rows))
