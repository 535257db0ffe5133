"""What to do next, in sentences for people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.learned.term import is_learned
from actuator_glue.diagnosis.posterior.agreement import Homogeneity
from actuator_glue.diagnosis.posterior.posterior import RHAT
from actuator_glue.diagnosis.score.surrogate import Surrogate
from actuator_glue.diagnosis.search.fitting_verdict import Decision
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.telling.next_experiment import Experiment
from actuator_glue.diagnosis.thresholds import TIE_NATS
from actuator_glue.diagnosis.verdict.held_out import HeldOutError
from actuator_glue.diagnosis.verdict.rules import excuse, misses
from actuator_glue.inference.at_bound import Pressed
from actuator_glue.inference.convergence import APART
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.json_value import Json
from actuator_glue.model.effects import CATALOGUE


def _where(row: Json) -> str:
    """Say where one record's unexplained residual lies: frequency, amplitude and time."""
    f, x, t = row['frequency_hz'], row['displacement'], row['time_s']
    band = f'{f[0]:g} to {f[1]:g} Hz' if f else 'no one frequency'
    return (
        f'{row["source"]}: the rest sits at {band}, displacements of '
        f'{1e3 * x[0]:.2g} to {1e3 * x[1]:.2g} mm and {t[0]:g} to {t[1]:g} s '
        f'(middle 80 %), {100 * row["share_at_low_velocity"]:.0f} % of it in the slow half'
    )


def ended(effort: Effort) -> tuple[str, ...]:
    """Say that a search ended at its effort, before it had tried all that was promising."""
    if not effort.over:
        return ()
    return (
        f'the search ended at its effort, {effort.spent / 1e6:.0f} million sub-steps: what was '
        'known by then is told, and more effort (`--effort 3`) may replace it or add to it',
    )


def of(
    decision: Decision,
    remaining: Json,
    found: Selection,
    generic: Surrogate,
    stretches: dict[str, Homogeneity],
    experiments: Sequence[Experiment],
) -> tuple[str, ...]:
    """Advice for a decision.

    Args:
        decision: the verdict on the fitting part.
        remaining: where its residual lies (telling/remaining.py).
        found: effects with a mean response.
        generic: a generic regression to compare them with.
        stretches: sizes of each effect in halves of the records.
        experiments: tests that tell tied names apart, best first.
    """
    out = []
    entries = {e.name: e for e in found.final.structure.entries}
    for name in found.final.effects:
        tied = [r.name for r in found.rivals[name] if r.tied and r.name != name]
        if tied:
            out.append(f'{name} cannot be told from {", ".join(tied)} here')
        out += [
            f'{r.name}, which is {name} at {r.limit[0]} = {_neutral(r.name):g}, is not excluded: '
            f'{r.limit[0]} may be as far as {r.limit[1]:.3g} (95 %)'
            for r in found.rivals[name]
            if r.limit and r.tied
        ]
        if stretches[name].agree is False:
            sizes = ', '.join(f'{v:.3g}' for v in stretches[name].values)
            unit = entries[name].parameters[0].unit
            out.append(
                f'{name} does not agree across the halves of the records ({sizes} {unit}): its '
                'size changes with time, frequency or stiffness, or it stands for something else'
            )
    out += _nearest(found)
    out += _next(experiments)
    if found.final.own is not None:
        out.append(
            f'{found.final.added} does not act in all records: that channel may have been set '
            'differently between these tests; check its setting, or diagnose them apart'
        )
    if decision.verdict == 'unexplained':
        best = found.singles[0].added if found.singles else ''
        nearest = (
            'the additions may stand for something that the catalogue does not hold'
            if found.final.effects
            else f'closest in the catalogue, not enough: {best}'
        )
        out.append(
            f'{1e6 * decision.left:.1f} um of structure remain '
            f'(limit {1e6 * decision.limit:.1f}); {nearest}; look where `remaining` points, '
            'and record the force channel and a second amplitude'
        )
        out += [_where(row) for row in remaining['records']]
        out.append(
            f'a generic regression on {len(generic.features)} features of the motion '
            f'({", ".join(generic.features)}) leaves {1e6 * generic.error:.1f} um out of sample, '
            f'{" + ".join(generic.structure)} {1e6 * generic.structure_error:.1f} um; '
            + (
                f'in the loop it looks like the {generic.place}'
                if generic.place
                else 'it follows no simple function of the motion, at no one place in the loop'
            )
        )
    if decision.verdict == 'none' and decision.left > 0.0:
        out.append(
            f'{1e6 * decision.left:.1f} um of structure are less than a model may leave '
            f'({1e6 * decision.limit:.1f} um)'
        )
    return tuple(out)


