"""The first page: who it is for, what to type, what comes of it; numbers that are counted."""

import re
from pathlib import Path

from actuator_glue.model.effects import CATALOGUE

ROOT = Path(__file__).resolve().parent.parent
TEXT = (ROOT / 'README.md').read_text(encoding='utf-8')


def test_number_of_effects_is_that_of_what_is_searched() -> None:
    """One number, counted, wherever a page names it."""
    searched = sum(entry.searched for entry in CATALOGUE.values())
    pages = [ROOT / 'README.md', *(ROOT / 'docs').rglob('*.md')]
    told = {
        (page.name, int(number))
        for page in pages
        for number in re.findall(r'\bof (\d+) effects\b', page.read_text(encoding='utf-8'))
    }
    assert ('README.md', searched) in told
    assert {number for _, number in told} == {searched}


def test_first_things_first() -> None:
    """Laboratories in the first paragraph; two commands and the tutorial above the pictures.

    These are of one run: what was found, and how sure it was while the test went on.
    """
    paragraph = TEXT.split('\n\n')[1]
    assert 'laboratories' in paragraph
    picture = TEXT.index('![')
    places = [TEXT.index(w) for w in ('calibrate free.csv', 'diagnose free.csv', 'tutorial.md')]
    assert places == sorted(places) and places[-1] < picture
    assert re.findall(r'!\[.*\]\(docs/images/(\w+)', TEXT) == [
        'demo_diagnosis',
        'demo_explanations',
    ]


def test_each_kind_of_reader_has_a_page() -> None:
    """Below 1500 words, linked from here, with commands or code that are tested."""
    for reader in ('test_engineers', 'ros_engineers', 'statisticians'):
        page = ROOT / 'docs' / f'for_{reader}.md'
        text = page.read_text(encoding='utf-8')
        assert len(text.split()) < 1500
        assert f'docs/{page.name}' in TEXT
        assert '```sh\n' in text or '```python\n' in text
