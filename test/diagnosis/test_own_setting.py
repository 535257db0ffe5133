"""One record's own setting stands beside whatever was found, learned terms among it."""

from collections.abc import Container
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from two_sweeps import NOISE, RATE, selected_of, sweep

from actuator_glue.diagnosis.learned.forms import forms
from actuator_glue.diagnosis.moves.own_setting import _with_setting
from actuator_glue.diagnosis.refits import refits
from actuator_glue.diagnosis.scopes.one_record import OneRecord
from actuator_glue.diagnosis.verdict.both_parts import _acting, _where_it_acts
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.effects import Effect, Scale
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

THETA = np.array([230.0, 3.5e9, 4e5, 0.6])
TERM = 'learned-command-u-absr'


def commands_forms(scale: Scale, known: Container[str] = ()) -> tuple[Effect, ...]:
    """Learned terms of the command alone."""
    return tuple(effect for effect in forms(scale, known) if effect.place == 'command')


@pytest.mark.slow
def test_a_setting_is_tried_beside_a_learned_term(monkeypatch: pytest.MonkeyPatch) -> None:
    """A command that grows with its rate, and an offset of the second record."""
    monkeypatch.setattr(refits, 'forms', commands_forms)
    u, machine = sweep(2e-3, 8.0, 10.0), []
    given = u * (1.0 + 2.7 * RATE * np.abs(np.diff(u, prepend=0.0)))
    for k, offset in ((0.0, 0.0), (250e3, 5.0 * NOISE)):
        y = Structure(()).simulate(THETA, Record(given, given, 1.0 / RATE, k))
        machine.append((k, u, y + offset))
    beam, found = selected_of(('gain', 'delay'), machine, sources=('w/a/1.csv', 'w/a/2.csv'))
    assert TERM in beam.refits.terms()
    best = beam.refits.add(beam.refits.trial(()), TERM)
    beam.renoise(best)
    found = beam.checked(best, found.singles, exchanged=False)

    moved = beam.refits.data.records[1].measured
    held = Record(moved, moved, 1.0 / RATE, 100e3, source='w/b/2.csv')
    answer: Any = SimpleNamespace(
        beam=beam,
        found=found,
        prepared=SimpleNamespace(held=SimpleNamespace(records=(held,))),
        decision=SimpleNamespace(limit=np.inf),
    )
    rows, told = _with_setting(answer, beam.apart(), (TERM,))
    assert told is not None and set(told.final.effects) == {'bias', TERM}
    assert isinstance(told.final.own, OneRecord) and told.final.own.own == 'bias'
    assert told.final.own.scope == 'bias in a/2.csv only'
    assert told.left < told.material
    assert all(TERM in row.effects for row in rows)


def test_only_a_held_out_record_tells_how_it_was_set() -> None:
    """Two tests of the set-up whose gain was another one: it was so in one of them again."""
    rng = np.random.default_rng(4)
    u, structure = sweep(2e-3, 8.0, 16.0), Structure(('gain',))

    def record(gain: float) -> Record:
        rest = Record(u, u, 1.0 / RATE, 250e3)
        y = structure.simulate(np.append(THETA, gain), rest)
        return replace(rest, measured=y + NOISE * rng.standard_normal(len(u)))

    fitted, set_again, as_usual = record(1.02), record(1.02), record(1.0)
    own = OneRecord(structure, 'gain', (fitted,))
    held = Data.whole([as_usual, set_again])
    found = _where_it_acts(own, np.append(THETA, 1.02), held)
    assert found.own == 'gain' and len(found.records) == 2
    assert found.records[0] is fitted and found.records[1] is set_again
    # Where none was set so, only what acts everywhere can be confirmed or not.
    for names, its, there in (
        (('gain',), own, False),
        (('gain', 'delay'), own, True),
        (('gain',), found, True),
        (('delay',), None, True),
        ((), None, False),
    ):
        final: Any = SimpleNamespace(effects=names, own=its)
        assert _acting(final, held) is there
