"""Draw docs/images/structures.png: what a diagnosis has tried, for one record and for two."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

import actuator_glue as ag
from actuator_glue.report import style

PICTURE = Path(__file__).resolve().parent.parent / 'docs' / 'images' / 'structures.png'
TRUE = 'viscous-damping'
SHOWN = 8
TOLD = 0.02  # a smaller probability gets no number
TICKS = (10, 20, 50, 100)


def records() -> list[ag.Record]:
    """Return tests of one damped actuator: with a specimen, without one, a held-out earthquake."""
    damped = {TRUE: {'damping': 8e3}}
    sweep, earthquake = (
        ag.Command(rate=200.0, duration=30.0),
        ag.Command('earthquake', 200.0, 20.0),
    )
    tests = ((sweep, 250e3), (sweep, 0.0), (earthquake, 250e3))
    return [
        ag.simulate(command, stiffness=k, effects=damped, seed=(7, i))
        for i, (command, k) in enumerate(tests)
    ]


def draw(axes: Axes, found: ag.Diagnosis, title: str) -> None:
    """Draw one diagnosis, a row each for Eq. (2) and what leaves least beside it."""
    tried = sorted(found.candidates, key=lambda c: c.error)[:SHOWN]
    (effect,) = found.effects
    probability = {rival.name: rival.probability for rival in effect.rivals}
    names = [*(c.name for c in tried), 'Eq. (2) alone']
    errors = 1e6 * np.array([*(c.error for c in tried), effect.error_without])
    noise = 1e6 * found.error.noise_floor
    rows = np.arange(len(names))
    shares = [probability.get(name, 0.0) for name in names]
    colours = [style.BAND if share > TOLD else style.COMMAND for share in shares]
    axes.scatter(errors, rows, c=colours, zorder=3)
    axes.axvline(noise, color=style.TOTAL, linestyle='--')
    axes.text(noise, -0.9, ' noise', color=style.TOTAL, va='center')
    for row, error, share in zip(rows, errors, shares, strict=True):
        if share > TOLD:
            axes.text(1.15 * error, row, f'{100 * share:.0f} %', va='center', color=style.BAND)
    axes.set_yticks(rows, [f'+ {name}' for name in names[:-1]] + names[-1:])
    axes.set(
        xscale='log', xlim=(8.5, 190.0), xlabel=r'error that is left (rms, $\mu$m)', title=title
    )
    axes.set_xticks(TICKS, [str(tick) for tick in TICKS])
    axes.minorticks_off()
    axes.set_ylim(len(names) - 0.5, -1.4)


@style.styled
def picture() -> None:
    """Diagnose and draw."""
    clamped, free, earthquake = records()
    figure = style.new_figure(3.2)
    left, right = figure.subplots(1, 2)
    draw(left, ag.diagnose([clamped], holdout=earthquake), 'one record, k = 250 kN/m')
    draw(right, ag.diagnose([clamped, free], holdout=earthquake), 'the same and one with k = 0')
    style.save(figure, PICTURE)


if __name__ == '__main__':
    picture()
