"""No module imports one that imports it, however far around: each can be read by itself."""

import ast
from functools import cache
from pathlib import Path

import pytest

import actuator_glue

ROOT = Path(actuator_glue.__file__).resolve().parent
# Elsewhere are some: the language of effects, pairs that were one file, a result and its figures.
FOLDERS = sorted(
    p.name
    for p in ROOT.iterdir()
    if (p / '__init__.py').exists() and p.name not in ('model', 'nodes', 'campaigns')
)


def called(path: Path) -> str:
    """Return the name of a module."""
    name = '.'.join(('actuator_glue', *path.relative_to(ROOT).with_suffix('').parts))
    return name.removesuffix('.__init__')


MODULES = {called(path): path for path in ROOT.rglob('*.py')}


@cache
def imported(module: str) -> frozenset[str]:
    """Return the modules of the package that one imports, wherever in its text."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(MODULES[module].read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f'{node.module}.{alias.name}' for alias in node.names)}
    return frozenset(names & set(MODULES)) - {module, 'actuator_glue'}


def around(module: str) -> bool:
    """Whether what a module imports comes back to it."""
    seen: set[str] = set()
    waiting = set(imported(module))
    while waiting:
        one = waiting.pop()
        seen.add(one)
        waiting |= imported(one) - seen
    return module in seen


@pytest.mark.parametrize('folder', FOLDERS)
def test_no_circles(folder: str) -> None:
    """Lazily or for types alone is a circle, too."""
    own = [m for m in MODULES if m.split('.')[1:2] == [folder]]
    assert own
    assert [m for m in own if around(m)] == []
