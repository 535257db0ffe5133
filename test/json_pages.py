"""What docs/json*.md say of the objects that commands write, and whether an object is so."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent.parent / 'docs'
PAGES = sorted(DOCS.glob('json*.md'))
_LINK = re.compile(r'\[[^]]*\]\([^)#]*#([\w-]+)\)')
_NULL = ' or null'


def _number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _text(value: object) -> bool:
    return isinstance(value, str)


def _list(of: Any, count: int | None = None) -> Any:
    return lambda v: (
        isinstance(v, list) and all(map(of, v)) and (count is None or len(v) in (0, count))
    )


# A word of the column `type`, and what makes a value one.
TYPES = {
    'text': _text,
    'number': _number,
    'whole number': lambda v: _number(v) and isinstance(v, int),
    'true/false': lambda v: isinstance(v, bool),
    'text or whole number': lambda v: _text(v) or (_number(v) and isinstance(v, int)),
    'texts': _list(_text),
    'numbers': _list(_number),
    '2 numbers': _list(_number, 2),
    '3 numbers': _list(_number, 3),
    '2 numbers or nulls': _list(lambda v: v is None or _number(v), 2),
    'first day, last day, days': lambda v: [type(x) for x in v] == [str, str, int],
    'object': lambda v: isinstance(v, dict),
}


@dataclass
class Row:
    """One row of a table.

    Attributes:
        place: page section and field.
        kind: what its column `type` says.
        optional: the field may be left out.
        seen: some object had it, and not as null alone.
    """

    place: str
    kind: str
    optional: bool
    seen: bool = False


@dataclass
class Node:
    """What may stand at a place of an object: fields by name, or the entries of a list."""

    row: Row | None = None
    fields: dict[str, Node] = field(default_factory=dict)
    entries: Node | None = None

    def below(self, step: str) -> Node:
        """Return the node of a step of a path: a name, or `[]`."""
        if step == '[]':
            self.entries = self.entries or Node()
            return self.entries
        return self.fields.setdefault(step, Node())

    def field(self, name: str) -> Node | None:
        """Return the field of a name: the one that is called so, or one whose name varies."""
        if name in self.fields:
            return self.fields[name]
        for pattern, node in self.fields.items():
            parts = re.split(r'<[^>]*>', pattern)
            if len(parts) > 1 and re.fullmatch('.+'.join(map(re.escape, parts)), name):
                return node
        return None

    def rows(self) -> Iterator[Row]:
        """Yield the rows here and below."""
        if self.row is not None:
            yield self.row
        for node in (*self.fields.values(), *([self.entries] if self.entries else [])):
            yield from node.rows()

    @property
    def optional(self) -> bool:
        """Whether every object may lack it: no row below says otherwise before a list."""
        if self.row is not None:
            return self.row.optional
        first = next(iter([*self.fields.values(), *([self.entries] if self.entries else [])]))
        return first.optional


class JsonPages:
    """All tables of the pages, by the anchor of their section.

    Attributes:
        sections: tree of each section's fields.
        schemas: anchor of each schema.
    """

    def __init__(self) -> None:
        self.sections: dict[str, Node] = {}
        self.schemas: dict[str, str] = {}
        for page in PAGES:
            for part in re.split(r'^#+ ', page.read_text('utf-8'), flags=re.MULTILINE)[1:]:
                title, _, text = part.partition('\n')
                self._read(title.strip().lower().replace(' ', '-'), text)

    def _read(self, anchor: str, text: str) -> None:
        lines = [line for line in text.splitlines() if line.startswith('| `')]
        if '| field | type | unit | meaning |' not in text:
            return
        assert anchor not in self.sections, f'two sections are called {anchor}'
        root = self.sections[anchor] = Node()
        for line in lines:
            name, kind, _, meaning = _cells(line)
            path = name.strip('`')
            node = root
            for step in re.findall(r'\[\]|(?:<[^>]*>|[^.\[<])+', path):
                node = node.below(step)
            assert node.row is None, f'{anchor}: {path} stands twice'
            node.row = Row(f'{anchor}: {path}', kind, meaning.startswith('only'))
            if path == 'schema':
                self.schemas[meaning.strip('`')] = anchor

    def check(self, content: dict[str, Any]) -> list[str]:
        """Return what of an object is not as the pages say, and mark what they say truly."""
        return list(self._check(content, self.sections[self.schemas[content['schema']]], '$'))

    def _check(self, value: Any, node: Node, where: str) -> Iterator[str]:
        row = node.row
        kind = '' if row is None else row.kind
        if row is not None and value is None:
            if not kind.endswith(_NULL):
                yield f'{where}: null, and {row.place} says {kind}'
            return
        if row is not None:
            row.seen = True
        kind = kind.removesuffix(_NULL)
        link = _LINK.fullmatch(kind)
        if link is not None:
            yield from self._check(value, self.sections[link[1]], where)
            return
        if kind and not TYPES[kind](value):
            yield f'{where}: {str(value)[:80]} is no {kind}'
        if isinstance(value, list) and node.entries is not None:
            for i, entry in enumerate(value):
                yield from self._check(entry, node.entries, f'{where}[{i}]')
        elif isinstance(value, dict) and node.fields:
            for name, entry in value.items():
                below = node.field(name)
                if below is None:
                    yield f'{where}.{name}: no table has it'
                else:
                    yield from self._check(entry, below, f'{where}.{name}')
            for name, below in node.fields.items():
                if '<' not in name and name not in value and not below.optional:
                    yield f'{where}.{name}: a table has it, the object has not'
        elif not kind:
            yield f'{where}: {str(value)[:80]} is neither an object nor a list'

    def unseen(self, *schemas: str) -> list[str]:
        """Return the rows of schemas, and of what they link to, that no object had."""
        left, reached = [self.schemas[f'actuator_glue.{name}/1'] for name in schemas], set()
        rows: list[Row] = []
        while left:
            anchor = left.pop()
            if anchor not in reached:
                reached.add(anchor)
                rows += (found := [*self.sections[anchor].rows()])
                left += [link[1] for row in found if (link := _LINK.match(row.kind))]
        return [row.place for row in rows if not row.seen]


def _cells(line: str) -> list[str]:
    """Return the four cells of a row, some of which are empty."""
    cells = [cell.strip() for cell in line.strip()[1:-1].split('|')]
    assert len(cells) == 4, line
    return cells
