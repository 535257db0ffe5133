"""What a calibration's result is made of: parameters, errors, records, the prior."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_glue.api.frame import frame
from actuator_glue.inference.convergence import rhat_and_ess
from actuator_glue.inference.moments import moments
from actuator_glue.json_value import json_value
from actuator_glue.model.force_errors import transducer
from actuator_glue.motion import METRES, spoken
from actuator_glue.records import Array, Record

if TYPE_CHECKING:
    from pandas import DataFrame

# Logarithm of a transducer's gain beyond which its scale is doubted.
_OFF = 0.05


@dataclass(frozen=True, slots=True)
class Marginal:
    """Posterior of one parameter, in its SI unit.

    Attributes:
        mean, stddev, skewness: moments of the draws.
        cov: coefficient of variation, stddev / |mean|.
        rhat: rank-normalised split R-hat (Vehtari et al. 2021).
        ess: bulk effective sample size (the same paper).
        best: value of the draw of the highest likelihood.
        unit: SI unit.
        bounds: of the uniform prior.
        prior_dominated: the draws are about as wide as the prior.
    """

    mean: float
    stddev: float
    skewness: float
    cov: float
    rhat: float
    ess: float
    best: float
    unit: str
    bounds: tuple[float, float]
    prior_dominated: bool


def marginals(
    draws: Array, best: Array, units: Mapping[str, str], bounds: Sequence[tuple[float, float]]
) -> dict[str, Marginal]:
    """Return the posterior of each parameter.

    Args:
        draws: of all chains, shape (steps, chains, p).
        best: the draw of the highest likelihood, shape (p,).
        units: unit of each parameter by name, in the order of the draws.
        bounds: of their uniform priors; infinite where there is none.
    """
    lower, upper = np.transpose(bounds)
    told = moments(draws.reshape(-1, draws.shape[-1]), lower, upper)
    rhat, ess = rhat_and_ess(draws)
    return {
        name: Marginal(
            mean=float(told.mean[i]),
            stddev=float(told.stddev[i]),
            skewness=float(told.skewness[i]),
            cov=float(told.cov[i]),
            rhat=float(rhat[i]),
            ess=float(ess[i]),
            best=float(best[i]),
            unit=unit,
            bounds=(float(lower[i]), float(upper[i])),
            prior_dominated=bool(told.prior_dominated[i]),
        )
        for i, (name, unit) in enumerate(units.items())
    }


def marginals_json(parameters: Mapping[str, Marginal], draws: Array) -> dict[str, Any]:
    """Return parameters as JSON, each with its 95 % interval `lower` to `upper`.

    Args:
        parameters: posterior of each.
        draws: shape (m, p), in their order.
    """
    ends = np.quantile(draws, (0.025, 0.975), axis=0).T
    return {
        name: json_value({**asdict(p), 'lower': low, 'upper': high})
        for (name, p), (low, high) in zip(parameters.items(), ends, strict=True)
    }


def marginals_frame(
    parameters: Mapping[str, Marginal], draws: Array, motion: str, index: str
) -> DataFrame:
    """Return a table of parameters, a row for each by its name.

    Args:
        parameters: posterior of each.
        draws: shape (m, p), in their order.
        motion: what the records move in, which units are said in.
        index: what a row is called after.

    Raises:
        InputError: pandas is not installed.
    """
    ends = np.quantile(draws, (0.025, 0.975), axis=0).T
    rows = [
        {
            index: name,
            'unit': spoken(p.unit, motion),
            'mean': p.mean,
            'stddev': p.stddev,
            'lower': lower,
            'upper': upper,
            'best': p.best,
            'skewness': p.skewness,
            'cov': p.cov,
            'rhat': p.rhat,
            'ess': p.ess,
            'prior_lower': p.bounds[0],
            'prior_upper': p.bounds[1],
            'prior_dominated': p.prior_dominated,
        }
        for (name, p), (lower, upper) in zip(parameters.items(), ends, strict=True)
    ]
    return frame(rows, index)


@dataclass(frozen=True, slots=True)
class RecordError:
    """Free-run error of the best draw in one record.

    Attributes:
        source: the record.
        rms_m: root mean square [m].
        offset_m: its mean [m].
        nrmse: share of the spread measured; None where nothing moves.
    """

    source: str
    rms_m: float
    offset_m: float
    nrmse: float | None

    @classmethod
    def of(cls, source: str, error: Array, measured: Array) -> RecordError:
        """Return it for errors (n,) of measured displacement (n,) [m]."""
        rms, spread = float(np.sqrt(np.mean(error**2))), float(measured.std())
        return cls(source, rms, float(np.mean(error)), rms / spread if spread > 0.0 else None)


@dataclass(frozen=True, slots=True)
class RecordForce:
    """How the best draw explains the force of one record.

    Attributes:
        source: the record.
        gain: of the transducer, measured over simulated; 0 where no force is simulated.
        offset_n: of the transducer [N].
        rms_n: root mean square of what is left [N].
        nrmse: share of the force's spread.
    """

    source: str
    gain: float
    offset_n: float
    rms_n: float
    nrmse: float

    @classmethod
    def of(cls, source: str, simulated: Array, measured: Array) -> RecordForce:
        """Return it for actuator forces (1, n) and the measured one (n,) [N]."""
        gain, offset = (float(v[0]) for v in transducer(simulated, measured))
        rms = float(np.sqrt(np.mean((measured - gain * simulated[0] - offset) ** 2)))
        return cls(source, gain, offset, rms, rms / float(measured.std()))

    def remark(self, name: str) -> str:
        """Return the force as evidence in one line, for people, who call the record so."""
        line = f'force of {name or "a record"}: '
        if self.gain == 0.0:
            return f'{line}the model has none in phase with it, it says nothing'
        line += f'{self.rms_n:.3g} N rms are left, {100.0 * self.nrmse:.1f} % of its spread'
        if abs(np.log(self.gain)) > _OFF:
            return (
                f'{line}; its transducer would have a gain of {self.gain:.3g}: check its scale '
                'and the specimen stiffness'
            )
        return line


@dataclass(frozen=True, slots=True)
class FitError:
    """Free-run error of the best draw over all records [m], as share of their spread, and each."""

    rms_m: float
    nrmse: float | None
    records: tuple[RecordError, ...]


@dataclass(frozen=True, slots=True)
class CalibratedRecord:
    """A record that was calibrated with; `motion` is what it measures, as in `Record`."""

    source: str
    samples: int
    rate_hz: float
    stiffness_n_per_m: float | None
    hold: str
    motion: str = METRES

    @classmethod
    def of(cls, record: Record) -> CalibratedRecord:
        """Describe a record."""
        return cls(
            record.source,
            len(record),
            record.rate,
            record.stiffness,
            record.hold,
            record.motion,
        )
