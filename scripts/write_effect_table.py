"""Renew the tables of the effect catalogue in docs/ from its entries (`make docs`)."""

from __future__ import annotations

from pathlib import Path

from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.parameters import Parameter

DOCS = Path(__file__).resolve().parent.parent / 'docs'
PAGE, REMEDIES = DOCS / 'effects_catalogue.md', DOCS / 'remedies.md'
BEGIN, END = '<!-- catalogue: begin (make docs) -->', '<!-- catalogue: end -->'


def _parameter(p: Parameter) -> str:
    unit = '' if p.unit == '1' else f' {p.unit}'
    return f'`{p.name}` {p.meaning}: {p.lower:g} .. {p.upper:g}{unit}, neutral {p.neutral:g}'


def markdown() -> str:
    """Return the table, one row per effect, from the entries themselves."""
    rows = [
        '| effect | place | equation | parameters: bounds, neutral value | group | signature '
        '| source |',
        '|---|---|---|---|---|---|---|',
    ]
    for effect in CATALOGUE.values():
        parameters = '<br>'.join(_parameter(p) for p in effect.parameters)
        cells = (
            f'`{effect.name}`',
            effect.place,
            effect.equation,
            parameters,
            effect.group,
            effect.signature,
            effect.source,
        )
        rows.append('| ' + ' | '.join(cell.replace('|', '\\|') for cell in cells) + ' |')
    kept = ', '.join(f'`{e.name}`' for e in CATALOGUE.values() if not e.searched)
    reserved = ', '.join(f'`{e.name}`' for e in CATALOGUE.values() if e.reserved)
    last = f'tried only where all others leave material structure: {reserved}'
    rows += ['', f'Not tried by the diagnosis: {kept}; {last}.']
    return '\n'.join(rows)


def remedies() -> str:
    """Return what each effect is to a mechanic and what to do about it, one row per effect."""
    rows = ['| effect | what it is | what to do |', '|---|---|---|']
    rows += [f'| `{e.name}` | {e.meaning} | {e.remedy} |' for e in CATALOGUE.values()]
    return '\n'.join(rows)


def renewed(page: str, table: str) -> str:
    """Return a page with the table between its marks replaced by another.

    Raises:
        ValueError: the page lacks a mark.
    """
    head, found, rest = page.partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not found or not end:
        raise ValueError(f'the page lacks {BEGIN!r} or {END!r}')
    return f'{head}{BEGIN}\n{table}\n{END}{tail}'


if __name__ == '__main__':
    for page, table in ((PAGE, markdown()), (REMEDIES, remedies())):
        page.write_text(renewed(page.read_text(encoding='utf-8'), table), encoding='utf-8')