def _neutral(richer: str) -> float:
    """Parameter value at which a richer form reduces to the simpler effect."""
    holds = CATALOGUE[richer].holds
    return holds[2] if holds else 0.0


def _nearest(found: Selection) -> list[str]:
    """Say which name comes nearest to each learned term."""
    out, left = [], found.final.fit.rms
    for entry in found.final.structure.entries:
        name = entry.name
        if is_learned(entry):
            named = [r for r in found.rivals[name] if r.name in CATALOGUE]
            for r in sorted(named, key=lambda r: r.excess)[:1]:
                out.append(
                    f'the name nearest to {name} is {r.name}, which leaves '
                    f'{1e6 * float(np.hypot(left, r.excess)):.1f} um in its place instead of '
                    f'{1e6 * left:.1f} um'
                )
    return out


def _next(experiments: Sequence[Experiment]) -> list[str]:
    """Say which test would tell tied names apart, and what the least telling one would bring."""
    if not experiments:
        return []
    best, last = experiments[0], experiments[-1]
    if best.nats < TIE_NATS:
        return [f'no test of the menu would tell tied names apart; the best is {best.sentence()}']
    return [f'to tell tied names apart record {best.sentence()}; least telling: {last.sentence()}']


def unidentified(data: Data, estimates: dict[str, Estimate]) -> tuple[str, ...]:
    """Say which parameters the records do not fix: their posterior is that of the bounds."""
    loose = {n: e for n, e in estimates.items() if not e.identified and e.bounds}
    if not loose:
        return ()
    names = ', '.join(
        f'{n} (bounds {e.bounds[0]:g} to {e.bounds[1]:g} {e.unit})'
        for n, e in loose.items()
        if e.bounds
    )
    free = all(r.known_stiffness() == 0.0 for r in data.records)
    more = (
        '; without specimen only beta_1 and alpha_1_beta_0/alpha_2 are identified: add a record '
        'with a known specimen stiffness'
        if free
        else ''
    )
    return (f'not identified by these records, their spread is that of the bounds: {names}{more}',)


def unconverged(rhat: float) -> tuple[str, ...]:
    """Warn where the chains of the posterior have not converged; NaN gives no warning."""
    if not rhat > RHAT:
        return ()
    if rhat <= APART:
        return (
            f'the chains of the posterior have nearly met (R-hat {rhat:.2f}): intervals may be '
            f'{100.0 * (rhat - 1.0):.0f} % too narrow or too wide',
        )
    return (
        f'the chains of the posterior have not met (R-hat {rhat:.2f}): intervals are widened by '
        'as much, and names of effects that may then be nothing have a lower probability; errors '
        'do not depend on them',
    )


def contradicted(error: HeldOutError, material: float) -> tuple[str, ...]:
    """Warn where the held-out part shows materially more than noise; say what it may be."""
    if not misses(error, material, error.after):
        return ()
    found = excuse(error, material)
    why = found.sentence() if found else 'it may show what the fitting records do not'
    return (
        f'the held-out part leaves {1e6 * error.after:.1f} um where '
        f'{1e6 * error.noise_floor:.1f} um are noise: {why}; add a record '
        'like it to them',
    )


def zeros(error: HeldOutError, material: float, called: Mapping[str, str]) -> tuple[str, ...]:
    """Name the held-out records whose own zero (offset and drift) matters.

    Args:
        error: of the held-out part.
        material: rms error that matters [m].
        called: what people read as the name of each record.
    """
    return tuple(
        f'{called[source]}: {1e6 * after:.1f} um are left, {1e6 * left:.1f} um without the '
        'offset and the drift of its own zero, which no other record tells'
        for (source, _, after), left in zip(error.records, error.zeros, strict=True)
        if after**2 - left**2 > material**2
    )


def at_bound(found: Sequence[Pressed], estimates: dict[str, Estimate]) -> tuple[str, ...]:
    """Name the parameters pressed against a bound, which sets their mean and spread."""
    return tuple(
        f'{p.name} is pressed against the {p.side} bound {p.bound:g} '
        f'{estimates[p.name].unit} of its range: its size is that of the bound, and the records '
        'ask for something else'
        for p in found
        if not p.physical
    )
