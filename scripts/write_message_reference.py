"""Write docs/messages_reference.md from the interface texts; `--check` only compares."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / 'docs' / 'messages_reference.md'
HEAD = """# Fields of messages, services and actions

What each field holds and in which unit; [messages](messages.md) says who publishes what, and how
to publish samples.

<!-- Everything below is written by scripts/write_message_reference.py -->

"""
PARTS = {'msg': [''], 'srv': ['Request', 'Response'], 'action': ['Goal', 'Result', 'Feedback']}


def rows(text: str) -> list[str]:
    """Return the table rows of one part of an interface."""
    table = []
    for line in text.splitlines():
        declaration, _, comment = line.partition('#')
        words = declaration.split()
        if '=' in declaration:
            kind, assignment = declaration.split(maxsplit=1)
            name, value = (part.strip() for part in assignment.split('='))
            table.append(f'| `{name}` | `{kind}` | | constant {value} |')
        elif words:
            kind, name, *default = words
            unit, meaning = re.match(r'\s*(?:\[([^]]*)\] )?(.*)', comment).groups()
            unit = '' if unit in (None, '-') else unit
            meaning += f'; default {default[0]}' if default else ''
            table.append(f'| `{name}` | `{kind}` | {unit} | {meaning} |')
    return table


def section(path: Path) -> str:
    """Return the section of one interface."""
    head, fields = [], path.read_text(encoding='utf-8').splitlines()
    while fields and fields[0].startswith('#'):
        head.append(fields.pop(0).removeprefix('#').strip())
    lines = [f'## {path.stem}', '', *head]
    parts = '\n'.join(fields).split('\n---\n')
    for title, part in zip(PARTS[path.suffix[1:]], parts, strict=True):
        lines += ['', *([f'**{title}**', ''] if title else [])]
        lines += ['| field | type | unit | meaning |', '|---|---|---|---|', *rows(part)]
    return '\n'.join(lines) + '\n'


def page() -> str:
    """Return the whole page."""
    interfaces = [p for kind in PARTS for p in sorted((ROOT / 'msg_defs' / kind).glob('*'))]
    return HEAD + '\n'.join(section(path) for path in interfaces)


if __name__ == '__main__':
    if '--check' in sys.argv:
        sys.exit(not PAGE.exists() or page() != PAGE.read_text(encoding='utf-8'))
    PAGE.write_text(page(), encoding='utf-8')
