"""What a move is, what it may look at, and how compiled code hands on to one of several."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.errors import InputError
from actuator_glue.jit import njit
from actuator_glue.records import Array

# Columns of the uniforms of one chain and step; from U_FREE on they belong to its move.
U_MOVE: Final = 0
U_ACCEPT: Final = 1
U_FREE: Final = 2
# Crossover class of moves that have none.
NO_CLASS: Final = -1


class Tuning(NamedTuple):
    """Proposal distributions of the moves.

    Attributes:
        move_cdf: cumulative probabilities of the moves, (M,).
        crossover_cdf: cumulative probabilities of the crossover classes, (n_CR,).
        scale: standard deviation of each coordinate over the archive, (p,).
        centre: centre of the Student t fitted to the archive, its bend taken off, (p,).
        factor: Cholesky factor of its covariance, (p, p).
        along: direction along which the archive bends (`bend`), (p,); zeros where it is straight.
        across: direction and size of the bend, (p,).
    """

    move_cdf: Array
    crossover_cdf: Array
    scale: Array
    centre: Array
    factor: Array
    along: Array
    across: Array


class Tempering(NamedTuple):
    """The target r^(1 - power) p^power between a reference r and the posterior p.

    Attributes:
        power: 1 is the posterior itself.
        centre: centre of the reference's Student t, (p,); empty for the prior as reference.
        factor: its Cholesky factor, (p, p).
    """

    power: float
    centre: Array
    factor: Array


UNTEMPERED = Tempering(1.0, np.empty(0), np.empty((0, 0)))


class Knobs(NamedTuple):
    """Numbers that the settings give to moves.

    Attributes:
        pairs: largest number of archive pairs in a parallel-direction move.
        unit_jump: probability that such a move is a unit jump.
        jitter: half width of the factor that stretches its jumps.
        noise: half width of what is added to them, in standard deviations.
    """

    pairs: int
    unit_jump: float
    jitter: float
    noise: float


class Scratch(NamedTuple):
    """Arrays that moves may write to: indices (3, max(2 pairs, 3)) and residual (p,)."""

    indices: NDArray[np.int64]
    residual: Array


class ProposalContext(NamedTuple):
    """What a step depends on besides the chains and the archive.

    Attributes:
        lower: lower bounds of the prior, (p,).
        width: its widths, (p,).
        tuning: proposal distributions; they change in place as the moves learn.
        tempering: the target; `UNTEMPERED` for the posterior itself.
        fixed: probability of each move, (M,); negative where it follows what the move achieves.
        most: largest share among those of each move, (M,).
        knobs: numbers of the moves.
    """

    lower: Array
    width: Array
    tuning: Tuning
    tempering: Tempering
    fixed: Array
    most: Array
    knobs: Knobs


class Workspace(NamedTuple):
    """Arrays for the candidates of n chains, so that a loop allocates nothing.

    Attributes:
        log_jacobian: of the candidates, (n,).
        correction: log Hastings correction, (n,).
        label: number of the move and crossover class, (n, 2).
        reference: log density of the tempered target's reference at the candidates, (n,).
        log_uniform: what the log acceptance ratio must exceed, (n,).
        floor: log likelihood below which the candidate is rejected, (n,).
        accepted: whether the chain moves there, (n,).
        scratch: of the moves.
    """

    log_jacobian: Array
    correction: Array
    label: NDArray[np.int64]
    reference: Array
    log_uniform: Array
    floor: Array
    accepted: NDArray[np.bool_]
    scratch: Scratch


@njit
def workspace(chains: int, dimension: int, pairs: int) -> Workspace:
    """Return the workspace of so many chains."""
    return Workspace(
        np.empty(chains),
        np.empty(chains),
        np.empty((chains, 2), np.int64),
        np.empty(chains),
        np.empty(chains),
        np.empty(chains),
        np.empty(chains, np.bool_),
        Scratch(np.empty((3, max(2 * pairs, 3)), np.int64), np.empty(dimension)),
    )


@dataclass(frozen=True, slots=True)
class Move:
    """One way to propose a candidate; reversible together with its Hastings correction.

    Attributes:
        name: for people.
        propose: compiled function of (z, uniforms, rows, size, tuning, knobs, scratch, candidate)
            that writes the candidate of one chain at z (p,) and returns the log of
            q(candidate -> z)/q(z -> candidate), and the crossover class or `NO_CLASS`. Its random
            numbers are uniforms[U_FREE:]; rows[:size] is the archive.
        uniforms: how many of them it uses, given dimension and pairs.
        share: probability of the move; None: such moves divide the rest by what they achieve, and
            the first of them takes the remainder.
        most: largest share among those.
    """

    name: str
    propose: Callable[..., tuple[float, int]]
    uniforms: Callable[[int, int], int]
    share: float | None = None
    most: float = 1.0


def uniforms_per_chain(moves: Sequence[Move], dimension: int, pairs: int) -> int:
    """Return how many uniforms one chain may use in one step, whichever move it makes."""
    return U_FREE + max(move.uniforms(dimension, pairs) for move in moves)


def dispatch(moves: Sequence[Move]) -> Callable[..., tuple[float, int]]:
    """Return a compiled function of (number, ...) that hands on to that move's `propose`."""
    last, mine = len(moves) - 1, moves[-1].propose
    if last < 0:
        raise InputError('the sampler has no moves')
    before = dispatch(moves[:-1]) if last else None

    # Not kept in files, where a closure would not be found again: what calls it is.
    @njit(cache=False)
    def propose(
        number: int,
        z: Array,
        uniforms: Array,
        rows: Array,
        size: int,
        tuning: Tuning,
        knobs: Knobs,
        scratch: Scratch,
        candidate: Array,
    ) -> tuple[float, int]:
        if before is None or number == last:
            return mine(z, uniforms, rows, size, tuning, knobs, scratch, candidate)
        return before(number, z, uniforms, rows, size, tuning, knobs, scratch, candidate)

    return propose
