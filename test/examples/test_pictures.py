"""What a picture of a run says of it is computed from that run."""

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from actuator_glue.report import estimate_figures, style
from actuator_glue.report.bag_content import read
from examples.demonstration import pictures

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Figures that are saved, kept."""
    kept: list[Figure] = []
    monkeypatch.setattr(style, 'save', lambda figure, path: (kept.append(figure), path)[1])
    return kept


def run(errors: list[float], changed_at: int | None) -> SimpleNamespace:
    """Return a bag of hops of 100 samples; from one window on the model has backlash."""
    bands = [
        SimpleNamespace(
            kind='noise',
            index=100 * i,
            median=np.zeros(100),
            rms_error=error,
            widest_coverage=0.9,
            widest_level=0.95,
        )
        for i, error in enumerate(errors)
    ]
    posteriors = [
        SimpleNamespace(
            index=100 * i,
            samples=100,
            effects=['backlash'] if changed_at is not None and i >= changed_at else [],
        )
        for i in range(len(errors))
    ]
    record = SimpleNamespace(first_index=0, period=1e-3)
    return SimpleNamespace(bands=bands, posteriors=posteriors, record=record)


BETTER = [30e-6, 31e-6, 32e-6, 9e-6, 8e-6, 7e-6]


@pytest.mark.parametrize(
    ('errors', 'changed', 'title'),
    [
        (BETTER, 2, '31.0 um with the first model,\n8.0 um with Eq. (2) + backlash'),
        (BETTER[::-1], 2, '8.0 um with the first model,\n31.0 um with Eq. (2) + backlash'),
        (BETTER[:3], None, '31.0 um with the first model, which was not changed'),
    ],
)
def test_forecasts_are_said_as_they_were(
    drawn: list[Figure], errors: list[float], changed: int | None, title: str
) -> None:
    """Better, worse, or with the model that it began with."""
    pictures.live(run(errors, changed), Path('live.png'))  # type: ignore[arg-type] # no whole run
    assert drawn[0].get_suptitle() == f'Forecasts, median rms error: {title}'


def test_a_long_name_costs_no_number(drawn: list[Figure]) -> None:
    """The middle of the name is left out, both errors stand."""
    content = run(BETTER, 2)
    for posterior in content.posteriors[2:]:
        posterior.effects = ['backlash', 'gain-drift', 'coulomb-friction', 'flow-asymmetry'] * 2
    pictures.live(content, Path('live.png'))  # type: ignore[arg-type] # no whole run
    first, second = drawn[0].get_suptitle().splitlines()
    assert first.endswith('31.0 um with the first model,')
    assert second.startswith('8.0 um with Eq. (2)')
    assert '...' in second


def test_the_share_inside_a_band_is_counted(drawn: list[Figure]) -> None:
    """Of the reference session, as its scored bands have it."""
    content = read(ROOT / 'bags' / 'session')
    estimate_figures.bands(content, Path('bands.png'))
    told = re.search(r'([\d.]+) % of the samples lie in their total 95 %', drawn[0].get_suptitle())
    assert told is not None
    bands = [b for b in content.bands if b.kind == 'total']
    inside = sum(b.widest_coverage * len(b.median) for b in bands)
    assert float(told[1]) == pytest.approx(
        100 * inside / sum(len(b.median) for b in bands), abs=0.06
    )
