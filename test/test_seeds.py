"""Random numbers of tests can be drawn again: seeds are written down or printed."""

import ast
from pathlib import Path

TESTS = Path(__file__).resolve().parent
SOURCES = sorted(TESTS.rglob('*.py'))
# What takes its seed from the system where none is given.
SEEDED = {'default_rng', 'SeedSequence', 'PCG64', 'RandomState', 'Random'}


def optional(function: ast.FunctionDef) -> set[str]:
    """Return the parameters of a function that are None where nothing is given."""
    given = function.args
    last = given.args[len(given.args) - len(given.defaults) :]
    both = [*zip(last, given.defaults, strict=True)]
    both += [(a, d) for a, d in zip(given.kwonlyargs, given.kw_defaults, strict=True) if d]
    return {a.arg for a, default in both if ast.unparse(default) == 'None'}


def unseeded(text: str) -> list[int]:
    """Return the lines where a generator is made without a seed, or maybe without one."""
    if not any(name in text for name in SEEDED):
        return []
    tree = ast.parse(text)
    unknown = {}
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef) and (names := optional(function)):
            unknown |= dict.fromkeys(ast.walk(function), names)
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and getattr(node.func, 'attr', getattr(node.func, 'id', '')) in SEEDED
        and not [
            a
            for a in (*node.args, *node.keywords)
            if ast.unparse(a) not in {'None', 'seed=None', *unknown.get(node, ())}
        ]
    ]


def test_every_generator_has_a_seed() -> None:
    """A run that failed can be repeated."""
    found = {path: unseeded(path.read_text(encoding='utf-8')) for path in SOURCES}
    # The fixture `rng_seed` draws a seed there, and prints it.
    assert len(found.pop(TESTS / 'conftest.py')) == 1
    lines = [f'{path.relative_to(TESTS)}:{line}' for path in found for line in found[path]]
    assert not lines, 'use the fixture `rng_seed`'


def test_what_has_no_seed_is_seen() -> None:
    """Whatever it is called by."""
    text = 'a = np.random.default_rng()\nb = default_rng(None)\nc = SeedSequence(seed=None)\n'
    assert unseeded(text) == [1, 2, 3]
    assert not unseeded(
        'a = np.random.default_rng(1)\nb = Random(seed)\nc = default_rng(seed=n)\n'
    )
    for head, wrong in (('a, seed=None', True), ('*, seed=None', True), ('seed=1, b=None', False)):
        text = f'def made({head}):\n    return default_rng(seed)\n'
        assert unseeded(text) == [2] * wrong
