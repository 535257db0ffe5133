"""What a replay found: what was estimated in each window, and how it compares with live."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_glue.api.tracking import RecordTracking


@dataclass(frozen=True, slots=True)
class WindowParameter:
    """Posterior of one parameter in one window, SI units."""

    mean: float
    stddev: float
    skewness: float
    cov: float
    rhat: float
    ess: float


@dataclass(frozen=True, slots=True)
class WindowError:
    """Error of a window's best draw: rms [m], and as share of the spread measured."""

    rms_m: float
    nrmse: float


@dataclass(frozen=True, slots=True)
class ScoredBand:
    """A forecast that has been scored: its levels, and coverage and mean width [m] at each."""

    kind: str
    index: int
    levels: tuple[float, ...]
    coverage: tuple[float, ...]
    width_m: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class WindowExplanation:
    """A structure that is carried: its weight, and each parameter if it is true.

    Attributes:
        name: its effects, or "Eq. (2)".
        weight: fixed before the window.
        mean: posterior mean of each parameter, SI units; empty where no time was left for it.
        stddev: their posterior standard deviations.
    """

    name: str
    weight: float
    mean: dict[str, float]
    stddev: dict[str, float]


@dataclass(frozen=True, slots=True)
class WindowEstimate:
    """What was estimated in one window.

    Attributes:
        window: its number, counted anew in each run.
        index: running index of its first sample.
        samples: how many it has.
        end_s: stream time of its end [s].
        parameters: posterior of each parameter.
        evaluations: likelihood evaluations.
        converged: R-hat is below the limit of the settings.
        error: of the best draw.
        bands: forecasts that ended in this window.
        tracking: how the actuator followed the command, where that was asked for.
        explanations: structures that are carried, the likeliest first, which names `parameters`.
        run: of the estimator, from 1 on; it begins again where it is activated or started again.
    """

    window: int
    index: int
    samples: int
    end_s: float
    parameters: dict[str, WindowParameter]
    evaluations: int
    converged: bool
    error: WindowError
    bands: tuple[ScoredBand, ...]
    tracking: RecordTracking | None = None
    explanations: tuple[WindowExplanation, ...] = ()
    run: int = 1


@dataclass(frozen=True, slots=True)
class Compared:
    """Replayed numbers compared with those published live.

    Attributes:
        posteriors: how many were compared.
        bands: how many were compared.
        differing: one line for each that differs or is missing.
        unrepeatable: one line for each window that cannot be repeated to the bit: the bag lacks
            samples or settings of it, or where it began.
    """

    posteriors: int
    bands: int
    differing: tuple[str, ...]
    unrepeatable: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, repr=False)
class ReplayData:
    """All windows of a stream, and whether they are what was published live.

    Attributes:
        bag: what was replayed.
        settings: settings of the estimator that a replay may change.
        effects: effects of the last window's model beyond Eq. (2).
        windows: the windows, in order.
        events: what happened besides, one line each.
        identical: replay and live agree bit by bit in all that can be repeated; None where nothing
            was published live, or nothing of it can be repeated.
        compared: how that was found; None where nothing was published live.
        data_seconds: length of the usable samples [s].
        seconds: how long the replay took.
        notes: what limits the answer.
    """

    bag: str
    settings: dict[str, float]
    effects: tuple[str, ...]
    windows: tuple[WindowEstimate, ...]
    events: tuple[str, ...]
    identical: bool | None
    compared: Compared | None
    data_seconds: float
    seconds: float
    notes: tuple[str, ...] = ()

    @property
    def times_real_time(self) -> float:
        """Seconds of data per second."""
        return self.data_seconds / self.seconds if self.seconds > 0.0 else 0.0

    def summary(self) -> str:
        """Return what came out in one line."""
        said = {None: 'nothing published live to compare with', True: 'identical to live'}
        verdict = said.get(self.identical, 'NOT identical to live')
        if self.compared is not None and (lost := len(self.compared.unrepeatable)):
            told = f'{lost} windows cannot be repeated: the bag lacks samples'
            verdict = told if self.identical is None else f'{verdict}; {told}'
        return f'{len(self.windows)} windows over {self.data_seconds:.1f} s: {verdict}'
