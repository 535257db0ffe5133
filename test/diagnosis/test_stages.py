"""Progress of a diagnosis: every stage that is told is known, and no label ends an answer."""

import ast
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from actuator_glue import diagnosis as package
from actuator_glue.api.callbacks import harmless
from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.stages import EFFECTS, ShareDone, Stage
from actuator_glue.inference.least_squares.fit import Fit

ROOM = Path(package.__file__).parent


def told() -> set[str]:
    """Every text that the code hands on as a stage: `tell(..)`, `progress(..)`, `stage=..`."""
    found = set()
    for path in ROOM.rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Call):
                continue
            name = getattr(node.func, 'attr', getattr(node.func, 'id', ''))
            first = node.args[:1] if name in ('tell', 'progress') else []
            named = [k.value for k in node.keywords if k.arg == 'stage']
            found |= {n.value for n in (*first, *named) if isinstance(n, ast.Constant)}
    return {text for text in found if isinstance(text, str)}


def test_every_stage_that_is_told_is_known() -> None:
    """And every one that is known is told: the effects' by their number."""
    assert told() | set(EFFECTS) == set(get_args(Stage)) - {'posterior'}


def spent(effort: Effort, work: int) -> None:
    """Add work to an effort."""
    effort.spent_on(Fit(np.zeros(4), np.zeros(1), np.zeros((4, 1)), np.zeros(4), work=work))


def test_the_share_that_is_done_never_falls() -> None:
    """From nothing to all of it; going back to an earlier stage takes nothing away."""
    overall = ShareDone(Effort(100.0))
    shares = [overall(stage, 0.0) for stage in get_args(Stage)]
    assert shares == sorted(shares) and (shares[0], shares[-1]) == (0.0, 1.0)
    assert overall('effect 1', 0.5) == 1.0


def test_what_is_missing_tells_how_long_it_takes() -> None:
    """The first stage is a larger share of a search that finds nothing."""
    shares = []
    for missing in (False, True):
        effort = Effort(100.0)
        overall = ShareDone(effort)
        overall('base fit', 0.0)
        effort.expects(missing)
        shares.append([overall('effect 1', 0.0), overall('effect 1', 1.0)])
    (begin, end), (later, last) = shares
    assert begin > later and end > last and end - begin > last - later


def test_a_further_search_takes_as_long_as_all_before() -> None:
    """And no longer than to the posterior."""
    effort = Effort(100.0)
    overall = ShareDone(effort)
    overall('base fit', 0.0)
    effort.expects(True)
    overall('effect 1', 0.0)
    spent(effort, 10)
    for stage in ('weighing', 'rivals'):
        overall(stage, 0.0)
    first = overall('other hold', 0.0)
    assert overall('effect 1', 1.0) == first  # this stage says little of the whole
    spent(effort, 5)
    half = overall('effect 1', 1.0)
    spent(effort, 5)
    whole = overall('rivals', 0.0)
    assert first < half < whole and half - first == pytest.approx(whole - half)
    assert whole <= overall('posterior', 0.0) < 0.9


def test_a_stage_that_nobody_knows_is_no_reason_to_fail() -> None:
    """The share stays about where it was."""
    overall = ShareDone(Effort(100.0))
    before = overall('base fit', 0.0)
    assert before <= overall('a new idea', 0.5) <= before + 0.1


def test_a_callback_that_fails_is_told_once() -> None:
    """It ends no answer, and is not called again; the keyboard's interrupt goes through."""
    calls = []

    def tell(stage: str, share: float) -> None:
        calls.append(stage)
        raise KeyError(stage)

    safe = harmless(tell)
    with pytest.warns(RuntimeWarning, match="KeyError.'check'"):
        safe('check', 0.0)
    safe('base fit', 0.0)
    assert calls == ['check']

    def interrupted(share: float) -> None:
        raise KeyboardInterrupt

    stop = harmless(interrupted)
    with pytest.raises(KeyboardInterrupt):
        stop(0.0)


def test_refits_tell_how_far_a_search_is() -> None:
    """Between stages, too: the share grows with the effort, from the caller's own thread."""
    effort = Effort(100.0, tell=lambda: shares.append(overall(*overall.now)))
    overall, shares = ShareDone(effort), list[float]()
    overall('effect 2', 0.0)
    for _ in range(3):
        spent(effort, 10)
        effort.tell()
    assert shares == sorted(set(shares)) and len(shares) == 3
