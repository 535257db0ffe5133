"""Actuators with an effect that nobody declared: predictions before and after its diagnosis."""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from shutil import copy
from typing import TYPE_CHECKING

import numpy as np

import actuator_glue as ag
from studies.hybrid import actuators, library
from studies.hybrid.actuators import Actuator
from studies.hybrid.page import write_between
from studies.hybrid.trial import BOUNDS, inside, predict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Eq. (2) with the benchmark's numbers, its second-order valve and its moving mass left out.
THETA = (235.3, 5.012e10, 4.23e6, 3.3)

HELD = 0.8  # share of a response in its 95 % band from which the band is taken for right
RATE, DURATION = 128.0, 20.0  # of a pre-test [Hz, s]
EVALUATIONS = 60_000


@dataclass(frozen=True, slots=True)
class Hidden:
    """An effect that the laboratory does not know of.

    Attributes:
        effect, parameter, value: of the catalogue, SI units.
        damping: ratio of the structure whose hybrid test it is.
    """

    effect: str
    parameter: str
    value: float
    damping: float


CASES = {
    'lag': Hidden('delay', 'delay', 10e-3, 0.11),
    'play': Hidden('backlash', 'backlash', 8e-5, 0.079),
    'saturation': Hidden('flow-saturation', 'saturation_velocity', 0.035, 0.08),
}


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """What a model says of the hybrid test.

    Attributes:
        effects: of the model, beyond Eq. (2).
        calibration: of it.
        stability: what `rths` says of that.
        inside: share of the true response in its 95 % band; None without one of both.
    """

    effects: tuple[str, ...]
    calibration: ag.Calibration
    stability: ag.StabilityResult
    inside: float | None

    def to_json(self) -> dict[str, object]:
        """Return what a table needs."""
        return {
            'effects': list(self.effects),
            'p_unstable': asdict(self.stability.p_unstable),
            'inside': self.inside,
        }


@dataclass(frozen=True, slots=True, eq=False)
class Story:
    """An actuator, what was predicted of its hybrid test, and what happened.

    Attributes:
        case: key of CASES.
        actuator: what nobody knows.
        before: prediction with Eq. (2) alone.
        diagnosis: of the pre-tests.
        after: prediction with what it found.
        run: its hybrid test.
    """

    case: str
    actuator: Actuator
    before: Prediction
    diagnosis: ag.Diagnosis
    after: Prediction
    run: library.Responses

    @property
    def unstable(self) -> bool:
        """Whether a root of its hybrid test grows; with nonlinear effects, whether it diverges."""
        if library.Structure(self.actuator.effects).linear:
            return self.actuator.grows()
        return bool(self.run.diverged[0])

    def right(self, said: Prediction) -> bool:
        """Whether a prediction has the more likely side right, and its band holds the response."""
        likely = said.stability.p_unstable.value >= 0.5
        return likely == self.unstable and (said.inside or 0.0) >= HELD


def actuator(case: str, seed: int) -> Actuator:
    """Return the actuator of a case."""
    hidden, test = CASES[case], actuators.damped(CASES[case].damping)
    specimen = test.specimen.drawn(np.random.default_rng(library.stream(seed, 'specimen')), 1)
    theta = np.array([*THETA, hidden.value])
    return Actuator(seed, theta, (hidden.effect,), specimen, test)


def story(case: str, seed: int = 1) -> Story:
    """Predict, diagnose, predict again, run."""
    own = actuator(case, seed)
    records, run = own.records(RATE, DURATION), own.run()
    before = prediction(own, records, (), run)
    found = ag.diagnose(records, seed=seed)
    return Story(case, own, before, found, prediction(own, records, found.structure, run), run)


def prediction(
    own: Actuator,
    records: list[ag.Record],
    effects: tuple[str, ...],
    run: library.Responses,
    evaluations: int = EVALUATIONS,
) -> Prediction:
    """Calibrate a model with these effects and return what it says of the actuator's own test."""
    names = library.Structure(effects).names
    found = ag.calibrate(
        records,
        effects=effects,
        bounds={name: pair for name, pair in BOUNDS.items() if name in names},
        likelihood='gaussian',
        evaluations=evaluations,
    )
    predicted = predict(own, found)
    return Prediction(effects, found, predicted, inside(run, predicted))


