"""Delay margin of a hybrid test's loop: how late the specimen force may come."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.hybrid.linear_system import Complex, System, bilinear, closed, crossings, held
from actuator_glue.hybrid.loop import substructures
from actuator_glue.hybrid.partition import Partition
from actuator_glue.records import Array

_ROUNDING = 1e-9  # real part of a root on the limit, over the largest root


@dataclass(frozen=True, slots=True)
class Margins:
    """Margins of one loop.

    Attributes:
        gain: factor that the loop gain bears; None where no factor or no single one limits it.
        phase_deg: phase that it bears [deg]; None where the gain is nowhere 1.
    """

    gain: float | None
    phase_deg: float | None


def delay_margin(loop: System, delay: Array | float = 0.0) -> tuple[Array, Array]:
    """Return the smallest further delay, and the smallest lead, that reach the stability limit.

    Where |L(jw)| = 1 a delay tau puts a characteristic root on the imaginary axis if
    arg L - w (delay + tau) = pi modulo 2 pi (docs/rths.md).

    Args:
        loop: continuous open loop L.
        delay: what the loop has already, (m,) [s].

    Returns:
        tau_c and the lead, (m,) each [s]; infinite where the gain is nowhere 1. tau_c is 0 where
        the gain does not fall below 1 at high frequencies: no delay is borne then.
    """
    w = crossings(loop)
    later, sooner = _nearest(w, loop.response(np.asarray(1j * w)), delay)
    return np.where(np.abs(loop.D) >= 1.0, 0.0, later), sooner


def sampled_delay_margin(
    loop: System, period: float, delay: Array | float = 0.0
) -> tuple[Array, Array]:
    """Return `delay_margin` of the loop whose force is held from sample to sample.

    Args:
        loop: continuous open loop L.
        period: sample period T [s].
        delay: of computation and whatever else the loop has already, (m,) [s].
    """
    later, sooner = _nearest(*_sampled_crossings(loop, period), delay)
    return np.where(np.abs(loop.D) >= 1.0, 0.0, later), sooner


def critical_frequency(loop: System, period: float, delay: Array | float = 0.0) -> Array:
    """Return where each sampled loop has its delay margin, (m,) [rad/s].

    Of the frequencies at which the gain is 1 that whose phase is nearest to the limit, as time;
    not-a-number where there is none. Arguments as in `sampled_delay_margin`.
    """
    w, gain = _sampled_crossings(loop, period)
    lag = np.broadcast_to(np.asarray(delay, dtype=np.float64), (len(w),))[:, None]
    left = np.abs(np.angle(-gain * np.exp(-1j * w * lag))) / w
    nearest = np.where(np.isnan(w), np.inf, left).argmin(axis=1)
    return np.asarray(np.take_along_axis(w, nearest[:, None], axis=1)[:, 0])


def _sampled_crossings(loop: System, period: float) -> tuple[Array, Complex]:
    """Return where the gain of the sampled loop is 1 [rad/s], and the loop there."""
    discrete = held(loop, period)
    w = 2.0 * np.arctan(crossings(bilinear(discrete))) / period
    return w, discrete.response(np.exp(1j * w * period))


def _nearest(w: Array, gain: Complex, delay: Array | float) -> tuple[Array, Array]:
    turn = 2.0 * np.pi
    lag = np.broadcast_to(np.asarray(delay, dtype=np.float64), (len(w),))[:, None]
    angle = np.angle(gain) - w * lag + np.pi
    later = np.where(np.isnan(w), np.inf, (angle % turn) / w)
    sooner = np.where(np.isnan(w), np.inf, (-angle % turn) / w)
    return later.min(axis=1), sooner.min(axis=1)


def pure_delay_margin(partition: Partition) -> tuple[float, float]:
    """Return tau_c of the loop with a pure delay for an actuator: continuous, and sampled [s].

    The sampled one is what is left for the actuator when the force is held over a period and the
    partition's computation delay is spent; negative where they alone exceed what the loop bears.
    Both are negative where the whole structure is itself unstable, by negative damping say.
    """
    loop, period = nominal(partition), partition.period
    roots = np.linalg.eigvals(closed(loop)[0])
    lost = roots.real.max() > _ROUNDING * np.abs(roots).max()  # by the structure itself
    continuous = _signed(*delay_margin(loop), lost)
    lost = np.abs(np.linalg.eigvals(closed(held(loop, period))[0])).max() > 1.0  # or held force
    sampled = _signed(*sampled_delay_margin(loop, period), lost)
    return continuous, sampled - partition.computation_delay


def _signed(later: Array, sooner: Array, lost: bool) -> float:
    """Return the margin of the first row; negative where it is unstable without any delay."""
    return -float(sooner[0]) if lost and later[0] > 0.0 else float(later[0])


def nominal(partition: Partition) -> System:
    """Return L(s) with the specimen's nominal values."""
    return substructures(partition, partition.specimen.nominal)


def psi(delay: float) -> float | None:
    """Return the predictive stability indicator log10(tau_c [ms]) (Maghareh et al. 2014).

    None where there is no positive and finite tau_c.
    """
    return float(np.log10(1e3 * delay)) if 0.0 < delay < np.inf else None


def classical_margins(loop: System) -> Margins:
    """Return gain and phase margin of the first row of a loop, by python-control."""
    import control

    row = control.ss(loop.A[0], loop.B[0][:, None], loop.C[0][None], [[loop.D[0]]])
    with np.errstate(over='ignore'):  # of polynomials far above every crossing
        gain, phase = control.stability_margins(row)[:2]
    return Margins(*(float(v) if np.isfinite(v) else None for v in (gain, phase)))
