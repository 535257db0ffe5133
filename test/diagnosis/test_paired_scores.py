"""Answers of two commits about the same machines are held against each other."""

import copy
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

EFFECT: dict[str, Any] = {
    'name': 'backlash',
    'alternatives': [],
    'probability': 0.95,
    'none_of_these': 0.05,
    'noise': None,
    'parameters': {},
}


@pytest.fixture
def paired(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return the script, which imports its neighbours."""
    blind = Path(__file__).parents[2] / 'benchmarks' / 'blind'
    monkeypatch.syspath_prepend(str(blind))
    return import_module('paired')


def answer(seed: int, *, right: bool, commit: str) -> dict[str, Any]:
    """A machine with play whose answer names it, or friction."""
    effect = EFFECT | {'name': 'backlash' if right else 'coulomb-friction'}
    return {
        'generator': 'cases',
        'seed': seed,
        'commit': commit,
        'kind': 'single',
        'effects': ['backlash'],
        'ratio': 3.0,
        'parameters': {},
        'processor_seconds': 10.0 if right else 20.0,
        'clean_floor': 1e-5,
        'diagnosis': {
            'verdict': 'missing-effect',
            'complete': False,
            'effects': [effect],
            'error': {'after': 1e-5 if right else 2e-5},
            'base': {},
        },
    }


def side(commit: str, right: int, of: int) -> list[dict[str, Any]]:
    """Answers of one commit, so many of them right."""
    return [answer(seed, right=seed < right, commit=commit) for seed in range(of)]


def test_what_is_worse_beyond_chance_is_told(paired: ModuleType) -> None:
    """Six of twelve names that got lost are no chance (one in 32); two are (one in two)."""
    before = side('aaaaaaa', 12, 12)
    text, worse = paired.page(paired.pairs(before, side('bbbbbbb', 6, 12)))
    assert worse
    row = next(r for r in text.splitlines() if 'the first name is right' in r)
    assert '12 of 12' in row and '6 of 12' in row and '| 6, 0 | 0.03 |' in row
    assert 'commit aaaaaaa and by commit bbbbbbb' in text
    assert '6 machines worse by more than 5%' in text
    _, worse = paired.page(paired.pairs(before, side('bbbbbbb', 10, 12)))
    assert not worse
    _, worse = paired.page(paired.pairs(side('bbbbbbb', 6, 12), before))
    assert not worse  # better


def test_only_the_same_machines_are_compared(paired: ModuleType) -> None:
    """By generator and seed; answers of several commits have no side."""
    before, after = side('aaaaaaa', 4, 4), side('bbbbbbb', 4, 6)[2:]
    assert [b['seed'] for b, _ in paired.pairs(before, after)] == [2, 3]
    left = paired.pairs(before, after, ['cases:2'])
    assert [b['seed'] for b, _ in left] == [3]
    assert 'mended on them: cases:2.' in paired.page(left, ['cases:2'])[0]
    other = copy.deepcopy(after)
    for one in other:
        one['generator'] = 'far'
    with pytest.raises(SystemExit, match='no machine is in both'):
        paired.pairs(before, other)
    with pytest.raises(SystemExit, match='several commits: aaaaaaa, bbbbbbb'):
        paired.pairs(before + after, before)
