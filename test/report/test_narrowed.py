"""Figures laid out anew for a phone: as wide as it, every panel named, in the order of reading."""

from __future__ import annotations

import pytest

from actuator_glue.report import style


@style.styled
def drawn(rows: int, columns: int, *, titles: str):
    """Return a figure whose panels have titles in the first row alone, or each its own."""
    figure = style.new_figure(2.0 * rows)
    panels = figure.subplots(rows, columns, squeeze=False, sharey='row')
    for i, row in enumerate(panels):
        for j, axes in enumerate(row):
            axes.plot([0.0, 1.0], [i, j], label='measured')
            if titles == 'each' or i == 0:
                axes.set_title(f'{i}{j}')
        row[0].set_ylabel(f'row {i} [mm]')
    names = ['measured', 'a band with a long name', 'another band with a long name']
    lines = [axes.lines[0] for axes in figure.axes[:3]]
    figure.legend(lines, names[: len(lines)], loc='outside lower center', ncols=3)
    return figure


@pytest.mark.parametrize(
    ('rows', 'columns', 'titles', 'order'),
    [
        (2, 2, 'each', ['row 0', 'row 0', 'row 1', 'row 1']),
        (2, 2, 'first', ['row 0', 'row 1', 'row 0', 'row 1']),
        (2, 3, 'first', ['row 0', 'row 1', 'row 0', 'row 1', 'row 0', 'row 1']),
        (3, 1, 'each', ['row 0', 'row 1', 'row 2']),
    ],
)
def test_panels_stand_one_below_the_other(
    rows: int, columns: int, titles: str, order: list[str], overlapping_texts
) -> None:
    """Row by row, or column by column where columns have titles; all name what they show."""
    figure = drawn(rows, columns, titles=titles)
    assert style.narrowed(figure)
    assert figure.get_size_inches().tolist() == [style.NARROW, 2.0 * rows * columns]
    figure.canvas.draw()
    below = sorted(figure.axes, key=lambda axes: -axes.get_position().y0)
    assert [axes.get_ylabel() for axes in below] == [f'{name} [mm]' for name in order]
    assert len({round(axes.get_position().x0, 3) for axes in below}) == 1
    for axes in below:
        assert any(label.get_visible() and label.get_text() for label in axes.get_yticklabels())
    assert overlapping_texts(figure) == []
    (legend,) = figure.legends
    assert legend.get_window_extent().width <= figure.bbox.width


def test_a_matrix_of_panels_stays_one() -> None:
    """Every pair of three: nothing of the figure is changed."""
    figure = drawn(3, 3, titles='each')
    assert not style.narrowed(figure)
    assert figure.get_size_inches().tolist() == [style.WIDTH, 6.0]
