"""What a virtual hybrid test is computed from lane by lane, and what it leaves."""

from __future__ import annotations

from typing import NamedTuple

from actuator_glue.records import Array


class Lanes(NamedTuple):
    """What differs between the lanes of a block.

    Attributes:
        reference: transition matrix of the whole structure, (s, s, LANES).
        ground: what the ground adds to it, (s, LANES).
        specimen: stiffness, damping, mass, (3, LANES).
        step, command, speed: linear actuators (`sampled.Plants`), (p, p, LANES), (p, LANES) twice.
        shown: row of the recorded displacement, (p,).
        table: effects' kernel table, (assembly.SIZE + registers,); (0,) for linear actuators.
        lag: of the command, with effects, (LANES,) [samples].
    """

    reference: Array
    ground: Array
    specimen: Array
    step: Array
    command: Array
    speed: Array
    shown: Array
    table: Array
    lag: Array


class SharedInputs(NamedTuple):
    """What all lanes share.

    Attributes:
        ground: ground acceleration at each sample, (n,) [m/s^2].
        period: sample period [s].
        noise: standard deviation of displacement and force sensor, (2,) [m, N].
        stride: every how many samples the response is kept.
        adaptive: whether the compensator adapts.
        smoothing: `adaptation.smoothing`.
    """

    ground: Array
    period: float
    noise: Array
    stride: int
    adaptive: bool
    smoothing: Array


class Found(NamedTuple):
    """What a block leaves.

    Attributes:
        target, moved: target and displacement of the piston at each sample, (LANES, n) [m].
        sums: of squares of each floor's error and of the reference, (2, floors, LANES).
        peaks: of each floor's error, reference, displacement and drift, (4, floors, LANES) [m].
        force: peak of the specimen's force, (LANES,) [N].
        response: displacement of the floors, (n / stride, floors, LANES) [m].
        whole: the same of the reference.
    """

    target: Array
    moved: Array
    sums: Array
    peaks: Array
    force: Array
    response: Array
    whole: Array
