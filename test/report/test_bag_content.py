"""What a live estimator left in a bag: bands joined over the record, coverage by samples."""

from types import SimpleNamespace

import numpy as np
import pytest

from actuator_glue.records import Record
from actuator_glue.report.bag_content import Content


def band(index: int, values: np.ndarray, kind: str = 'total') -> SimpleNamespace:
    """Return a scored band around values, one level."""
    return SimpleNamespace(
        kind=kind,
        index=index,
        levels=np.array([0.9]),
        lower=values - 1.0,
        median=values,
        upper=values + 1.0,
        coverage=np.array([0.5]),
        width=np.array([2.0]),
    )


def content(*bands: SimpleNamespace) -> Content:
    """Return a bag's content: 100 samples from running index 1000 on."""
    samples = np.linspace(0.0, 1e-3, 100)
    record = Record(samples, samples, 1e-3, 0.0, first_index=1000)
    return Content(record, 100, bands=list(bands))


def test_bands_are_joined_where_they_lie() -> None:
    """Two hops in a row give one band; what no band covers is NaN."""
    joined = content(
        band(1010, np.arange(20.0)),
        band(1030, np.arange(20.0, 50.0)),
        band(1010, np.zeros(5), 'x'),
    ).stitched('total')
    assert joined is not None and len(joined) == 100
    np.testing.assert_array_equal(joined.median[10:60], np.arange(50.0))
    np.testing.assert_array_equal(joined.lower[0, 10:60], np.arange(50.0) - 1.0)
    assert np.isnan(joined.median[:10]).all() and np.isnan(joined.median[60:]).all()


def test_bands_beyond_the_record_are_cut() -> None:
    """A band that reaches out of the record counts as far as the record goes."""
    joined = content(band(1090, np.arange(20.0)), band(995, np.arange(10.0))).stitched('total')
    assert joined is not None
    np.testing.assert_array_equal(joined.median[90:], np.arange(10.0))
    np.testing.assert_array_equal(joined.median[:5], np.arange(5.0, 10.0))
    assert content().stitched('total') is None


def test_coverage_weighs_bands_by_their_samples() -> None:
    """Ten samples count for less than thirty."""
    short, long = band(1000, np.zeros(10)), band(1010, np.zeros(30))
    short.coverage = np.array([1.0])
    assert content(short, long).coverage('total') == {'0.9': pytest.approx(0.625)}
    assert content(short, long).mean_width('total', 0.9) == 2.0
