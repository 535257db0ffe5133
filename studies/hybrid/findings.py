"""What the outcomes say: reliability of P(unstable), coverage of the response bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.hybrid import library
from studies.hybrid.trial import Outcome

EDGES = (0.0, 0.05, 0.5, 0.95, 1.0)


@dataclass(frozen=True, slots=True)
class Bin:
    """Actuators whose predicted P(unstable) lies between two numbers.

    Attributes:
        lower, upper: the two numbers; the upper one belongs to the last bin only.
        count: how many.
        predicted: mean prediction.
        unstable: how many were unstable.
        least, most: 95 % interval of the share that was (Clopper and Pearson).
    """

    lower: float
    upper: float
    count: int
    predicted: float
    unstable: int
    least: float
    most: float

    @property
    def met(self) -> bool:
        """Whether the mean prediction lies within the interval."""
        return self.least <= self.predicted <= self.most


@dataclass(frozen=True, slots=True)
class Findings:
    """What is concluded.

    Attributes:
        bins: of the reliability diagram, empty ones left out.
        brier: mean squared error of P(unstable).
        coverage: mean share of the responses inside their 95 % bands.
        worst: smallest such share.
    """

    bins: tuple[Bin, ...]
    brier: float
    coverage: float
    worst: float

    def text(self) -> str:
        """Return everything in a few lines."""
        lines = [
            f'predicted {b.lower:g} to {b.upper:g}: {b.unstable} of {b.count} unstable, '
            f'{b.predicted:.3f} predicted, interval {b.least:.3f} to {b.most:.3f}'
            f'{"" if b.met else ": NOT met"}'
            for b in self.bins
        ]
        lines.append(f'Brier score {self.brier:.4f}')
        lines.append(
            f'95 % bands hold {100 * self.coverage:.1f} % of the responses, at worst '
            f'{100 * self.worst:.1f} %'
        )
        return '\n'.join(lines)


def findings(outcomes: Sequence[Outcome]) -> Findings:
    """Return what outcomes say."""
    predicted = np.array([o.predicted for o in outcomes])
    unstable = np.array([o.unstable for o in outcomes])
    which = np.clip(np.searchsorted(EDGES, predicted, side='right') - 1, 0, len(EDGES) - 2)
    bins = []
    for i in range(len(EDGES) - 1):
        inside = which == i
        if inside.any():
            share = library.share(unstable[inside], float(inside.sum()))
            bins.append(
                Bin(
                    EDGES[i],
                    EDGES[i + 1],
                    int(inside.sum()),
                    float(predicted[inside].mean()),
                    int(unstable[inside].sum()),
                    share.lower,
                    share.upper,
                )
            )
    held = np.array([o.inside for o in outcomes])
    return Findings(
        tuple(bins),
        float(np.mean((predicted - unstable) ** 2)),
        float(held.mean()),
        float(held.min()),
    )
