"""What every result can do: be written and read, reported, shown in a notebook."""

from __future__ import annotations

from abc import abstractmethod
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from actuator_glue.api import store
from actuator_glue.api.shown import Shown
from actuator_glue.motion import METRES, speaking, spoken

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from actuator_glue.report import html


class Result(Shown):
    """A result: a dataclass that says what it holds in a few blocks, a figure and a page.

    Attributes:
        schema: name and version of its JSON object and of its file.
    """

    __slots__ = ()
    schema: ClassVar[str]

    @property
    def model_effects(self) -> tuple[str, ...]:
        """Effects of its model, whose definitions go along where they are the user's own."""
        return ()

    @property
    def motion(self) -> str:
        """What its records measure: 'm', or 'deg', 'counts' and so on, which texts speak in."""
        sources = getattr(self, 'sources', ())
        return sources[0].motion if sources else METRES

    @abstractmethod
    def to_json(self) -> dict[str, Any]:
        """Return the object of its schema (draws and curves left out)."""

    @abstractmethod
    def plot(self) -> Figure:
        """Return the figure that shows it best."""

    @abstractmethod
    def page(self) -> html.Page:
        """Return its report."""

    def save(self, path: Path | str) -> Path:
        """Write everything to one .npz file, nothing of it pickled; return its path.

        Raises:
            InputError: the file cannot be written.
        """
        return store.save(path, self.schema, self, self.model_effects)

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Return what `save` wrote.

        Raises:
            InputError: the file cannot be read, or holds something else.
        """
        return store.load(path, cls.schema, cls)

    def report(self, path: Path | str) -> Path:
        """Write a report, one HTML file, and return its path.

        Raises:
            InputError: the file cannot be written.
        """
        from actuator_glue.report import html
        from actuator_glue.report.page_name import page_path

        with speaking(self.motion):
            return html.write(page_path(path), self.page())

    def __repr__(self) -> str:
        """Return what came out in a few lines, in the unit of its motion."""
        return spoken(super().__repr__(), self.motion)

    def _repr_html_(self) -> str:
        """Return what came out for notebooks, in the unit of its motion."""
        with speaking(self.motion):
            return super()._repr_html_()
