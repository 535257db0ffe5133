"""Fixtures of campaigns: analyses that take a moment, found by every worker."""

import os
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))


@pytest.fixture(autouse=True)
def tiny_analysis_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes that compute import `tiny_analysis`."""
    paths = [str(HERE), *filter(None, [os.environ.get('PYTHONPATH')])]
    monkeypatch.setenv('PYTHONPATH', os.pathsep.join(paths))


@pytest.fixture
def records(tmp_path: Path) -> Path:
    """A folder of twelve files of two actuators on three days, free and clamped."""
    folder = tmp_path / 'records'
    for actuator in ('north', 'south'):
        for day in (1, 2, 3):
            for specimen in ('free', 'clamped'):
                path = folder / actuator / f'{actuator}_2026-03-0{day}_{specimen}.csv'
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(f'{actuator} {day} {specimen}')
    return folder
