"""Motions that are no displacement in metres: an angle, counts of an encoder, volts, percent.

Inside a record they stand where metres do: one degree, one volt and one percent as a millimetre,
one count as a micrometre. Nothing in the model minds as long as there is no specimen, whose
stiffness joins metres to newtons. This is the one place that knows it, and that turns texts for
people from millimetres into what they measured.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

METRES = 'm'
# By unit of a file: the motion it is one of, and what one of it is inside [m].
MOTIONS: dict[str, tuple[str, float]] = {
    **dict.fromkeys(('deg', '°', 'degree', 'degrees'), ('deg', 1e-3)),
    'rad': ('deg', 57.29577951308232e-3),
    'mrad': ('deg', 57.29577951308232e-6),
    **dict.fromkeys(('rev', 'turn', 'turns'), ('deg', 0.36)),
    **dict.fromkeys(('count', 'counts', 'cnt', 'inc'), ('counts', 1e-6)),
    **dict.fromkeys(('V', 'volt', 'volts'), ('V', 1e-3)),
    'mV': ('V', 1e-6),
    'mA': ('mA', 1e-3),
    '%': ('%', 1e-3),
}
# The unit of a motion in which files are written, as columns are named.
WRITTEN = {'deg': 'deg', 'counts': 'counts', 'V': 'V', 'mA': 'mA', '%': '%'}
# Forces of an angle.
TORQUES = {'Nm': 1.0, 'kNm': 1e3}
_SAID: dict[str, dict[str, str]] = {
    'deg': {'um': 'mdeg', 'mm': 'deg', 'm': 'kdeg', 'N': 'Nm', 'kN': 'kNm'},
    'counts': {'um': 'counts', 'mm': 'kcounts', 'm': 'Mcounts'},
    'V': {'um': 'mV', 'mm': 'V', 'm': 'kV'},
    'mA': {'um': 'uA', 'mm': 'mA', 'm': 'A'},
    '%': {'um': '0.001 %', 'mm': '%', 'm': '1000 %'},
}
# A unit as it stands in texts: behind a number or a bracket, or over and under another one; never
# a part of a word, of a name or of a path.
_UNIT = re.compile(
    r'(?<![\w.\-\\])(?<!\w/)(?P<plain>um|mm|kN)(?![\w.]\w|\w|-\w|/(?!s\b|kN|N\b|m\b|\(|\$|\\))'
    r'|^(?P<alone>m|N)(?=$|/[a-z(])'
    r'|(?<=\d )(?P<metres>m|N)(?![\w/]|\.\w)'
    r'|(?<=[(\[>])(?P<inside>m|N)(?=[\])/ <])'
    r'|(?<=N/)(?P<under>mm|m)\b|(?<=N/\()(?P<braced>mm|m)\b'
    r'|(?<=\d )(?P<over>m|N)(?=/(s|m|N)\b)|(?<=1/)(?P<inverse>mm|m)\b'
)
_SPEAKING: ContextVar[str] = ContextVar('motion', default=METRES)


@contextmanager
def speaking(motion: str) -> Iterator[None]:
    """Let `spoken` say sizes in the units of a motion while this context lasts."""
    token = _SPEAKING.set(motion)
    try:
        yield
    finally:
        _SPEAKING.reset(token)


def speak(motion: str) -> None:
    """Let `spoken` say sizes in the units of a motion from here on, in this process or context."""
    _SPEAKING.set(motion)


def spoken_of() -> str:
    """Return the motion that `spoken` takes where none is given."""
    return _SPEAKING.get()


def spoken(text: str, motion: str | None = None) -> str:
    """Return a text in which sizes of a motion have its own units.

    Args:
        text: with um, mm, m, N and kN.
        motion: which one; None for that of `speak` and `speaking`, metres where nobody has said.
    """
    words = _SAID.get(_SPEAKING.get() if motion is None else motion)
    if words is None:
        return text
    return _UNIT.sub(lambda match: words.get(match[0], match[0]), text)
