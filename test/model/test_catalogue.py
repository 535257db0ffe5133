"""The catalogue: complete, documented, each effect at its place."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

import actuator_glue
from actuator_glue.model.effects import CATALOGUE, scale
from actuator_glue.model.parameters import NAMES, TABLE_2
from actuator_glue.records import Record

PAGE = Path(actuator_glue.__file__).resolve().parent.parent / 'docs' / 'effects_catalogue.md'


PLACES = {
    'command': {'delay', 'lead', 'gain', 'command-lag', 'command-rate'},
    'valve': {
        'valve-lag',
        'valve-deadband',
        'valve-null',
        'valve-hysteresis',
        'valve-rate',
        'valve-underlap',
        'integral-action',
    },
    'flow': {
        'flow-saturation',
        'pressure-flow',
        'flow-asymmetry',
        'supply-droop',
        'gain-drift',
        'accumulator-depletion',
    },
    'piston': {'coulomb-friction', 'stribeck-friction', 'backlash'},
    'specimen': {
        'viscous-damping',
        'payload-inertia',
        'specimen-gap',
        'specimen-hardening',
        'specimen-yield',
        'specimen-relaxation',
        'frame-mode',
    },
    'sensor': {
        'sensor-lag',
        'bias',
        'drift',
        'hum',
        'quantisation',
        'clock-skew',
        'timing-jitter',
        'sensor-curve',
        'sensor-feedback',
    },
}


def test_names_and_places() -> None:
    """The names of the command line, each at its place, in the order of the loop."""
    found: dict[str, set[str]] = {}
    for name, effect in CATALOGUE.items():
        assert effect.name == name
        found.setdefault(effect.place, set()).add(name)
    assert found == PLACES
    assert list(found) == list(PLACES)


def test_entries_are_complete() -> None:
    """Texts, units, bounds that hold the neutral value, starting sizes inside and not neutral."""
    rate = 500.0
    t = np.arange(4000) / rate
    u = 2e-3 * np.minimum(t, 1.0) * np.sin(4.0 * np.pi * t)
    sizes = [scale([Record(u, u, 1.0 / rate, k)], TABLE_2) for k in (0.0, 250e3)]
    seen = set(NAMES)
    for effect in CATALOGUE.values():
        assert effect.equation and effect.signature and effect.source and effect.group
        for told in (effect.meaning, effect.remedy):
            assert len(told.split()) >= 3 and told[-1] != '.'
        lower = np.array([p.lower for p in effect.parameters])
        upper = np.array([p.upper for p in effect.parameters])
        neutral = np.array([p.neutral for p in effect.parameters], dtype=float)
        assert (lower < upper).all() and (lower <= neutral).all() and (neutral <= upper).all()
        for p in effect.parameters:
            assert p.name not in seen and p.unit and p.meaning
            seen.add(p.name)
        for size in sizes:
            starts = np.array(effect.starts(size))
            assert starts.shape[1] == len(effect.parameters)
            assert ((starts >= lower) & (starts <= upper)).all(), effect.name
            assert (starts != neutral).any(axis=1).all(), effect.name


def test_page_is_in_step() -> None:
    """docs/ holds the catalogue's tables; `make docs` renews them."""
    script = runpy.run_path(str(PAGE.parent.parent / 'scripts' / 'write_effect_table.py'))
    markdown, renewed = script['markdown'], script['renewed']
    page = PAGE.read_text(encoding='utf-8')
    assert renewed(page, markdown()) == page
    other = script['REMEDIES'].read_text(encoding='utf-8')
    assert renewed(other, script['remedies']()) == other
    assert markdown().count('\n') == len(CATALOGUE) + 3
    for effect in CATALOGUE.values():
        source = effect.source.split(';')[0].split(' (')[0]
        assert source.split(' et al.')[0].split(' &')[0].split(' 19')[0] in page.split('## Ref')[1]
    with pytest.raises(ValueError, match='lacks'):
        renewed('no marks', '')
