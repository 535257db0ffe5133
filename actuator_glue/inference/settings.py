"""Settings of the sampler; the defaults serve the paper's problem and the online estimator."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from actuator_glue.errors import InputError


@dataclass(frozen=True, slots=True)
class Settings:
    """What the sampler does; see docs/dream.md for the equations behind each number.

    Attributes:
        chains: number of chains N, at least 3.
        pairs: largest number delta of archive pairs in a parallel-direction move.
        crossovers: number n_CR of crossover classes; class m moves a share m/n_CR of coordinates.
        snooker: probability of a snooker move.
        unit_jump: probability that a parallel-direction move uses gamma = 1.
        independence: largest share of independence moves among the others; 0 switches them off
            and leaves the DREAM(ZS) of Vrugt (2016).
        jitter: half width c of the uniform lambda that stretches a jump.
        noise: half width of epsilon, in units of each coordinate's standard deviation.
        thinning: the chains enter the archive every `thinning` generations (K).
        adaptation: generations in which shares, scales and outliers are adapted; all of them are
            burn-in and discarded.
        start: 'annealed' finds the posterior by tempering the likelihood from the prior (or from
            the archive of an earlier run) before the chains start; 'prior' starts the chains at a
            Latin hypercube of the prior as Vrugt (2016) does.
        population: points per temperature while annealing, and of the initial archive (m_0); a
            warm start takes a quarter. None: 50 p^1.5 for p parameters, 200 to 2000.
        sweeps: moves of each point's chain per temperature.
        survivors: share of the population that the weights of the next temperature may leave.
    """

    chains: int = 20
    pairs: int = 3
    crossovers: int = 3
    snooker: float = 0.1
    unit_jump: float = 0.2
    independence: float = 0.9
    jitter: float = 0.05
    noise: float = 1e-6
    thinning: int = 2
    adaptation: int = 60
    start: Literal['annealed', 'prior'] = 'annealed'
    population: int | None = None
    sweeps: int = 10
    survivors: float = 0.6

    def __post_init__(self) -> None:
        for name, lowest in (
            ('chains', 3),
            ('pairs', 1),
            ('crossovers', 1),
            ('thinning', 1),
            ('adaptation', 0),
            ('sweeps', 1),
        ):
            if getattr(self, name) < lowest:
                raise InputError(f'sampler setting {name}={getattr(self, name)} is below {lowest}')
        for name in ('snooker', 'unit_jump', 'independence', 'jitter'):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise InputError(f'sampler setting {name}={getattr(self, name)} is outside [0, 1]')
        if not 0.0 < self.survivors < 1.0:
            raise InputError(f'sampler setting survivors={self.survivors} is outside (0, 1)')
        if not self.noise > 0.0:
            raise InputError('sampler setting noise must be positive')
        if self.population is not None and self.population < 2 * self.sweeps:
            raise InputError(
                f'sampler setting population={self.population} leaves fewer than two chains of '
                f'{self.sweeps} sweeps'
            )
        if self.start not in ('annealed', 'prior'):
            raise InputError(f"sampler setting start={self.start!r}; use 'annealed' or 'prior'")

    def points(self, dimension: int) -> int:
        """Size of the population for so many parameters; never too few for their covariance."""
        if self.population is not None:
            return max(self.population, 10 * dimension)
        # Grows faster than p: what keeps two modes' shares steady is points per stage, of which
        # there are more in more dimensions (2 of 60 runs lost a mode in ten with 100 p points).
        return max(200, 10 * dimension, min(int(50 * math.sqrt(dimension) * dimension), 2000))
