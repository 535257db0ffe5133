"""A node that has yet to compile answers services and ends when it is told to."""

import time

import pytest
from rcl_interfaces.srv import ListParameters


@pytest.mark.slow
def test_a_cold_simulator_answers_and_ends(start, probe, tmp_path, monkeypatch):
    """No service answered for 167 s and Ctrl-C took 33 s, while a plant was compiled."""
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path / 'nothing'))
    simulator = start('actuator_sim', installed=True, undeclared_effect='backlash:backlash=6e-5')
    probe.until(lambda: 'compiling the plant' in simulator.text, 250, 'compiling')
    for _ in range(3):
        began = time.monotonic()
        answer = probe.call(
            ListParameters, 'actuator_sim/list_parameters', ListParameters.Request()
        )
        took = time.monotonic() - began
        assert 'specimen_stiffness' in answer.result.names
    assert took < 5.0
    assert probe.value('actuator_sim', 'plant') == 'compiling'
    assert 'the stream begins' not in simulator.text
    began = time.monotonic()
    assert simulator.end() == 0, simulator.text
    assert time.monotonic() - began < 4.0
    assert 'Traceback' not in simulator.text
