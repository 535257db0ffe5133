"""What a blind case is, and which kind of case a seed stands for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from sizing import Array

GROUPS = (
    ('delay', 'sensor-lag', 'valve-lag'),
    ('coulomb-friction', 'stribeck-friction'),
    ('backlash', 'valve-deadband'),
    ('bias', 'valve-null', 'flow-asymmetry'),
    ('gain-drift', 'supply-droop'),
    ('drift',),
    ('pressure-flow', 'specimen-yield'),
    ('specimen-hardening', 'specimen-gap'),
    ('gain', 'viscous-damping'),
)


def group(name: str) -> tuple[str, ...]:
    """Return the names that count as the same group."""
    return next((g for g in GROUPS if name in g), (name,))


@dataclass
class Case:
    """One case: what the diagnosis sees and (apart) the truth.

    Commands, measured and clean displacements are [m], one array per record; the last record is
    held out. `ratio` is the post-refit noise-free residual of the fitting records over the noise,
    `shares` that of each effect of a pair on its own; `parameters` are the catalogue's, where an
    effect is written as there.
    """

    seed: int
    kind: str
    effects: tuple[str, ...]
    theta: Array
    rate: float
    stiffness: tuple[float, ...]
    commands: list[Array]
    measured: list[Array]
    clean: list[Array]
    ratio: float
    colour: float
    sizes: dict[str, float] = field(default_factory=dict)
    shares: dict[str, float] = field(default_factory=dict)
    parameters: dict[str, float] = field(default_factory=dict)


def kinds(seed: int, known: Sequence[str], unknown: Sequence[str]) -> tuple[str, tuple[str, ...]]:
    """Return kind and effects of a seed: stratified, so that any 20 in a row hold all kinds."""
    rng = np.random.default_rng([seed, 1])
    place = seed % 20
    if place < 4:
        return 'none', ()
    if place < 7:
        return 'unknown', (unknown[(seed // 20 * 3 + place - 4) % len(unknown)],)
    if place < 9:
        while True:
            a, b = rng.choice(len(known), 2, replace=False)
            pair = (known[a], known[b])
            if pair[1] not in group(pair[0]):
                return 'pair', pair
    return 'single', (known[(seed // 20 * 11 + place - 9) % len(known)],)
