"""A change has a fragment of one line; what they become is a changelog that catkin reads."""

import re
import tomllib
from pathlib import Path

from catkin_pkg.changelog import Changelog, populate_changelog_from_rst

import actuator_glue

ROOT = Path(__file__).resolve().parent.parent
NEWS = tomllib.loads((ROOT / 'pyproject.toml').read_text(encoding='utf-8'))['tool']['towncrier']
KINDS = {kind['directory']: kind['name'] for kind in NEWS['type']}
FRAGMENTS = sorted(p for p in (ROOT / NEWS['directory']).iterdir() if p.name not in NEWS['ignore'])
CHANGELOG = ROOT / NEWS['filename']


def faults(name: str, text: str) -> list[str]:
    """Return what is wrong with a fragment."""
    found = []
    if not re.fullmatch(rf'[\w-]+\.({"|".join(KINDS)})\.md', name):
        found.append(f'{name}: <short-name>.<{"|".join(KINDS)}>.md is wanted')
    if text.count('\n') != 1 or not text.endswith('.\n') or text[0] in '-* \n':
        found.append(f'{name}: one line that ends with a full stop is wanted')
    return found


def test_a_fragment_is_one_line_of_a_kind_that_is_known() -> None:
    """So that the changelog is no diary."""
    assert not [f for p in FRAGMENTS for f in faults(p.name, p.read_text(encoding='utf-8'))]


def test_what_a_fragment_must_not_be() -> None:
    """Two lines, a list, no end, another kind."""
    assert faults('a-b.fixed.md', 'It is mended.\n') == []
    for text in ('One.\nTwo.\n', '* One.\n', 'One\n', 'One.', '\n'):
        assert len(faults('a.fixed.md', text)) == 1
    for name in ('a.mended.md', 'a.md', 'a.fixed', 'a b.fixed.md'):
        assert len(faults(name, 'One.\n')) == 1


def test_catkin_reads_the_changelog() -> None:
    """One item a line, each of a kind that is known, of every version and of what comes next."""
    text = CHANGELOG.read_text(encoding='utf-8')
    # As `catkin_prepare_release` names what is not released.
    coming = text.replace(
        'Forthcoming\n-----------\n', '99.0.0 (2099-01-01)\n-------------------\n'
    )
    changelog = populate_changelog_from_rst(Changelog('actuator_glue'), coming)
    contents = {version: content for version, _, content in changelog.foreach_version()}
    assert set(contents) >= {'99.0.0', actuator_glue.__version__}
    items = [str(item) for content in contents.values() for part in content for item in part]
    lines = [line for line in text.splitlines() if line.startswith('*')]
    assert len(items) == len(lines)
    assert not [line for line in text.splitlines() if line.startswith(' ')]
    assert all(re.match(f'({"|".join(KINDS.values())}): ', item) for item in items)


def test_new_lines_have_a_place() -> None:
    """They are put behind this mark, which stands below what is not released."""
    text = CHANGELOG.read_text(encoding='utf-8')
    assert re.search(r'^Forthcoming\n-----------\n\n\.\. news\n', text, re.M)
    assert text.count(NEWS['start_string']) == 1
