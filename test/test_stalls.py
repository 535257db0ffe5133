"""What the benchmark of the live run holds against the machine instead of the estimator."""

from __future__ import annotations

import numpy as np

from benchmarks.stalls import Stall, awake, withheld


def test_a_stall_counts_where_it_was_waited_for():
    spans = [(0, 10), (100, 130), (200, 210)]
    stalls = [Stall(-50, -20), Stall(5, 8), Stall(40, 60), Stall(110, 125), Stall(205, 300)]
    assert withheld(spans, stalls).tolist() == [3, 15, 5]


def test_work_that_queues_behind_a_stall_is_held_up_by_it():
    spans = [(0, 90), (50, 100), (100, 140)]
    stalls = [Stall(10, 70)]
    # The third came when there was nothing to do.
    assert withheld(spans, stalls).tolist() == [60, 60, 0]


def test_nothing_is_excused_where_nothing_stalled():
    assert withheld([(0, 10), (5, 20)], []).tolist() == [0, 0]
    assert withheld([], [Stall(0, 1)]).tolist() == []


def test_as_counted_one_by_one(rng_seed):
    rng = np.random.default_rng(rng_seed)
    came = np.cumsum(rng.integers(1, 50, 40))
    done = np.maximum.accumulate(came + rng.integers(1, 80, 40))
    edges = np.unique(rng.integers(0, 1200, 60))
    stalls = [Stall(int(a), int(b)) for a, b in zip(edges[:-1:2], edges[1::2], strict=False)]
    spans = [(int(a), int(b)) for a, b in zip(came, done, strict=True)]
    found = withheld(spans, stalls)
    for i, (_, end) in enumerate(spans):
        first = i
        while first and spans[first][0] < spans[first - 1][1]:
            first -= 1
        during = range(spans[first][0], end)
        expected = sum(any(s.due <= t < s.woken for s in stalls) for t in during)
        assert found[i] == expected


def test_processors_are_kept_awake_where_that_is_granted(tmp_path, monkeypatch):
    request = tmp_path / 'latency'
    request.touch()
    monkeypatch.setattr('benchmarks.stalls._LATENCY', request)
    with awake() as granted:
        assert granted and request.read_bytes() == bytes(4)
    monkeypatch.setattr('benchmarks.stalls._LATENCY', tmp_path / 'missing' / 'latency')
    with awake() as granted:
        assert not granted
