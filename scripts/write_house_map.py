"""Renew docs/house.md, the map of the package: rooms, files and what each holds (`make docs`)."""

from __future__ import annotations

import ast
import tokenize
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE, PAGE = ROOT / 'actuator_glue', ROOT / 'docs' / 'house.md'
# Data go down this list.
ROOMS = (
    'io',
    'streams',
    'hygiene',
    'model',
    'inference',
    'online',
    'diagnosis',
    'hybrid',
    'campaigns',
    'workers',
    'report',
    'view',
    'api',
    'nodes',
    'cli',
)
# Rooms of the diagnosis; each knows only those above it (test/test_architecture.py).
DIAGNOSIS = (
    'learned',
    'score',
    'scopes',
    'samples',
    'measured',
    'refits',
    'search',
    'moves',
    'posterior',
    'verdict',
    'telling',
)
# What strangers ask for, and the file that answers.
QUESTIONS = (
    ('swapped channels, a wrong sign or unit are refused', 'hygiene/checks.py'),
    ('impulses are removed before a fit', 'hygiene/impulse_removal.py'),
    ('impulses are judged against the final model', 'diagnosis/samples/final_impulses.py'),
    ('the hold of the command is chosen', 'diagnosis/moves/other_hold.py'),
    ('an effect is found that began during a test', 'diagnosis/moves/since_onset.py'),
    ('a structure is weighed', 'diagnosis/score/weights.py'),
    ('all structures stand that were refitted', 'diagnosis/search/table.py'),
    ('a tie is told', 'diagnosis/search/ties.py'),
    ('the verdict is reached', 'diagnosis/verdict/rules.py'),
    ('the headline is written', 'diagnosis/telling/headline.py'),
    ('a window becomes a posterior', 'online/window_posterior.py'),
    (
        'it is decided when a stream is diagnosed, and what the estimator then carries',
        'online/when_to_diagnose.py',
    ),
    ('records, model and likelihood become a posterior', 'inference/posterior.py'),
    ('one effect is defined, all of it', 'model/effects/catalogue/backlash.py'),
)
HEAD = """# The house

Where things are. `make docs` writes this page from the files themselves; who may import whom is
held by `test/test_architecture.py`, how to add an effect, a format or a command is told in
`CONTRIBUTING.md`.
"""
_CODE = tokenize.NAME, tokenize.OP, tokenize.NUMBER


def first_paragraph(path: Path) -> str:
    """Return what a file says of itself before anything else, on one line."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding='utf-8'))) or ''
    return text.partition('\n\n')[0].replace('\n', ' ').replace('|', '\\|')


@cache
def sizes(path: Path) -> tuple[int, int]:
    """Return the lines of a file: all, and those without docstrings, comments and blanks."""
    with tokenize.open(path) as file:
        tokens = list(tokenize.generate_tokens(file.readline))
    code = {token.start[0] for token in tokens if token.type in _CODE}
    return tokens[-1].start[0] - 1, len(code)


def _total(files: Iterable[Path]) -> tuple[int, int]:
    """Return the lines of several files, as `sizes`."""
    lines, code = map(sum, zip(*map(sizes, files), strict=True))
    return lines, code


def _rooms() -> Iterator[str]:
    yield '| room | what it holds | files | lines | of them code |'
    yield '|---|---|---:|---:|---:|'
    rows = []
    for name in ('', *ROOMS):
        folder = PACKAGE / name
        files = list(folder.rglob('*.py') if name else folder.glob('*.py'))
        lines, code = _total(files)
        says = first_paragraph(folder / '__init__.py') if name else 'What all rooms share.'
        rows.append((len(files), lines, code))
        cells = (f'`{name}/`' if name else '`*.py`', says, *map(str, rows[-1]))
        yield '| ' + ' | '.join(cells) + ' |'
    yield '| all | | ' + ' | '.join(str(sum(row)) for row in zip(*rows, strict=True)) + ' |'


def _files(folder: Path) -> Iterator[str]:
    for path in sorted(folder.glob('*.py')):
        if path.name != '__init__.py':
            yield f'- `{path.name}` ({sizes(path)[0]}): {first_paragraph(path)}'


def _diagnosis() -> Iterator[str]:
    folder = PACKAGE / 'diagnosis'
    yield 'Rooms in the order in which data go through them, each file with its number of lines;'
    yield '`diagnose.py` is the whole in a page.\n'
    yield from _files(folder)
    for name in DIAGNOSIS:
        lines, code = _total((folder / name).glob('*.py'))
        says = first_paragraph(folder / name / '__init__.py')
        yield f'\n### {name}/\n\n{says} {lines} lines, {code} of them code.\n'
        yield from _files(folder / name)


def page() -> str:
    """Return the page."""
    asked = ['| where | file |', '|---|---|', *(f'| {q} | `{f}` |' for q, f in QUESTIONS)]
    parts = (
        HEAD,
        '## Rooms\n',
        *_rooms(),
        '\n## Where to look\n',
        *asked,
        '\n## The diagnosis, room by room\n',
        *_diagnosis(),
    )
    return '\n'.join(parts) + '\n'


if __name__ == '__main__':
    PAGE.write_text(page(), encoding='utf-8')
