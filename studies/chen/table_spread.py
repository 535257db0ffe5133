"""Table 4's spread: which residual it takes at G = 2^8, and what that residual may look like."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.chen.laboratory import Laboratory, Posterior
from studies.chen.library import Array, ExactErrors, Record
from studies.chen.published import CHOSEN, TABLE_4

MM = 1e-3
NEAR = 2.5  # factor from Table 4 within which residuals enter the match


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """Posteriors at G = 2^8 against the residual's size.

    Attributes:
        posteriors: one per residual, ascending.
        mean_rms, skewness_rms: residual at which the means, and the skewnesses, of the first three
            parameters agree best with Table 4 [m].
        matched: posterior at the residual where our COVs of the first three parameters agree
            best with Table 4 (least squares of log ratios).
        literal: posterior without added residual at the shaping factor that should be
            equivalent by `equivalent_shaping_factor`.
    """

    posteriors: list[Posterior]
    mean_rms: float
    skewness_rms: float
    matched: Posterior
    literal: Posterior

    def off(self, moment: str) -> Array:
        """Relative difference of a moment from Table 4 at the matched residual, shape (4,)."""
        return np.asarray(getattr(self.matched.moments, moment) / TABLE_4[moment] - 1.0)


def against_residual(
    laboratory: Laboratory,
    errors: ExactErrors,
    added_mm: Sequence[float],
    evaluations: int,
    final_evaluations: int,
) -> Spread:
    """Sample the posterior at G = 2^8 for residuals of several sizes, then where they match.

    Args:
        laboratory: where to sample.
        errors: error sums of both tests.
        added_mm: uncorrelated residuals to add, ascending [mm].
        evaluations: per residual.
        final_evaluations: for the matched one.
    """
    posteriors = [
        laboratory.run((40, i), errors, CHOSEN, evaluations, added_rms=added * MM)
        for i, added in enumerate(added_mm)
    ]
    bare = posteriors[0].best_rms

    def matching(moment: str, near: float = NEAR) -> float:
        values = np.array([getattr(p.moments, moment) for p in posteriors])
        return MM * match(np.asarray(added_mm), values, TABLE_4[moment], near)

    matched = laboratory.run((41,), errors, CHOSEN, final_evaluations, added_rms=matching('cov'))
    small = equivalent_shaping_factor(matched.best_rms, bare)
    return Spread(
        posteriors,
        float(np.hypot(matching('mean', 1.2), bare)),
        float(np.hypot(matching('skewness'), bare)),
        matched,
        laboratory.run((43,), errors, small, evaluations),
    )


def match(added_mm: Array, values: Array, published: Array, near_factor: float = NEAR) -> float:
    """Return the residual [mm] whose moments (r, 4), interpolated, are nearest to published (4,).

    Nearest by the sum of squared log ratios over beta_1, alpha_1 beta_0 and alpha_2; alpha_3
    piles up at its bound, where its COV hardly depends on the residual.
    """
    fine = np.linspace(float(added_mm[0]), float(added_mm[-1]), 2001)
    miss = np.zeros(len(fine))
    for i in range(3):
        off = np.log(np.maximum(values[:, i], 1e-9) / published[i])
        # A moment of a short run scatters by some 5 %: a parabola through all near points is
        # steadier than the two next to the crossing.
        near = np.abs(off) < np.log(near_factor)
        if near.sum() >= 4:
            curve = np.polyval(np.polyfit(added_mm[near], off[near], 2), fine)
            beyond = (fine < added_mm[near].min()) | (fine > added_mm[near].max())
            curve = np.where(beyond, np.log(near_factor), curve)
        else:
            curve = np.interp(fine, added_mm, off)
        miss += curve**2
    return float(fine[int(np.argmin(miss))])


def equivalent_shaping_factor(size: float, sensor: float) -> float:
    """Return the G at sensor-level noise with the matched posterior's curvature at its mode.

    Near the mode Eq. (4) is -G Q/Var_min, Q the growth of the variance: G/Var_min is all that
    counts. Away from it the logarithm makes tails like (1 + Q/Var_min)^-G, so the two posteriors
    agree only while the spread stays small.

    Args:
        size: residual rms of the matched posterior [m].
        sensor: residual rms at sensor-level noise [m].
    """
    return CHOSEN * (sensor / size) ** 2


def shapes(
    laboratory: Laboratory, records: Sequence[Record], size: float, evaluations: int
) -> dict[str, Posterior]:
    """Sample the posterior for residuals of other shapes, as large as the matched one or near.

    Args:
        laboratory: where to sample.
        records: both tests.
        size: rms of the matched residual [m].
        evaluations: per shape.

    Returns:
        Posterior at G = 2^8 by what the residual is, with its size.
    """
    mm = f'{size / MM:.2f} mm'
    changes: dict[str, Callable[[Record], Array]] = {
        f'hum at 50 Hz, {mm} rms': lambda r: r.measured + _sine(r, 50.0, size),
        f'drift over 40 s, {mm} rms': lambda r: r.measured + _sine(r, 1 / 40, size),
        'measured 20 ms late': lambda r: _moved(r, -0.02, 0.0),
        'measured 20 ms early': lambda r: _moved(r, 0.02, 0.0),
        'clock of the measurement 0.1 % slow': lambda r: _moved(r, 0.0, -1e-3),
        'clock of the measurement 0.1 % fast': lambda r: _moved(r, 0.0, 1e-3),
        f'loop of +-{mm} against velocity': lambda r: _loop(r, size),
    }
    return {
        name: laboratory.run((42, i), altered(records, change), CHOSEN, evaluations)
        for i, (name, change) in enumerate(changes.items())
    }


def altered(records: Sequence[Record], change: Callable[[Record], Array]) -> ExactErrors:
    """Return error sums of records whose measured displacement is replaced by `change`."""
    return ExactErrors([replace(r, measured=change(r)) for r in records])


def _sine(record: Record, frequency_hz: float, rms: float) -> Array:
    return np.asarray(np.sqrt(2.0) * rms * np.sin(2 * np.pi * frequency_hz * record.time + 1.0))


def _moved(record: Record, offset: float, skew: float) -> Array:
    return np.interp(record.time * (1.0 + skew) + offset, record.time, record.measured)


def _loop(record: Record, size: float) -> Array:
    return np.asarray(record.measured - size * np.sign(np.gradient(record.measured)))
