"""What to do next, in sentences for people."""

from __future__ import annotations

from actuator_glue.model.effects import CATALOGUE
from actuator_glue.residual.attribute import Attribution
from actuator_glue.residual.data import Data
from actuator_glue.residual.decide import Decision

# The experiment that separates two groups of effects (issue: second amplitude, down-sweep, ...).
_EXPERIMENT = {
    'lag': 'a sweep to a higher frequency (a delay does not roll off, a lag does)',
    'offset': 'a record with leakage to feel it: high stiffness held at a constant offset',
    'lost-motion': 'a second amplitude (0.5 mm): play keeps its width',
    'friction': 'a slow triangle wave at a second amplitude; the force channel shows it directly',
    'gain': 'a second specimen stiffness, and a static step',
    'flow-time': 'a down-sweep: time and frequency then run against each other',
}
_OTHERWISE = 'a second amplitude, a down-sweep or a record with another specimen stiffness'


def of(decision: Decision, found: Attribution, data: Data) -> tuple[str, ...]:
    """Advice for a decision."""
    out = []
    for name in decision.names:
        tied = [r.name for r in found.rivals[name] if r.tied and r.name != name]
        if tied:
            group = CATALOGUE[name].group
            same = all(CATALOGUE[t].group == group for t in tied)
            way = _EXPERIMENT.get(group, _OTHERWISE) if same else _OTHERWISE
            out.append(f'{name} cannot be told from {", ".join(tied)} here; record {way}')
    if decision.verdict == 'unexplained':
        best = found.singles[0].added if found.singles else ''
        out.append(
            f'{1e6 * decision.left:.1f} um of structure remain '
            f'(limit {1e6 * decision.limit:.1f}); '
            f'closest in the catalogue, not enough: {best}; look where `remaining` points, '
            'and record the force channel and a second amplitude'
        )
    if decision.verdict == 'none' and found.structure > 0.0:
        out.append(
            f'structure of {1e6 * found.structure:.1f} um is immaterial '
            f'(threshold {1e6 * found.material:.1f} um)'
        )
    if all(r.known_stiffness() == 0.0 for r in data.records):
        out.append(
            'all records are without specimen: only beta_1 and alpha_1_beta_0/alpha_2 are '
            'identified; add a record with a known specimen stiffness'
        )
    return tuple(out)
