"""Which starting sizes of an effect promise most, by what each adds to Eq. (2) as fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.model.parameters import Parameter
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

_STARTS = 4  # starting sizes that survive the screening (the kernel works on 32 at a time)
_SAME = 1e-9  # of the largest: parameters that move the response alike
_FINITE = 1e6  # m: what goes beyond has diverged


def signatures(data: Data, model: Model, thetas: Array, base: Array) -> Array:
    """Return what sizes of an effect (s, p) add to Eq. (2)'s response at base (4,): (s, N)."""
    output = data.simulate(model, thetas)
    output -= data.simulate(Structure(()), base)
    return output


@dataclass(frozen=True)
class Remainder:
    """What a structure's parameters, refitted linearly, cannot take up.

    Attributes:
        error: of its residual (N,) [m].
        taken: orthonormal directions that they span (r, N).
    """

    error: Array
    taken: Array

    @classmethod
    def of(cls, error: Array, jacobian: Array) -> Remainder:
        """Return it for a residual (N,) [m] and the simulation's derivative (p, N)."""
        scales = np.sqrt(np.einsum('pn,pn->p', jacobian, jacobian))
        jac = jacobian[scales > 0] / scales[scales > 0, None]
        values, vectors = np.linalg.eigh(jac @ jac.T)
        kept = values > _SAME * values.max(initial=0.0)
        taken = (vectors[:, kept] / np.sqrt(values[kept])).T @ jac
        return cls(error - (taken @ error) @ taken, taken)


def screen(
    parameters: Sequence[Parameter], sizes: Array, seen: Array, remainder: Remainder
) -> tuple[float, Array]:
    """Project a residual on an effect's signatures, the present parameters refitted linearly.

    Args:
        parameters: the effect's (k,).
        sizes: its starting sizes (s, k).
        seen: their signatures (s, N) [m].
        remainder: of the residual.

    Returns:
        The largest share of the squared error that one of the sizes can remove, and the sizes
        that promise most, as they are or scaled to what the residual asks for.
    """
    neutral = np.array([p.neutral if p.neutral is not None else 0.0 for p in parameters])
    lower, upper = np.array([p.lower for p in parameters]), np.array([p.upper for p in parameters])
    error, taken = remainder.error, remainder.taken
    # Finite values may still overflow in products.
    alive = np.asarray((np.abs(seen) < _FINITE).all(axis=1))
    if not alive.all():
        seen = np.where(alive[:, None], seen, 0.0)
    free = seen - (seen @ taken.T) @ taken
    free[np.abs(free).max(axis=1) > 1.0] = 0.0  # a metre of residual: it diverged
    power = np.einsum('sn,sn->s', free, free)
    cross = free @ error
    amount = np.where(power > 0, cross / np.maximum(power, 1e-300), 0.0)
    amount = np.clip(amount, 0.05, 4.0)
    as_is = power - 2.0 * cross
    scaled = amount**2 * power - 2.0 * amount * cross
    # Every size as it stands, and scaled to what the residual asks for.
    both = np.concatenate([sizes, sizes])
    both[len(sizes) :, 0] = neutral[0] + amount * (sizes[:, 0] - neutral[0])
    both = np.clip(both, lower, upper)
    merit = np.concatenate([as_is, scaled])
    merit[np.tile(~alive, 2)] = np.inf
    chosen = np.argsort(merit, kind='stable')[:_STARTS]
    share = np.where(power > 0, cross**2 / np.maximum(power, 1e-300), 0.0)
    return float(share[alive].max(initial=0.0) / (error @ error)), both[chosen]
