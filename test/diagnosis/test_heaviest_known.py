"""Of all that was refitted the heaviest structure is told, where the effort ended, too."""

from two_sweeps import selected

from actuator_glue.diagnosis.moves.heaviest_known import heaviest_known

NAMES = ('backlash', 'gain-drift', 'bias')


def test_a_structure_that_was_refitted_on_the_way_is_told() -> None:
    """The search stands at one of two effects, and both together are known."""
    beam, found = selected(NAMES, {'backlash': 6e-5, 'gain-drift': 0.05}, 2e-3, 5.0, 20.0)
    assert set(found.final.effects) == {'backlash', 'gain-drift'}
    alone = beam.checked(beam.refits.trial(('gain-drift',)), found.singles, exchanged=False)
    assert alone.final.effects == ('gain-drift',)
    before = beam.refits.effort.spent
    told = heaviest_known(beam, alone)
    assert told is not None and set(told.final.effects) == {'backlash', 'gain-drift'}
    assert beam.refits.effort.spent == before


def test_what_has_less_weight_is_not_told() -> None:
    """An immaterial bias beside the effect found is known, and costs more than it explains."""
    beam, found = selected(NAMES, {'backlash': 6e-5}, 2e-3, 5.0, 20.0)
    beam.refits.add(found.final, 'bias')
    assert heaviest_known(beam, found) is None
