"""A real machine (not committed): several effects at once, verified on other days' currents."""

import os
from pathlib import Path

import pytest

from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.io.load import load_records

ROOT = Path(__file__).resolve().parents[2]
MTS = Path(os.environ.get('ACTUATOR_GLUE_MTS', ROOT.parent / 'shared' / 'data' / 'mts'))
REVERSAL = {'backlash', 'valve-deadband', 'coulomb-friction', 'stribeck-friction'}
SPECIMEN = {
    'viscous-damping', 'payload-inertia', 'specimen-gap', 'specimen-hardening', 'specimen-yield'
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(not MTS.is_dir(), reason=f'measured MTS records are not at {MTS}')
@pytest.mark.parametrize('fitted', [0, 1, 2])
def test_mts_is_explained_on_currents_it_was_not_fitted_to(fitted: int) -> None:
    """Fitted at one current: at most 16 um free run at the others, a reversal effect."""
    records = load_records(
        [MTS / f'mts_2022-05-25_chirp15Hz_MR{current}.txt' for current in ('0A', '0p5A', '1A')],
        stiffness=0.0,
        channels=ROOT / 'config' / 'channels' / 'mts.yaml',
    )
    held = [r for i, r in enumerate(records) if i != fitted]
    found = diagnose([records[fitted]], held, jobs=2)
    assert found.verdict == 'missing-effect'
    names = {n for e in found.effects for n in (e.name, *e.alternatives)}
    assert names & REVERSAL
    assert not {e.name for e in found.effects} & SPECIMEN
    for _, before, after in found.error.records:
        assert before > 30e-6
        assert after <= 16e-6
    assert found.error.sham > 0.9 * found.error.before
