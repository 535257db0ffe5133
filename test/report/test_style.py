"""One style: every figure of package, studies and examples is made by `style.new_figure`."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
STYLE = ROOT / 'actuator_glue' / 'report' / 'style.py'
SOURCES = [
    path
    for folder in ('actuator_glue', 'studies', 'examples', 'benchmarks')
    for path in sorted((ROOT / folder).rglob('*.py'))
    if path != STYLE and 'matplotlib' in path.read_text('utf-8')
]


def called(node: ast.AST) -> set[str]:
    """Return the names of what is called in a piece of source."""
    calls = [n.func for n in ast.walk(node) if isinstance(n, ast.Call)]
    return {ast.unparse(function).rpartition('.')[2] for function in calls}


@pytest.mark.parametrize('path', SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_figures_are_made_in_one_style(path: Path) -> None:
    """Nothing of pyplot, no figure of its own, none outside a `styled` function."""
    tree = ast.parse(path.read_text('utf-8'))
    assert 'pyplot' not in path.read_text('utf-8')
    assert not called(tree) & {'Figure', 'savefig'}
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef) and 'new_figure' in called(function):
            names = {ast.unparse(d).rpartition('.')[2] for d in function.decorator_list}
            assert 'styled' in names, function.name
