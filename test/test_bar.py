"""Progress is seen in a notebook without asking, in a terminal where it is asked for."""

import sys
import types
from typing import Any

import pytest

import actuator_glue as ag
from actuator_glue.api import bar


@pytest.fixture
def notebook(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What a notebook shows, in order, as if a kernel ran the test."""
    seen: list[str] = []

    class Handle:
        def update(self, html: str) -> None:
            seen.append(html)

    def display(html: str, display_id: bool) -> Handle:
        assert display_id
        seen.append(html)
        return Handle()

    module, package = types.ModuleType('IPython.display'), types.ModuleType('IPython')
    vars(module).update(HTML=str, display=display)
    vars(package).update(get_ipython=lambda: types.SimpleNamespace(kernel=1), display=module)
    monkeypatch.setitem(sys.modules, 'IPython', package)
    monkeypatch.setitem(sys.modules, 'IPython.display', module)
    monkeypatch.setattr(bar, '_EVERY', 0.0)
    return seen


@pytest.fixture(scope='module')
def record() -> ag.Record:
    """Six seconds at 100 Hz."""
    return ag.simulate(ag.Command(rate=100.0, duration=6.0, high=5.0), stiffness=250e3, seed=3)


def shares(seen: list[str]) -> list[float]:
    """Return the shares that bars showed."""
    return [float(html.split('value="')[1].split('"')[0]) for html in seen if html]


def test_a_notebook_shows_a_bar(notebook: list[str], record: ag.Record) -> None:
    """It grows, says what is under way and how long it takes, and is gone at the end."""
    ag.calibrate(record, evaluations=12_000)
    assert 'calibrate' in notebook[0] and notebook[-1] == ''
    grown = shares(notebook)
    assert grown == sorted(grown) and grown[0] == 0.0 and grown[-1] > 0.8
    assert any('s left' in html for html in notebook)
    notebook.clear()
    ag.replay(record, window=3.0, hop=1.0, evaluations=6000)
    assert 'replay' in notebook[0] and notebook[-1] == ''


def test_nobody_who_does_not_ask_is_shown_one(notebook: list[str], record: ag.Record) -> None:
    """Not with False, nor where the caller shows progress itself."""
    told: list[float] = []
    ag.calibrate(record, evaluations=12_000, progress=told.append)
    ag.calibrate(record, evaluations=12_000, progress=False)
    assert told and not notebook


def test_a_terminal_is_asked(
    record: ag.Record, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is written unasked; with True a bar is made."""
    monkeypatch.delitem(sys.modules, 'IPython', raising=False)
    made: list[Any] = []
    with bar.shown('work', 10.0, None) as done:
        done(5.0)
    ag.calibrate(record, evaluations=12_000)
    assert capsys.readouterr() == ('', '')
    import rich.progress

    usual = rich.progress.Progress

    def progress(*columns: Any, **options: Any) -> Any:
        made.append(usual(*columns, **options))
        return made[-1]

    monkeypatch.setattr(rich.progress, 'Progress', progress)
    ag.calibrate(record, evaluations=12_000, progress=True)
    (task,) = made[0].tasks
    assert task.description == 'calibrate' and 0.8 < task.completed / task.total <= 1.1


def test_a_bar_that_fails_ends_nothing(notebook: list[str], record: ag.Record) -> None:
    """A warning, and the answer."""
    assert notebook == []

    def broken(self: Any, amount: float) -> None:
        raise OSError('no screen')

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bar._Line, '__call__', broken)
        with pytest.warns(RuntimeWarning, match='no screen'):
            assert ag.calibrate(record, evaluations=12_000).draws.size
