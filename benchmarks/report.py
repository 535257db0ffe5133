"""bench.json as a table for people and as one picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

from actuator_glue.report import style

Result = dict[str, Any]
# What the speed of our sampler is made of: key, name and setting of its rows.
VARIANTS = (
    ('move_off', 'actuator_glue, that move switched off', '64 chains; 20 per evaluation'),
    (
        'importance',
        'importance sampling from the Student t of that move',
        'fitted to 1000 posterior draws that are not counted',
    ),
)


def _number(value: float | None) -> str:
    return '-' if value is None else f'{value:,.0f}' if value >= 100 else f'{value:.3g}'


def table(found: Result) -> str:
    """Return the results as Markdown; '-' is 'not reached' or 'not run'."""
    lines: list[str] = []
    problem = found.get('problem_r')
    if problem:
        ours = problem['ours']
        lines += [
            '## Problem R, one core, side by side, seconds of processor time',
            '',
            '| sampler | ESS/s | ours / theirs | ESS per 1000 evaluations | evaluations to '
            'R-hat 1.01 | ESS/s with lfilter | setting |',
            '|---|---|---|---|---|---|---|',
            '| actuator_glue, DREAM(ZS) with an adaptive independence move | '
            f'{_number(ours["ess_per_second"])} | 1 | '
            f'{_number(ours["ess_per_1000_evaluations"])} | '
            f'{_number(ours["evaluations_to_rhat_1p01"])} | | {ours["setting"]} |',
        ]
        for key, name, setting in VARIANTS:
            lines.append(
                f'| {name} | {_number(ours[key]["ess_per_second"])} | '
                f'{_number(ours["ess_per_second"] / ours[key]["ess_per_second"])} | '
                f'{_number(ours[key]["ess_per_1000_evaluations"])} | | | {setting} |'
            )
        for name, peer in problem['peers'].items():
            if 'error' in peer:
                lines.append(f'| {name} | did not run: {peer["error"]} | | | | | |')
                continue
            ratio = ours['ess_per_second'] / peer['ess_per_second']
            lines.append(
                f'| {name} {peer["version"]} | {_number(peer["ess_per_second"])} | '
                f'{_number(ratio)} | {_number(peer["ess_per_1000_evaluations"])} | '
                f'{_number(peer["evaluations_to_rhat_1p01"])} | '
                f'{_number(peer["lfilter"]["ess_per_second"])} | {peer["setting"]} |'
            )
        lines += [
            '',
            'Peers get this project\'s fast likelihood where it suits them better ("ESS/s"), '
            'start from the posterior for ESS/s and from the prior for evaluations to R-hat 1.01 '
            '("-": the median run did not within its budget). Ours counts its start and burn-in '
            f'in everything. Medians of {ours["runs"]} runs each. Converged is the first length '
            'at which the last half of the chains has R-hat 1.01 and lies at the reference '
            'posterior.',
            '',
        ]
    for title, key in (
        ('Likelihood of problem R', 'likelihood'),
        ('Kernel, per theta and sample', 'kernel'),
        ('Online, 10 s window at 1 kHz', 'online'),
        ('Diagnosis, three minutes at 1 kHz', 'diagnosis'),
        ('First use', 'first_use'),
    ):
        rows = {k: v for k, v in found.get(key, {}).items() if isinstance(v, int | float)}
        if not rows:
            continue
        lines += [f'## {title}', '', '| figure | value |', '|---|---|']
        lines += [f'| {name} | {value:.4g} |' for name, value in rows.items()]
        lines.append('')
    for part, why in found.get('failed', {}).items():
        lines.append(f'**{part} did not run**: {why}')
    return '\n'.join(lines) + '\n'


@style.styled
def picture(found: Result, path: Path) -> None:
    """Draw ESS per second, cost against window length and cost against number of effects."""
    figure = style.new_figure(3.2, 10.0)
    axes = figure.subplots(1, 3)
    _samplers(axes[0], found)
    _lengths(axes[1], found)
    _effects(axes[2], found)
    style.save(figure, path)


def _samplers(axes: Axes, found: Result) -> None:
    problem = found.get('problem_r')
    if not problem:
        axes.set_axis_off()
        return
    rates = {'actuator_glue': problem['ours']['ess_per_second']} | {
        name: peer['ess_per_second']
        for name, peer in problem['peers'].items()
        if 'error' not in peer
    }
    names = sorted(rates, key=rates.__getitem__)
    axes.barh(names, [rates[name] for name in names])
    axes.set_xscale('log')
    axes.set_xlabel('effective draws per processor second')
    axes.set_title('Problem R, one core')


def _lengths(axes: Axes, found: Result) -> None:
    rows = found.get('likelihood', {}).get('against_length')
    if not rows:
        axes.set_axis_off()
        return
    samples = [row['samples'] for row in rows]
    for key, name in (('lfilter_us', 'lfilter'), ('exact_us', 'exact'), ('fast_us', 'fast')):
        axes.loglog(samples, [row[key] for row in rows], marker='o', label=name)
    axes.set_xlabel('samples')
    axes.set_ylabel('one likelihood [µs]')
    axes.set_title('Cost against window length')
    axes.legend()


def _effects(axes: Axes, found: Result) -> None:
    rows = found.get('kernel', {}).get('against_effects')
    if not rows:
        axes.set_axis_off()
        return
    axes.plot([row['effects'] for row in rows], [row['ns'] for row in rows], marker='o')
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel('effects switched on')
    axes.set_ylabel('per theta and sample [ns]')
    axes.set_title('Cost against effects')
