"""Write docs/fields_of_*.md from the interface texts; `--check` only compares."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / 'docs'
HEAD = """# Fields: {title}

What each field holds and in which unit; [messages](messages.md) says who publishes what, and how
to publish samples. Other fields: {others}.

<!-- Everything below is written by scripts/write_message_reference.py -->

"""
# Page, and the interfaces on it: by what they are about, as one looks for them.
PAGES = {
    'samples': ('SampleBlock', 'TestSetup', 'CommandPreview', 'TrackingIndicators'),
    'estimates': (
        'PosteriorMoments',
        'PosteriorDraws',
        'PredictionBand',
        'FrequencyResponseBand',
        'EstimatorSetup',
        'StabilityMargin',
    ),
    'diagnosis': ('Diagnosis', 'Effect', 'Candidate', 'Diagnose', 'ModelProposal', 'SetModel'),
}
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


def page(title: str) -> str:
    """Return one page."""
    files = {p.stem: p for kind in PARTS for p in (ROOT / 'msg_defs' / kind).glob('*')}
    missing = set(files) - {name for names in PAGES.values() for name in names}
    if missing:
        raise SystemExit(f'{", ".join(sorted(missing))}: on no page of PAGES in {__file__}')
    others = ', '.join(f'[{name}](fields_of_{name}.md)' for name in PAGES if name != title)
    sections = '\n'.join(section(files[name]) for name in PAGES[title])
    return HEAD.format(title=title, others=others) + sections


def file(title: str) -> Path:
    """Return where a page is."""
    return DOCS / f'fields_of_{title}.md'


if __name__ == '__main__':
    if '--check' in sys.argv:
        sys.exit(any(not file(t).exists() or page(t) != file(t).read_text('utf-8') for t in PAGES))
    for name in PAGES:
        file(name).write_text(page(name), encoding='utf-8')
