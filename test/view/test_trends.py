"""Numbers of each window over the whole test, in bounded memory."""

import numpy as np

from actuator_glue.view.trends import TrendColumn, Trends

MEAN, PLAY = TrendColumn('mean', 'beta_1', '1/s'), TrendColumn('weight', 'backlash')


def test_a_long_test_gets_coarser_and_keeps_its_beginning() -> None:
    """However many windows: no more rows, evenly spread, the first and the last among them."""
    made = Trends(64)
    for place in range(10_000):
        made.add(place, {MEAN: float(place)})
    places, columns = made.before(10**9, 10**6)
    np.testing.assert_array_equal(columns[MEAN], places)
    assert places[0] == 0 and len(places) <= 64 and np.diff(places[:-64]).max(initial=0) < 400
    assert 9_999 - places[-1] < 400
    few, _ = made.before(10**9, 10)
    assert len(few) <= 11 and few[-1] == places[-1]


def test_rows_that_come_late_are_put_where_they_were_known() -> None:
    made = Trends(8)
    for place in (5, 1, 9, 7, 3):
        made.add(place, {PLAY: place / 10.0} if place > 2 else {MEAN: 1.0})
    places, columns = made.before(8, 100)
    np.testing.assert_array_equal(places, [1, 3, 5, 7])
    np.testing.assert_allclose(columns[PLAY], [np.nan, 0.3, 0.5, 0.7])
    np.testing.assert_allclose(columns[MEAN], [1.0, np.nan, np.nan, np.nan])


def test_since_when() -> None:
    """Without a break up to the place that is asked of; a row that does not tell it breaks it."""
    made = Trends(16)
    for place, weight in enumerate((0.6, None, 0.2, 0.7, 0.8, 0.4)):
        made.add(place, {} if weight is None else {PLAY: weight})
    assert made.since(4, PLAY) == 2 and made.since(4, PLAY, 0.5) == 3
    assert made.since(5, PLAY, 0.5) is None and made.since(0, PLAY, 0.5) == 0
    assert made.since(1, PLAY) is None and made.since(4, MEAN) is None
    assert made.since(-1, PLAY) is None


def test_names_without_end_take_no_memory() -> None:
    made = Trends(16)
    for i in range(500):
        made.add(i, {TrendColumn('weight', f'effect-{i}'): 1.0})
    assert len(made.before(10**9, 100)[1]) < 100
