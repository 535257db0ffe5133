"""The name of a report: one HTML file, which no program opens under the name of another format."""

from __future__ import annotations

from pathlib import Path

from actuator_glue.errors import InputError

# What people ask for where a report is to be printed or sent.
_OTHERS = {'.pdf', '.doc', '.docx', '.odt', '.md', '.png', '.svg', '.jpg', '.jpeg'}


def check_page_name(path: Path | str) -> None:
    """Refuse a name that says another format.

    Raises:
        InputError: the suffix is that of another kind of document, or of a picture.
    """
    suffix = Path(path).suffix
    if suffix.lower() in _OTHERS:
        raise InputError(
            f'{path}: a report is one HTML file, no {suffix}; give a name that ends in .html (a '
            'browser prints it, also as PDF)'
        )
