"""How a result is shown at a prompt and in a notebook."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from actuator_glue.report import html


class Shown(ABC):
    """Something that says what it holds in a few blocks.

    Attributes:
        more: where what a prompt has no room for is found.
    """

    __slots__ = ()
    more: ClassVar[str] = '`to_json()` has them, `report(path)` shows them'

    @abstractmethod
    def brief(self) -> list[html.Block]:
        """Return what came out, and what limits it, in text and tables."""

    def __repr__(self) -> str:
        """Return what came out in a few lines, without arrays."""
        from actuator_glue.report.as_text import as_text

        return as_text(self.brief(), self.more)

    def _repr_html_(self) -> str:
        """Return what came out, for notebooks."""
        from actuator_glue.report import html

        return html.fragment(self.brief())
