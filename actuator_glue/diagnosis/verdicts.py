"""The possible verdicts."""

from __future__ import annotations

from typing import Literal, TypeAlias

Verdict: TypeAlias = Literal['none', 'missing-effect', 'unexplained', 'undecided']
COMPLETE: tuple[Verdict, ...] = ('none', 'missing-effect')  # leave nothing material
