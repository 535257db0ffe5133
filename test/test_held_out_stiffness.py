"""Held-out records that do not say their specimen stiffness."""

import numpy as np
import pytest

from actuator_glue.api.diagnosis import diagnose
from actuator_glue.api.held_out_stiffness import with_stiffness
from actuator_glue.errors import InputError
from actuator_glue.records import Record

MOTION = np.zeros(8)


def record(stiffness: float | None, source: str = 'a') -> Record:
    """A record of a test under this stiffness."""
    return Record(MOTION, MOTION, 0.01, stiffness=stiffness, source=source)


def test_the_one_that_all_fitted_records_share_is_taken_and_told() -> None:
    """What a record says itself stays."""
    held = [record(None, 'h'), record(5e4, 'says')]
    found, notes = with_stiffness(held, [record(250e3), record(250e3)])
    assert [one.stiffness for one in found] == [250e3, 5e4]
    assert len(notes) == 1
    assert notes[0].startswith('h: held out, and its specimen stiffness is not said')
    assert 'that of the fitted records is taken, 250000 N/m' in notes[0]


@pytest.mark.parametrize('fitted', [(0.0, 250e3), (0.0, None)])
def test_without_one_in_common_it_is_asked_for(fitted: tuple[float | None, ...]) -> None:
    """None is likelier than another."""
    with pytest.raises(InputError, match=r'h: the specimen stiffness .* not known'):
        with_stiffness([record(None, 'h')], [record(k) for k in fitted])


def test_a_diagnosis_from_python_takes_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """As the command line does."""
    asked: list[Record] = []

    def refuse(records: list[Record], held: list[Record], **_: object) -> None:
        asked.extend(held)
        raise InterruptedError

    monkeypatch.setattr('actuator_glue.api.diagnosis.core.diagnose', refuse)
    with pytest.raises(InterruptedError):
        diagnose(record(250e3), holdout=record(None, 'h'))
    assert [one.stiffness for one in asked] == [250e3]
