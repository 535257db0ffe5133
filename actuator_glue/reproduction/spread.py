"""Table 4's spread: which residual it takes at G = 2^8, and what that residual may look like."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from actuator_glue.model.exact import ExactErrors
from actuator_glue.records import Array, Record
from actuator_glue.reproduction.posterior import Posterior, Progress, altered, run
from actuator_glue.reproduction.published import CHOSEN, TABLE_4

MM = 1e-3
NEAR = 2.5  # factor from Table 4 within which residuals enter the match


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """COV and skewness of each parameter against the residual's size.

    Attributes:
        rms: residual rms at the best fit, shape (r,) [m].
        mean, cov, skewness: of the four parameters, shape (r, 4).
        mean_rms, skewness_rms: residual at which the means, and the skewnesses, of the first three
            parameters agree best with Table 4 [m].
        matched: posterior at the residual where our COVs of the first three parameters agree
            best with Table 4 (least squares of log ratios).
        literal: posterior without added residual at the shaping factor that should be
            equivalent by `equivalent_shaping_factor`.
    """

    rms: Array
    mean: Array
    cov: Array
    skewness: Array
    mean_rms: float
    skewness_rms: float
    matched: Posterior
    literal: Posterior

    @property
    def difference(self) -> Array:
        """Relative difference of our COVs from Table 4 at the matched residual, shape (4,)."""
        return np.asarray(self.matched.moments.cov / TABLE_4.cov - 1.0)


def against_residual(
    seed: int,
    errors: ExactErrors,
    added_mm: Sequence[float],
    evaluations: int,
    final_evaluations: int,
    progress: Progress,
) -> Spread:
    """Sample the posterior at G = 2^8 for residuals of several sizes, then where they match.

    Args:
        seed: of the whole study.
        errors: error sums of both tests.
        added_mm: uncorrelated residuals to add, ascending [mm].
        evaluations: per residual.
        final_evaluations: for the matched one.
        progress: called with the share done.
    """
    total = len(added_mm) * evaluations + final_evaluations

    def one(words: Sequence[int], added: float, count: int, done: int) -> Posterior:
        return run(
            words, errors, CHOSEN, count, added_rms=added * MM,
            progress=lambda share: progress((done + share * count) / total),
        )  # fmt: skip

    posteriors = [
        one((seed, 40, i), added, evaluations, i * evaluations) for i, added in enumerate(added_mm)
    ]
    cov = np.array([p.moments.cov for p in posteriors])
    mean = np.array([p.moments.mean for p in posteriors])
    skewness = np.array([p.moments.skewness for p in posteriors])
    steps = np.asarray(added_mm)
    matched_mm = match(steps, cov, TABLE_4.cov)
    matched = one((seed, 41), matched_mm, final_evaluations, total - final_evaluations)
    small = equivalent_shaping_factor(matched.best_rms, posteriors[0].best_rms)
    return Spread(
        rms=np.array([p.best_rms for p in posteriors]),
        mean=mean,
        cov=cov,
        skewness=skewness,
        mean_rms=_total(match(steps, mean, TABLE_4.mean, 1.2), posteriors[0]),
        skewness_rms=_total(match(steps, skewness, TABLE_4.skewness), posteriors[0]),
        matched=matched,
        literal=run((seed, 43), errors, small, evaluations),
    )


def _total(added_mm: float, bare: Posterior) -> float:
    return float(np.hypot(added_mm * MM, bare.best_rms))


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


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """A residual of one shape and the posterior it leads to.

    Attributes:
        name: what the residual is, with its size.
        posterior: at G = 2^8.
    """

    name: str
    posterior: Posterior


def structures(
    seed: int, records: Sequence[Record], size: float, evaluations: int, progress: Progress
) -> list[Structure]:
    """Sample the posterior for residuals of other shapes, as large as the matched one or near.

    Args:
        seed: of the whole study.
        records: both tests.
        size: rms of the matched residual [m].
        evaluations: per shape.
        progress: called with the share done.
    """
    shapes: list[tuple[str, Callable[[Record], Array]]] = [
        (f'hum at 50 Hz, {size * 1e3:.2f} mm rms', lambda r: r.measured + _sine(r, 50.0, size)),
        (
            f'drift over 40 s, {size * 1e3:.2f} mm rms',
            lambda r: r.measured + _sine(r, 1 / 40, size),
        ),
        ('measured 20 ms late', lambda r: _moved(r, -0.02, 0.0)),
        ('measured 20 ms early', lambda r: _moved(r, 0.02, 0.0)),
        ('clock of the measurement 0.1 % slow', lambda r: _moved(r, 0.0, -1e-3)),
        ('clock of the measurement 0.1 % fast', lambda r: _moved(r, 0.0, 1e-3)),
        (f'loop of +-{size * 1e3:.2f} mm against velocity', lambda r: _loop(r, size)),
    ]
    found = []
    for i, (name, change) in enumerate(shapes):
        errors = altered(records, change)
        posterior = run((seed, 42, i), errors, CHOSEN, evaluations)
        found.append(Structure(name, posterior))
        progress((i + 1) / len(shapes))
    return found


def _sine(record: Record, frequency_hz: float, rms: float) -> Array:
    return np.asarray(np.sqrt(2.0) * rms * np.sin(2 * np.pi * frequency_hz * record.time + 1.0))


def _moved(record: Record, offset: float, skew: float) -> Array:
    return np.interp(record.time * (1.0 + skew) + offset, record.time, record.measured)


def _loop(record: Record, size: float) -> Array:
    return np.asarray(record.measured - size * np.sign(np.gradient(record.measured)))


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
