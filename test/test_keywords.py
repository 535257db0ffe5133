"""Options are shown as keywords: to `help`, to completion in a notebook, to type checkers."""

import dataclasses
import inspect
import re
from typing import Any, get_type_hints

import pytest

import actuator_glue as ag
from actuator_glue.api import calibration_options, diagnosis, replaying

FUNCTIONS = {
    'calibrate': (calibration_options.CalibrationOptions, calibration_options.CalibrationChanges),
    'diagnose': (diagnosis.DiagnosisOptions, diagnosis.DiagnosisChanges),
    'replay': (replaying.ReplayOptions, replaying.ReplayChanges),
}
CALLABLE = [n for n in ag.__all__ if inspect.isroutine(getattr(ag, n))]


@pytest.mark.parametrize('name', CALLABLE)
def test_no_public_function_hides_its_keywords(name: str) -> None:
    """Every keyword has its name in the signature, and its line in the docstring."""
    function = getattr(ag, name)
    parameters = inspect.signature(function).parameters
    assert not [p for p in parameters.values() if p.kind is p.VAR_KEYWORD]
    told = function.__doc__ or ''
    undocumented = [n for n in parameters if not re.search(rf'^ +{n}: \S', told, re.MULTILINE)]
    assert not undocumented
    assert 'changes: ' not in told


@pytest.mark.parametrize('name', FUNCTIONS)
def test_defaults_are_those_of_the_options(name: str) -> None:
    """Nothing is told twice: signature, options, and what type checkers know are one."""
    options, changes = FUNCTIONS[name]
    shown = inspect.signature(getattr(ag, name)).parameters
    usual: Any = options()
    names = [f.name for f in dataclasses.fields(usual)]
    for each in names:
        assert shown[each].default == getattr(usual, each)
        assert shown[each].kind is inspect.Parameter.KEYWORD_ONLY
    assert list(changes.__annotations__) == names


@pytest.mark.parametrize('name', ['calibrate', 'combinations', 'diagnose'])
def test_a_second_record_is_no_options(name: str) -> None:
    """Two records side by side, without the brackets of a list, are told what to do."""
    record = ag.simulate(ag.Command(duration=2.0, rate=100.0, high=5.0))
    others = (record, record) if name == 'diagnose' else (record,)
    function: Any = getattr(ag, name)
    with pytest.raises(ag.InputError, match=r'into one list, as in \w+\(\[free, clamped\]\)'):
        function(record, *others)


def test_a_notebook_completes_them() -> None:
    """What IPython asks: jedi, of the objects that are there."""
    jedi = pytest.importorskip('jedi', reason='no jedi, which comes with IPython')
    for typed, wanted in {
        'ag.calibrate(records, eval': 'evaluations=',
        'ag.diagnose(records, false': 'false_alarms=',
        'ag.replay("bag", win': 'window=',
        'ag.compare_compensators("a", "b", crit': 'criteria=',
        'ag.Record.from_arrays(t, u, x, force_u': 'force_unit=',
    }.items():
        found = jedi.Interpreter(typed, [{'ag': ag, 'records': []}]).complete()
        assert wanted in [completion.name for completion in found]


def test_what_a_replay_is_asked_is_checked() -> None:
    """A word that is no shaping factor, a number that is none."""
    with pytest.raises(ag.InputError, match="shaping_factor 'much'"):
        ag.replay('nothing', shaping_factor='much')  # type: ignore[arg-type]  # the fault
    with pytest.raises(ag.InputError, match='window'):
        ag.replay('nothing', window='long')  # type: ignore[arg-type]  # the fault
    assert get_type_hints(replaying.ReplayChanges)['seed'] == int | None
