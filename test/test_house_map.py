"""The map of the house names what is there."""

import runpy
from pathlib import Path

import actuator_glue

ROOT = Path(actuator_glue.__file__).resolve().parent.parent
HOUSE = runpy.run_path(str(ROOT / 'scripts' / 'write_house_map.py'))


def test_every_question_has_a_file() -> None:
    """A file that has moved would send readers nowhere."""
    for _, file in HOUSE['QUESTIONS']:
        assert (HOUSE['PACKAGE'] / file).is_file(), file
    folders = {p.parent.name for p in HOUSE['PACKAGE'].glob('*/__init__.py')}
    assert folders == set(HOUSE['ROOMS'])
    rooms = {p.parent.name for p in HOUSE['PACKAGE'].glob('diagnosis/*/__init__.py')}
    assert rooms == set(HOUSE['DIAGNOSIS'])


def test_the_page_is_of_these_files() -> None:
    """Names and first paragraphs; how long files are may have changed since `make docs`."""

    def without_numbers(page: str) -> list[str]:
        return [line.rstrip(' |0123456789') for line in page.splitlines()]

    written = HOUSE['PAGE'].read_text(encoding='utf-8')
    assert without_numbers(written) == without_numbers(HOUSE['page']()), 'run make docs'
