"""Settings of the sampler; the defaults serve the paper's problem and the online estimator."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from actuator_glue.errors import InputError
from actuator_glue.inference.moves import MOVES, PUBLISHED
from actuator_glue.inference.moves.move import Move


@dataclass(frozen=True, slots=True)
class SamplerSettings:
    """What the sampler does; see docs/dream.md for the equations behind each number.

    Attributes:
        chains: number of chains N, at least 3.
        moves: the moves, each with its share; `moves.PUBLISHED` are those of Vrugt (2016).
        pairs: largest number delta of archive pairs in a parallel-direction move.
        crossovers: number n_CR of crossover classes; class m moves a share m/n_CR of coordinates.
        unit_jump: probability that a parallel-direction move uses gamma = 1.
        jitter: half width c of the uniform lambda that stretches a jump.
        noise: half width of epsilon, in units of each coordinate's standard deviation.
        thinning: the chains enter the archive every `thinning` steps (K).
        adaptation: steps in which shares, scales and outliers are adapted; all of them are
            burn-in and discarded.
        burn_in: share of the run that is discarded, the adaptation included; more where that is
            longer.
        start: 'annealed' finds the posterior by tempering the likelihood from the prior (or from
            the archive of an earlier run) before the chains start; 'prior' starts the chains at a
            Latin hypercube of the prior as Vrugt (2016) does.
        population: points per temperature while annealing, and of the initial archive (m_0); a
            warm start takes a quarter. None: 50 p^1.5 for p parameters, 200 to 2000.
        steps: steps of each point's chain per temperature.
        survivors: share of the population that the weights of the next temperature may leave.
        parts: of the run; at the end of each, from the fifth on, `enough` is asked (`dream`).
    """

    chains: int = 20
    moves: tuple[Move, ...] = MOVES
    pairs: int = 3
    crossovers: int = 3
    unit_jump: float = 0.2
    jitter: float = 0.05
    noise: float = 1e-6
    thinning: int = 2
    adaptation: int = 60
    burn_in: float = 0.1
    start: Literal['annealed', 'prior'] = 'annealed'
    population: int | None = None
    steps: int = 10
    survivors: float = 0.6
    parts: int = 16

    def __post_init__(self) -> None:
        for name, lowest in (
            ('chains', 3),
            ('pairs', 1),
            ('crossovers', 1),
            ('thinning', 1),
            ('adaptation', 0),
            ('steps', 1),
            ('parts', 1),
        ):
            if getattr(self, name) < lowest:
                raise InputError(f'sampler setting {name}={getattr(self, name)} is below {lowest}')
        for name in ('unit_jump', 'jitter'):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise InputError(f'sampler setting {name}={getattr(self, name)} is outside [0, 1]')
        if not 0.0 <= self.burn_in < 1.0:
            raise InputError(f'sampler setting burn_in={self.burn_in} is outside [0, 1)')
        if not 0.0 < self.survivors < 1.0:
            raise InputError(f'sampler setting survivors={self.survivors} is outside (0, 1)')
        fixed = [move.share for move in self.moves if move.share is not None]
        if not all(0.0 < share <= 1.0 for share in fixed) or sum(fixed) > 1.0:
            raise InputError(f'fixed shares {fixed} of the moves are no probabilities')
        if not self.moves or (len(fixed) == len(self.moves) and sum(fixed) < 1.0):
            raise InputError('the moves share less than 1; leave one of them without a share')
        if not self.noise > 0.0:
            raise InputError('sampler setting noise must be positive')
        if self.population is not None and self.population < 2 * self.steps:
            raise InputError(
                f'sampler setting population={self.population} leaves fewer than two chains of '
                f'{self.steps} steps'
            )
        if self.start not in ('annealed', 'prior'):
            raise InputError(f"sampler setting start={self.start!r}; use 'annealed' or 'prior'")

    @staticmethod
    def published() -> SamplerSettings:
        """DREAM(ZS) as Vrugt (2016) runs it: three chains from the prior, his moves alone.

        Half of the run is burn-in.
        """
        return SamplerSettings(chains=3, moves=PUBLISHED, start='prior', burn_in=0.5)

    def points(self, dimension: int) -> int:
        """Size of the population for so many parameters; never too few for their covariance."""
        if self.population is not None:
            return max(self.population, 10 * dimension)
        # Grows faster than p: what keeps two modes' shares steady is points per stage, of which
        # there are more in more dimensions (2 of 60 runs lost a mode in ten with 100 p points).
        return max(200, 10 * dimension, min(int(50 * math.sqrt(dimension) * dimension), 2000))
