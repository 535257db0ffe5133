"""One record's own setting stands beside whatever was found, learned terms among it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
from two_sweeps import NOISE, RATE, selected_of, sweep

from actuator_glue.diagnosis.moves.own_setting import _with_setting
from actuator_glue.diagnosis.scopes.one_record import OneRecord
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

THETA = np.array([230.0, 3.5e9, 4e5, 0.6])
TERM = 'learned-command-u-absr'


def test_a_setting_is_tried_beside_a_learned_term() -> None:
    """A command that grows with its rate, and an offset of the second record."""
    u, machine = sweep(2e-3, 8.0, 32.0), []
    given = u * (1.0 + 2.7 * RATE * np.abs(np.diff(u, prepend=0.0)))
    for k, offset in ((0.0, 0.0), (250e3, 5.0 * NOISE)):
        y = Structure(()).simulate(THETA, Record(given, given, 1.0 / RATE, k))
        machine.append((k, u, y + offset))
    beam, found = selected_of(('gain', 'delay'), machine, sources=('w/a/1.csv', 'w/a/2.csv'))
    refits = beam.refits
    assert TERM in refits.terms()
    best = refits.add(refits.trial(()), TERM)
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
