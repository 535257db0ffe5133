"""What the study's figures share: marks, dashes, colours by role, titles."""

from __future__ import annotations

import numpy as np

from actuator_glue.report import style

MARKS = ('o', 's', '^', 'D')
COLOURS = (style.BAND, style.DETERMINISTIC, style.TRUTH, style.WARNING)
DASHES = ('-', '--', '-.', ':')
REFERENCE = (0, (6, 3))  # dashes of a line to compare with


def shaping_title(name: str, factor: float) -> str:
    """Return the title of a panel about one shaping factor."""
    return f'${name}$ = $2^{{{round(np.log2(factor))}}}$'
