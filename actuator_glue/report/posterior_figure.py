"""A posterior as a picture: each parameter's distribution and each pair of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from actuator_glue.errors import InputError
from actuator_glue.records import Array
from actuator_glue.report import style


@style.styled
def posterior_figure(draws: Array, names: Sequence[str], units: Sequence[str]) -> Figure:
    """Draw the marginal of every parameter and the joint density of every pair.

    The number in the upper half is the correlation of the pair.

    Args:
        draws: posterior draws, shape (m, p), SI units.
        names: parameter of each column, length p.
        units: their units, length p.

    Raises:
        InputError: draws of another shape, or not finite.
    """
    draws, count = np.asarray(draws, dtype=np.float64), len(names)
    if draws.ndim != 2 or draws.shape[1] != count or len(units) != count:
        raise InputError(f'draws of shape {draws.shape} for {count} parameters')
    if not np.isfinite(draws).all():
        raise InputError('the draws have NaN or infinite values')
    exponents = [style.engineering(column) for column in draws.T]
    draws = draws / 10.0 ** np.array(exponents)
    texts = [style.label(*each) for each in zip(names, units, exponents, strict=True)]
    figure = style.new_figure(1.2 + 1.5 * count)
    grid = figure.subplots(count, count, sharex='col', squeeze=False)
    with np.errstate(invalid='ignore', divide='ignore'):
        correlation = np.atleast_2d(np.corrcoef(draws, rowvar=False))
    for i in range(count):
        for j in range(count):
            axes = grid[i, j]
            axes.set_yticks([])
            axes.locator_params(axis='x', nbins=3)
            axes.grid(visible=False)
            if i == j:
                axes.hist(draws[:, i], bins=50, color=style.BAND, histtype='stepfilled')
            elif i > j:
                axes.hexbin(draws[:, j], draws[:, i], gridsize=30, cmap='Blues', mincnt=1, lw=0)
            else:
                axes.text(
                    0.5, 0.5, f'{correlation[i, j]:.2f}', transform=axes.transAxes, ha='center'
                )
                axes.spines[:].set_visible(False)
                axes.tick_params(axis='x', length=0)
            if i == count - 1:
                axes.set_xlabel(texts[j])
            if j == 0 and i > 0:
                axes.set_ylabel(texts[i])
    return figure
