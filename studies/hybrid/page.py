"""What a study found, written into a page between two marks."""

from __future__ import annotations

from pathlib import Path

from actuator_glue.errors import InputError


def write_between(page: Path, mark: str, text: str) -> None:
    """Replace what stands between `<!-- mark -->` and `<!-- end of mark -->`.

    Raises:
        InputError: the page cannot be read, or lacks the marks.
    """
    first, last = f'<!-- {mark} -->\n', f'<!-- end of {mark} -->'
    try:
        content = page.read_text(encoding='utf-8')
    except OSError as error:
        raise InputError(f'{page} cannot be read ({error})') from error
    if content.count(first) != 1 or content.count(last) != 1:
        raise InputError(
            f'{page} has no place for the {mark}: it needs {first.strip()} and {last}'
        )
    before, rest = content.split(first)
    page.write_text(before + first + text + last + rest.split(last)[1], encoding='utf-8')
