"""Random numbers of tests can be drawn again: seeds are written down or printed."""

import ast
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent
SOURCES = sorted(TESTS.rglob('*.py'))
# What takes its seed from the system where none is given.
SEEDED = {'default_rng', 'SeedSequence', 'PCG64', 'RandomState', 'Random'}


def unseeded(text: str) -> list[int]:
    """Return the lines where a generator is made without a seed."""
    return [
        node.lineno
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call)
        and ast.unparse(node.func).rpartition('.')[2] in SEEDED
        and not [
            a for a in (*node.args, *node.keywords) if ast.unparse(a) not in ('None', 'seed=None')
        ]
    ]


@pytest.mark.parametrize('path', SOURCES, ids=lambda p: str(p.relative_to(TESTS)))
def test_every_generator_has_a_seed(path: Path) -> None:
    """A run that failed can be repeated."""
    found = unseeded(path.read_text(encoding='utf-8'))
    # The fixture `rng_seed` draws a seed there, and prints it.
    expected = 1 if path == TESTS / 'conftest.py' else 0
    assert len(found) == expected, f'{path.name}: use the fixture `rng_seed` in lines {found}'


def test_what_has_no_seed_is_seen() -> None:
    """Whatever it is called by."""
    text = 'a = np.random.default_rng()\nb = default_rng(None)\nc = SeedSequence(seed=None)\n'
    assert unseeded(text) == [1, 2, 3]
    assert not unseeded(
        'a = np.random.default_rng(1)\nb = Random(seed)\nc = default_rng(seed=n)\n'
    )
