"""The name of a report: one HTML file, which no program opens under the name of another format."""

from __future__ import annotations

from pathlib import Path

from actuator_glue.errors import InputError
from actuator_glue.given import path as given_path

# What people ask for where a report is to be printed or sent.
_OTHERS = {'.pdf', '.doc', '.docx', '.odt', '.md', '.png', '.svg', '.jpg', '.jpeg'}


def page_path(path: Path | str) -> Path:
    """Return the path of a report; asked before the page is made, which takes seconds.

    Raises:
        InputError: no path, or its suffix is that of another kind of document, or of a picture.
    """
    path = given_path(path)
    suffix = path.suffix
    if suffix.lower() in _OTHERS:
        raise InputError(
            f'{path}: a report is one HTML file, no {suffix}; give a name that ends in .html (a '
            'browser prints it, also as PDF)'
        )
    return path
