"""Partitions: what ships, and one clear error a mistake."""

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.io.partition import parse_partition, read_partition
from actuator_glue.io.yaml_file import shipped

GOOD: dict[str, Any] = {
    'numerical': {'mass': 1000.0, 'damping': 600.0, 'stiffness': 2e4},
    'experimental': {'mass': 1.0, 'damping': 0.0, 'stiffness': '1e4'},
    'rate': 1024,
}


def test_shipped_partitions_are_read_by_name() -> None:
    """Each of them, with the damping ratio that its file says."""
    assert shipped('partitions') == [*(f'benchmark_case_{i}' for i in range(1, 5)), 'sdof']
    for name in shipped('partitions'):
        assert read_partition(name).name == name
    M, C, K = read_partition('benchmark_case_2').whole
    squares, modes = np.linalg.eigh(K / 1100.0)
    np.testing.assert_allclose(M, 1100.0 * np.eye(3))
    ratios = np.diag(modes.T @ C @ modes) / 1100.0 / (2.0 * np.sqrt(squares))
    np.testing.assert_allclose(ratios, 0.04, rtol=1e-9)


@pytest.mark.parametrize(
    ('place', 'value', 'said'),
    [
        (('rate',), None, 'rate is missing'),
        (('rate',), 0.0, 'outside'),
        (('rates',), 5.0, 'did you mean rate'),
        (('numerical',), None, 'give one of'),
        (('reference',), GOOD['numerical'], 'not both'),
        (('interface',), 2, 'counted from 1'),
        (('interface',), 'top', 'whole number'),
        (('numerical', 'mass'), [[1.0, 2.0]], 'as many rows'),
        (('numerical', 'mass'), -1.0, 'positive definite'),
        (('numerical', 'stiffness'), [[1.0, 2.0], [3.0, 1.0]], 'not symmetric'),
        (('numerical', 'stiffness'), 'stiff', 'matrix of numbers'),
        (('numerical', 'mass'), 10**400, 'numerical: mass is not a matrix of numbers'),
        (('numerical', 'stiffness'), [[10**400]], 'numerical: stiffness is not a matrix'),
        (('numerical', 'damping_ratio'), 0.05, 'not both'),
        (('experimental', 'mass'), -1.0, 'negative'),
        (('experimental', 'stiffness'), 'stiff', 'number'),
        (('experimental', 'stiffness_sd'), -1.0, 'negative'),
        (('computation_delay',), 2.0, 'outside'),
    ],
)
def test_a_mistake_is_told(place: tuple[str, ...], value: object, said: str) -> None:
    """What is wrong, and where."""
    content = deepcopy(GOOD)
    parse_partition(content)
    inner = content
    for name in place[:-1]:
        inner = inner[name]
    inner[place[-1]] = value
    with pytest.raises(ag.InputError, match=said):
        parse_partition(content)


def test_a_large_whole_number_is_a_number() -> None:
    """YAML has no limit to its digits; what a float holds is taken."""
    content = deepcopy(GOOD)
    content['numerical']['stiffness'] = 10**25
    assert parse_partition(content).stiffness.tolist() == [[1e25]]


def test_files_that_are_none(tmp_path: Path) -> None:
    """No file, no YAML, no text."""
    with pytest.raises(ag.InputError, match='benchmark_case_1'):
        read_partition(tmp_path / 'nothing.yaml')
    for text in (b'a: [', b'\xff\xfe\x00\xd8', b'- 1'):
        (tmp_path / 'bad.yaml').write_bytes(text)
        with pytest.raises(ag.InputError, match=r'bad\.yaml'):
            read_partition(tmp_path / 'bad.yaml')
