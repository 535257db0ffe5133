"""Whether the residual of a fitted model is noise: only then do its intervals hold.

A model that lacks something has a biased best fit, and a posterior around it that knows nothing of
that. The residual of the best fit shows it: structure that follows the motion. The command's run
between its samples and the stiffnesses, which are given and not fitted, are checked as well: a
wrong one makes the model another machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuator_glue.diagnosis.scopes import hold_and_stiffness
from actuator_glue.diagnosis.scopes.hold_and_stiffness import WrongSetup
from actuator_glue.diagnosis.score import forecast
from actuator_glue.diagnosis.score.scorer import Scorer, evidence, splits_of
from actuator_glue.diagnosis.thresholds import NATS, NOISE_SHARE, least_material
from actuator_glue.inference.effective_size import effective_size
from actuator_glue.inference.least_squares import decimate
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import Fit, base_fit, fit, rms
from actuator_glue.json_value import JsonObject
from actuator_glue.model.effects import scale
from actuator_glue.model.exact import Initial
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Hold, Record

# Effective over counted samples of a residual, below which it is not white: structure may pass for
# noise. White ones had 0.94 and more.
_WHITE = 0.8
_SHORT = 5.0  # s, below which few windows tell structure from noise: twice as much must be left
_FEWEST = 200  # samples of a record that has a spectrogram
_OTHER: dict[Hold, Hold] = {'zoh': 'linear', 'linear': 'zoh'}
_RUNS: dict[Hold, str] = {'linear': 'straight from sample to sample', 'zoh': 'held'}
# Advice where structure is left.
DIAGNOSE = 'run `actuator-glue diagnose` on the same records'


@dataclass(frozen=True, slots=True)
class ResidualStructure(JsonObject):
    """What a model's best fit leaves of records: structure, noise, and what another set-up leaves.

    Attributes:
        structure_m: rms of what follows the motion [m].
        noise_m: rms of the noise at the rate that is fitted [m].
        matters_m: least structure that matters: half the noise and a thousandth of the command,
            as in a diagnosis [m].
        rms_m: rms of all that is left [m].
        command_rms_m: rms of the measured displacement less the command [m].
        hold: how the commands run between their samples as given.
        other_hold: the other way.
        other_rms_m: rms of all that a refit with the other way leaves [m].
        nats: by how much the other way explains more, out of sample.
        nats_needed: evidence beyond chance.
        setup: a set-up under which Eq. (2) explains the records far better; None for none.
        means_s: time over which samples were averaged before this look, the longest of all records
            [s]; 0 where all were taken as they are. Noise of single samples is larger.
    """

    structure_m: float
    noise_m: float
    matters_m: float
    rms_m: float
    command_rms_m: float
    hold: Hold
    other_hold: Hold
    other_rms_m: float
    nats: float
    nats_needed: float
    setup: WrongSetup | None = None
    means_s: float = 0.0

    @property
    def matters(self) -> bool:
        """Whether more structure is left than noise and the size of the test excuse."""
        return self.structure_m >= self.matters_m

    @property
    def other_fits(self) -> bool:
        """Whether the command ran the other way between its samples, beyond chance."""
        return self.nats >= self.nats_needed and self.other_rms_m < self.rms_m

    @property
    def intervals_hold(self) -> bool:
        """Whether nothing in the residual speaks against the intervals."""
        return not self.matters and not self.other_fits

    def to_json(self) -> dict[str, object]:
        """Return the JSON object: the fields, and what follows from them."""
        return {**JsonObject.to_json(self), 'intervals_hold': self.intervals_hold}

    @property
    def averaged(self) -> str:
        """Say over which time samples were averaged before this look; empty where none were."""
        return f' in means over {1e3 * self.means_s:.3g} ms' if self.means_s else ''

    def amounts(self) -> str:
        """Return structure and noise for people."""
        amounts = f'{_um(self.structure_m)} of structure over {_um(self.noise_m)} of noise'
        return amounts + self.averaged

    def problem(self) -> str | None:
        """Return why the intervals do not hold, and what to do; None where they do."""
        if self.intervals_hold:
            return None
        run = DIAGNOSE
        if self.setup is not None:
            told = f'{self.amounts()}: intervals do not hold; {self.setup.sentence()}, or {run}'
        elif self.other_fits:
            other = self.other_hold
            told = (
                f'{self.amounts()}: intervals do not hold; the command seems to run '
                f'{_RUNS[other]}: with --hold {other} {_um(self.other_rms_m)} are left instead of '
                f'{_um(self.rms_m)}. Check how it ran, or {run}'
            )
        else:
            told = f'{self.amounts()}: intervals do not hold; {run}'
        if self.command_rms_m < self.rms_m:
            told += (
                f'. The command itself is nearer to what was measured ({_um(self.command_rms_m)}) '
                'than the model'
            )
        return told


def _um(size: float) -> str:
    return f'{round(1e6 * size, 3):.3g} um'


def residual_structure(
    records: Sequence[Record],
    initial: Initial,
    settle: float,
    structure: Structure,
    theta: Array,
) -> ResidualStructure | None:
    """Check the residual of a model's best fit; None where a record is too short.

    Args:
        records: as they were fitted.
        initial: state at each record's first sample.
        settle: uncounted start of each record [s].
        structure: the model.
        theta: its parameters near the best fit, SI units, (p,).
    """
    data = _data(records, initial, settle)
    if min(int(mask.sum()) for mask in data.masks) < _FEWEST:
        return None
    found = fit(data, structure, theta)
    hold = records[0].hold
    others = data.with_setup(hold=_OTHER[hold])
    other = _refitted(others, structure, found.theta)
    noise = float(np.sqrt(np.mean(_noise(data, structure, found))))
    # The noise is one sensor's: with a misfit, more passes for noise.
    if other.rms < found.rms:
        noise = min(noise, float(np.sqrt(np.mean(_noise(others, structure, other)))))
    nearer, near = (others, other) if other.rms < found.rms else (data, found)
    scorer = Scorer.of(nearer, splits_of(nearer, near.error))
    left = float(np.sqrt(max(found.rms**2 - noise**2, 0.0)))
    stroke = scale(data.records, found.theta).stroke
    short = sum(part.stop - part.start for part in data.parts) * min(data.periods) < _SHORT
    matters = least_material(2.0 * noise if short else noise, stroke)
    setup = None
    if left >= matters:
        setup = hold_and_stiffness.find(data)
    return ResidualStructure(
        structure_m=left,
        noise_m=noise,
        matters_m=matters,
        rms_m=found.rms,
        command_rms_m=_command_rms(data),
        hold=hold,
        other_hold=_OTHER[hold],
        other_rms_m=other.rms,
        nats=evidence(scorer.block_scores(other), scorer.block_scores(found)),
        nats_needed=NATS,
        setup=setup,
        means_s=max(
            (r.period for r, n in zip(data.records, data.factors, strict=True) if n > 1),
            default=0.0,
        ),
    )


def _data(records: Sequence[Record], initial: Initial, settle: float) -> Data:
    """Return records at the rate they need, as a diagnosis fits them."""
    every = tuple(decimate.decimated(r, decimate.factor(r)) for r in records)
    masks = tuple(np.arange(len(r)) >= round(settle / r.period) for r in every)
    count = len(every)
    return Data(every, masks, (initial,) * count, tuple(records), (0.0,) * count)


def _refitted(data: Data, structure: Structure, theta: Array) -> Fit:
    """Return the best fit from parameters of another set-up, or from anywhere."""
    if structure.effects:
        return fit(data, structure, theta)
    anywhere = base_fit(data)
    near = fit(data, structure, theta)
    return near if near.rms < anywhere.rms else anywhere


def _noise(data: Data, structure: Structure, found: Fit) -> Array:
    """Return the noise's mean square of each counted sample's record, (N,) [m^2].

    A white residual is noise. For any other that seems to be noise, a forecast of stretches that
    were not fitted gives an upper bound of the noise.
    """
    splits = splits_of(data, found.error)
    sizes = [part.stop - part.start for part in data.parts]
    noise = np.array([s.noise for s in splits])
    worth = effective_size(
        [found.error[p] for p in data.parts], [found.jacobian_of(p) for p in data.parts]
    )
    if worth < _WHITE * found.error.size and not _plain(found, noise, sizes):
        scorer = Scorer.of(data, splits)
        most = forecast.noise(forecast.Features(data, found.theta[:4]), scorer, found, NATS)
        noise = np.minimum(noise, most)
    return np.repeat(noise**2, sizes)


def _plain(found: Fit, noise: Array, sizes: Sequence[int]) -> bool:
    """Whether the spectrogram alone shows that more than noise is left."""
    mean = float(np.average(noise**2, weights=sizes))
    return rms(found.error) ** 2 - mean >= (2.0 * NOISE_SHARE) ** 2 * mean


def _command_rms(data: Data) -> float:
    commands = [r.command[m] for r, m in zip(data.records, data.masks, strict=True)]
    return rms(data.target - np.concatenate(commands))
