"""Compensators: the command made of the target displacement, its rate and its acceleration.

u = c_0 x_t + c_1 x_t' + c_2 x_t'', the form of the adaptive time series (Chae, Kazemibidokhti and
Ricles 2013). The numerical substructure knows all three exactly: nothing is differentiated.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from actuator_glue.hybrid.linear_system import System
from actuator_glue.records import Array

Kind = Literal['none', 'inverse', 'ats-fixed', 'ats', 'robust']
KINDS: tuple[Kind, ...] = ('none', 'inverse', 'ats-fixed', 'ats', 'robust')
# The usual limits of the adaptive time series: -, s, s^2 (Chae et al. 2013).
LOWEST = np.array([0.9, 0.0, 0.0])
HIGHEST = np.array([1.1, 0.060, 0.0032])


@dataclass(frozen=True, slots=True, eq=False)
class Compensator:
    """A compensator and what it begins with.

    Attributes:
        kind: its name.
        coefficients: c_0, c_1, c_2, (3,) [-, s, s^2].
        adaptive: whether they follow the measured displacement during the test.
    """

    kind: Kind
    coefficients: Array
    adaptive: bool = False

    def __str__(self) -> str:
        if self.kind == 'none':
            return 'none'
        c0, c1, c2 = self.coefficients
        rate, bend = f'{1e3 * c1:.4g} ms', f'{1e6 * c2:.4g} ms^2'
        at = ' at first' if self.adaptive else ''
        return f'{self.kind} (u = {c0:.4g} x + {rate} v + {bend} a{at})'

    def applied(self, system: System) -> System:
        """Return a system of relative degree two or more behind this compensator.

        y, y' and y'' of the system stand for those of the command: in a linear system the order
        does not matter.
        """
        c0, c1, c2 = self.coefficients
        once = (system.C[:, None] @ system.A)[:, 0]
        twice = (once[:, None] @ system.A)[:, 0]
        through = (once * system.B).sum(axis=1)
        return system._replace(C=c0 * system.C + c1 * once + c2 * twice, D=c2 * through)


def inverse(system: System, delay: float) -> Array:
    """Return c (3,) that undo a system (one row) and a delay up to the second order in s.

    1/G(s) = c_0 + c_1 s + c_2 s^2 + ..., from the moments of G; exact for Eq. (2a) without delay.
    """
    right = system.B[0]
    moments = []
    for _ in range(3):
        right = np.linalg.solve(system.A[0], right)
        moments.append(-float(system.C[0] @ right))
    g0, g1, g2 = moments
    c0, c1, c2 = 1.0 / g0, -g1 / g0**2, (g1**2 - g0 * g2) / g0**3
    return np.array([c0, c1 + c0 * delay, c2 + c1 * delay + 0.5 * c0 * delay**2])