def table(stories: list[Story]) -> str:
    """Return what the stories say for a page, in Markdown."""
    lines = [
        '| nobody declared | found | P(unstable) before, after | in band before, after | was |',
        '|---|---|---|---|---|',
    ]
    for one in stories:
        hidden, sides = CASES[one.case], (one.before, one.after)
        shares = ', '.join(f'{s.stability.p_unstable.value:.3f}' for s in sides)
        inside = ', '.join('-' if s.inside is None else f'{100 * s.inside:.0f} %' for s in sides)
        lines.append(
            f'| {one.case}: `{hidden.effect}`, {hidden.parameter} = {hidden.value:g} | '
            f'{", ".join(f"`{name}`" for name in one.diagnosis.structure) or "nothing"} | '
            f'{shares} | {inside} | {"unstable" if one.unstable else "stable"} |'
        )
    return '\n'.join([*lines, ''])


@library.style.styled
def figure(stories: list[Story]) -> Figure:
    """Draw the top floor: bands before and after the diagnosis, and what happened."""
    drawn = library.style.new_figure(2.2 * len(stories))
    axes = drawn.subplots(len(stories), 2, squeeze=False, sharex=True)
    for row, one in zip(axes, stories, strict=True):
        sides = (('before', one.before), ('after', one.after))
        for place, (when, side) in zip(row, sides, strict=True):
            virtual = side.stability.virtual
            assert virtual is not None
            band = 1e3 * virtual.lower[:, -1], 1e3 * virtual.upper[:, -1]
            place.fill_between(virtual.time_s, *band, color=library.style.BAND, alpha=0.5, lw=0)
            place.plot(virtual.time_s, 1e3 * one.run.response[:, -1, 0], lw=0.6, color='k')
            share = side.stability.p_unstable.value
            place.set_title(f'{one.case}, {when}: P(unstable) = {share:.2f}')
        row[0].set_ylabel('top floor [mm]')
    for place in axes[-1]:
        place.set_xlabel('time [s]')
    return drawn


def main(argv: list[str] | None = None) -> int:
    """Tell every story; return 0 where each is right after the diagnosis and was not before."""
    parser = argparse.ArgumentParser(
        prog='python -m studies.hybrid.hidden_effects', description=__doc__
    )
    parser.add_argument('--out', default='out/study-rths', metavar='DIR', help='(%(default)s)')
    parser.add_argument(
        '--page', type=Path, metavar='FILE.md', help='also write table and picture into this page'
    )
    args = parser.parse_args(argv)
    out = Path(args.out)
    out.mkdir(parents=True, exist_ok=True)
    told: list[Story] = []
    content: dict[str, object] = {}
    for case, hidden in CASES.items():
        one = story(case)
        told.append(one)
        content[case] = {
            'effect': hidden.effect,
            hidden.parameter: hidden.value,
            'unstable': one.unstable,
            'found': list(one.diagnosis.structure),
            'verdict': one.diagnosis.verdict,
            'before': one.before.to_json() | {'right': one.right(one.before)},
            'after': one.after.to_json() | {'right': one.right(one.after)},
        }
        print(f'{case}: {content[case]}', flush=True)
    library.write_json(
        {'schema': 'studies.hybrid.hidden_effects/1', **content}, str(out / 'undeclared.json')
    )
    library.style.save(figure(told), out / 'undeclared.png')
    print(table(told))
    if args.page is not None:
        write_between(args.page, 'stories', table(told))
        copy(out / 'undeclared.png', args.page.parent / 'images' / 'rths_undeclared.png')
    return 0 if all(one.right(one.after) and not one.right(one.before) for one in told) else 1


if __name__ == '__main__':
    np.seterr(all='ignore')
    sys.exit(main())
