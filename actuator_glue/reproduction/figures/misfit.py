"""The residual of the spring test with and without a static gain."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from actuator_glue.records import Record
from actuator_glue.report import style
from actuator_glue.reproduction.experiment import stiffness_name
from actuator_glue.reproduction.misfit import Refit, by_frequency

UM = 1e6


@style.styled
def residual_by_frequency(
    records: Sequence[Record], refits: Sequence[Refit], noise: float
) -> Figure:
    """Draw the residual's rms against frequency, both tests, for refits to both tests.

    Args:
        records: both tests.
        refits: structures to compare; those fitted to one test only are left out.
        noise: sensor noise [m], drawn as the least a model can leave.
    """
    figure = style.new_figure(3.1)
    panels = figure.subplots(1, 2, sharey=True)
    looks = [
        (style.BAND, 'o-'), (style.DETERMINISTIC, 's--'), (style.TRUTH, '^-.'),
    ]  # fmt: skip
    both = [r for r in refits if len(r.tests) == 2]
    for test, axes in enumerate(panels):
        for refit, (colour, look) in zip(both, looks, strict=True):
            centres, rms = by_frequency(records[test], refit.residual[test])
            name = refit.name.removesuffix(', both tests')
            axes.plot(centres, UM * rms, look, color=colour, label=name)
        axes.axhline(UM * noise, color='black', lw=0.8, ls=(0, (6, 3)), label='sensor noise')
        axes.set(xlabel='frequency [Hz]', xlim=(0, 10), title=stiffness_name(test))
    top = max(
        float(by_frequency(records[t], r.residual[t])[1].max()) for r in both for t in (0, 1)
    )
    panels[0].set_ylim(0, 1.05 * UM * top)
    panels[0].set_ylabel('residual rms [µm]')
    figure.legend(*panels[0].get_legend_handles_labels(), loc='outside lower center', ncols=2)
    return figure
