"""What the outcomes say: reliability of P(unstable), coverage of the response bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.hybrid.trial import Outcome

EDGES = (0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
FALSE_ALARM = 0.05  # that a right prediction is refused by any bin of the diagram
COVERAGE = (0.92, 0.98)  # of 95 % bands, on average


@dataclass(frozen=True, slots=True)
class Bin:
    """Actuators whose predicted P(unstable) lies between two numbers.

    Attributes:
        lower, upper: the two numbers; the upper one belongs to the last bin only.
        count: how many.
        predicted: mean prediction.
        unstable: how many were unstable.
        least, most: numbers of unstable ones between which it lies where the predictions hold,
            but for FALSE_ALARM over the number of bins.
    """

    lower: float
    upper: float
    count: int
    predicted: float
    unstable: int
    least: int
    most: int

    @property
    def met(self) -> bool:
        """Whether as many were unstable as the predictions allow."""
        return self.least <= self.unstable <= self.most


@dataclass(frozen=True, slots=True)
class Findings:
    """What is concluded.

    Attributes:
        bins: of the reliability diagram, empty ones left out.
        reliable: whether every bin is within its limits.
        brier: mean squared error of P(unstable).
        banded: actuators with a test that did not diverge.
        coverage: mean share of their responses, with all specimens, inside the 95 % bands.
        coverage_error: its standard error over actuators.
        covered: whether it lies within COVERAGE.
        worst: smallest such share.
    """

    bins: tuple[Bin, ...]
    reliable: bool
    brier: float
    banded: int
    coverage: float
    coverage_error: float
    covered: bool
    worst: float

    def text(self) -> str:
        """Return everything in a few lines."""
        count = len(self.bins)
        lines = [
            f'P(unstable) is {"" if self.reliable else "NOT "}reliable: '
            f'{sum(b.met for b in self.bins)} of {count} bins within their limits '
            f'({100 * (1 - FALSE_ALARM / max(count, 1)):.1f} % each, so that all are in '
            f'{100 * (1 - FALSE_ALARM):.0f} % of such studies)'
        ]
        lines += [
            f'  predicted {b.lower:g} to {b.upper:g}: {b.unstable} of {b.count} unstable, mean '
            f'prediction {b.predicted:.3f}, limits {b.least} to {b.most}'
            f'{"" if b.met else ": NOT met"}'
            for b in self.bins
        ]
        lines.append(f'Brier score {self.brier:.4f}')
        low, high = COVERAGE
        lines.append(
            f'95 % bands hold {100 * self.coverage:.1f} +- {100 * self.coverage_error:.1f} % of '
            f'the responses of {self.banded} actuators, at worst {100 * self.worst:.1f} %: '
            f'{"within" if self.covered else "NOT within"} {100 * low:.0f} to {100 * high:.0f} %'
        )
        return '\n'.join(lines)

    def table(self) -> str:
        """Return the same for a page, in Markdown."""
        lines = [
            '| predicted P(unstable) | actuators | mean prediction | unstable | limits | |',
            '|---|---|---|---|---|---|',
        ]
        lines += [
            f'| {b.lower:g} to {b.upper:g} | {b.count} | {b.predicted:.3f} | {b.unstable} | '
            f'{b.least} to {b.most} | {"met" if b.met else "**not met**"} |'
            for b in self.bins
        ]
        first, *_, last = self.text().split('\n')
        actuators = sum(b.count for b in self.bins)
        told = [f'**{actuators} actuators.** {first}.', '', *lines, '', f'{last}.']
        return '\n'.join([*told, f'Brier score {self.brier:.4f}.', ''])


def findings(outcomes: Sequence[Outcome]) -> Findings:
    """Return what outcomes say."""
    predicted = np.array([o.predicted for o in outcomes])
    unstable = np.array([o.unstable for o in outcomes])
    # A share of n draws: its mean under Jeffreys' prior, so that none of 300 is not "never".
    worth = np.array([o.effective for o in outcomes])
    expected = (predicted * worth + 0.5) / (worth + 1.0)
    which = np.clip(np.searchsorted(EDGES, predicted, side='right') - 1, 0, len(EDGES) - 2)
    used = np.unique(which)
    bins = []
    for i in used:
        chosen = which == i
        least, most = limits(expected[chosen], FALSE_ALARM / len(used))
        bins.append(
            Bin(
                EDGES[i],
                EDGES[i + 1],
                int(chosen.sum()),
                float(expected[chosen].mean()),
                int(unstable[chosen].sum()),
                least,
                most,
            )
        )
    held = np.array([o.inside for o in outcomes if o.inside is not None])
    coverage = float(held.mean()) if held.size else float('nan')
    scatter = float(held.std(ddof=1) / np.sqrt(held.size)) if held.size > 1 else float('nan')
    return Findings(
        tuple(bins),
        all(b.met for b in bins),
        float(np.mean((expected - unstable) ** 2)),
        int(held.size),
        coverage,
        scatter,
        bool(COVERAGE[0] <= coverage <= COVERAGE[1]),
        float(held.min()) if held.size else float('nan'),
    )


def limits(probabilities: np.ndarray, level: float) -> tuple[int, int]:
    """Return between which counts the number of events lies but for a probability of `level`.

    Events of different probabilities, (n,): their number has the Poisson binomial distribution.
    """
    chances = np.ones(1)
    for p in probabilities:
        chances = np.convolve(chances, (1.0 - p, p))
    below, above = np.cumsum(chances), np.cumsum(chances[::-1])[::-1]
    kept = np.flatnonzero((below > 0.5 * level) & (above > 0.5 * level))
    return int(kept[0]), int(kept[-1])
