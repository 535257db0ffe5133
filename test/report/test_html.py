"""The one-file HTML report."""

import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest
from markupsafe import Markup
from matplotlib.figure import Figure

from actuator_glue.errors import InputError
from actuator_glue.report.html import (
    Note,
    Page,
    Picture,
    Section,
    Table,
    Text,
    fragment,
    render,
    write,
)


class Checker(HTMLParser):
    """Collects references, and fails on tags that do not close."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []

    def handle_starttag(self, tag, attrs) -> None:
        if tag not in ('meta', 'img', 'br'):
            self.open.append(tag)
        self.references += [v for k, v in attrs if k in ('src', 'href')]

    def handle_endtag(self, tag) -> None:
        assert self.open.pop() == tag


def test_page_is_whole_numbered_and_self_contained(tmp_path) -> None:
    picture = Picture.of(Figure(figsize=(1, 1)), 'A figure')
    sections = [
        Section('First', [Text('a < b & c'), Table(('x', 'y'), [(1, 'two')], 'A table'), picture]),
        Section('Second', [Note('found'), Text(Markup('<b>bold</b>')), picture]),
    ]
    path = write(tmp_path / 'deep' / 'report.html', Page('Title', 'Lead', sections, 'seed 3'))
    page = path.read_text(encoding='utf-8')
    checker = Checker()
    checker.feed(page)
    assert not checker.open
    assert all(r.startswith(('data:image/png;base64,', '#')) for r in checker.references)
    assert not re.search(r'https?://|<script|@import', page)
    assert 'a &lt; b &amp; c' in page
    assert '<b>bold</b>' in page
    assert 'Figure 2.' in page and 'Table 1.' in page and 'seed 3' in page


def test_ragged_table_is_refused() -> None:
    with pytest.raises(ValueError, match='as long as the header'):
        render(Page('T', 'L', [Section('S', [Table(('a', 'b'), [(1,)], 'c')])]))


def test_a_page_that_cannot_be_written_is_one_clear_error(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    with pytest.raises(InputError, match='cannot be written'):
        write(tmp_path / 'file' / 'page.html', Page('T', 'L', []))


CHROMIUM = next(filter(None, map(shutil.which, ('chromium', 'chromium-browser', 'chrome'))), None)
MEASURE = """<script>addEventListener('load', () => { document.title = [
  innerWidth, document.documentElement.scrollWidth,
  getComputedStyle(document.querySelector('td')).display,
  document.querySelector('img').clientWidth].join(' '); })</script></html>"""


def title_of(path: Path, window: int) -> str:
    """The title that a page gives itself, in a window so wide [px]."""
    dom = subprocess.run(
        [
            str(CHROMIUM),
            *['--headless=new', '--no-sandbox', '--disable-gpu', '--virtual-time-budget=2000'],
            f'--user-data-dir={path.with_name(str(window))}',
            f'--window-size={window},900',
            '--dump-dom',
            path.as_uri(),
        ],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    ).stdout
    return str(re.findall(r'<title>(.*?)</title>', dom)[0])


@pytest.mark.skipif(CHROMIUM is None, reason='no browser')
def test_a_phone_shows_the_page_in_its_width(tmp_path: Path) -> None:
    """Long names break, wide tables scroll alone, pictures fit, rows of text are stacked."""
    picture = Picture.of(Figure(figsize=(7.2, 2)), 'A figure')
    wide = Table([f'column {i}' for i in range(12)], [range(12)], 'A wide table')
    prose = Table(('parameter', 'before', 'after'), [('a', 'b ' * 40, 'x' * 80)], 'T', prose=True)
    page = Page('T' * 60, 'a_long_name' * 9, [Section('S', [prose, picture, wide])])
    path = tmp_path / 'page.html'
    path.write_text(render(page).replace('</html>', MEASURE))
    for window, stacked in ((390, True), (1200, False)):
        inner, width, display, image = title_of(path, window).split()
        assert int(width) <= int(inner)
        assert display == ('grid' if stacked and int(inner) <= 640 else 'table-cell')
        assert int(image) <= int(inner)
        assert stacked or int(image) >= 600


@pytest.mark.skipif(CHROMIUM is None, reason='no browser')
def test_a_table_in_a_notebook_keeps_its_columns_apart(tmp_path: Path) -> None:
    """Whatever the page around it says of tables; numbers stand at the right."""
    look = '<style>td, th { padding: 0; text-align: left; }</style>'
    asked = """<script>addEventListener('load', () => {
      const cell = getComputedStyle(document.querySelector('td:last-child'));
      document.title = [cell.textAlign, parseFloat(cell.paddingLeft)].join(' '); })</script>"""
    table = fragment([Table(('number', 'median'), [('delay', '31.4')], 'T')])
    path = tmp_path / 'page.html'
    path.write_text(f'<!DOCTYPE html><html>{look}{table}{asked}</html>')
    side, room = title_of(path, 1200).split()
    assert side == 'right' and float(room) > 5.0


@pytest.mark.parametrize('name', ['page.pdf', 'page.DOCX', 'page.png'])
def test_a_report_is_not_called_another_format(tmp_path: Path, name: str) -> None:
    """No program would open it; the command says so before it computes."""
    with pytest.raises(InputError, match=r'name that ends in \.html'):
        write(tmp_path / name, Page('a', 'b', ()))
    for good in ('page.html', 'page.htm', 'page', 'report 2026.11.29'):
        assert write(tmp_path / good, Page('a', 'b', ())).is_file()
