"""YAML of people: what stands twice in one mapping is refused, in whatever file it is."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from actuator_glue.campaigns.recipe import read_recipe
from actuator_glue.effects import read_effects
from actuator_glue.errors import InputError
from actuator_glue.io import bag_metadata
from actuator_glue.io.channel_map import read_channel_map
from actuator_glue.io.partition import read_partition
from actuator_glue.plain_yaml import plain_yaml
from actuator_glue.streams.layout_file import read_layout

MAP = 'command: {column: 2, unit: mm}\nmeasured: {column: 3, unit: mm}\nrate: 1000\n'
EFFECT = 'bent:\n  sensor: y = y + b*y**2\n  sensor: y = y + b*y**3\n'
LITERAL = "EFFECTS = {'bent': {\n'sensor': 'y = y',\n'sensor': 'y = 2*y'}}\n"


@pytest.mark.parametrize(
    ('read', 'name', 'text', 'said'),
    [
        (
            read_channel_map,
            'm.yaml',
            MAP + MAP[:31],
            "'command' .* line 1 and in line 4; keep one",
        ),
        (read_channel_map, 'm.yaml', MAP.replace('mm}', 'mm, unit: m}', 1), "'unit' .* line 1"),
        (read_layout, 'l.yaml', 'rate: 1000\nsample: []\nrate: 500\n', "'rate' .* line 3"),
        (read_recipe, 'r.yaml', 'draws: true\ndraws: false\n', "'draws' .* line 2"),
        (read_partition, 'p.yaml', 'numerical: {mass: 1, mass: 2}\n', "'mass' .* line 1"),
        (read_effects, 'e.yaml', EFFECT, "'sensor' .* line 2 and in line 3"),
        (read_effects, 'e.py', LITERAL, "'sensor' .* line 2 and in line 3"),
        (bag_metadata.read, 'metadata.yaml', 'a: 1\na: 2\n', "'a' .* recover"),
    ],
)
def test_no_key_stands_twice(
    tmp_path: Path, read: Callable[[Path], Any], name: str, text: str, said: str
) -> None:
    """The last would win, and nobody would be told: key, file and both lines are."""
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError, match=f'{name}: .*{said}'):
        read(tmp_path if read is bag_metadata.read else path)


@pytest.mark.parametrize('quick', [False, True])
def test_what_is_merged_may_be_said_otherwise(quick: bool) -> None:
    """`<<` brings entries beside those of the mapping, however often; `1` is no `'1'`."""
    text = 'a: &a {x: 1, y: 2}\nb: &b {<<: *a, x: 3}\nc: {<<: *b, y: 4}\nd: {<<: [*a, *b], 1: 5}\n'
    found = plain_yaml(text + "e: {<<: *b, 1: 5, '1': 6}", 'text', quick=quick)
    assert found['b'] == {'x': 3, 'y': 2}
    assert found['c'] == {'x': 3, 'y': 4}
    assert found['d'] == {'x': 1, 'y': 2, 1: 5}
    assert found['e'] == {'x': 3, 'y': 2, 1: 5, '1': 6}


def test_a_date_that_is_none_is_said(tmp_path: Path) -> None:
    """Whatever the parser of YAML raises."""
    path = tmp_path / 'e.yaml'
    path.write_text('a: 2001-99-99\n')
    for read in (read_effects, read_partition):
        with pytest.raises(InputError, match=r'e\.yaml.*YAML'):
            read(path)


@pytest.mark.parametrize('written', ['0500', '010', '+007', '1:30', '1:30.5'])
def test_numbers_to_another_base_are_refused(written: str) -> None:
    """YAML 1.1 reads 0500 as 320 and 1:30 as 90; hexadecimal digits are meant."""
    with pytest.raises(InputError, match=r'here: .* in line 2 is not read as it looks'):
        plain_yaml(f'a: 1\nrate: {written}\n', 'here')
    assert plain_yaml(f"rate: '{written}'", 'here') == {'rate': written}
    plain = {'a': 0, 'b': 0.5, 'c': -10, 'd': 16, 'e': 1000, 'f': 0.0}
    assert plain_yaml('{a: 0, b: 0.5, c: -10, d: 0x10, e: 1_000, f: 00.0}', 'here') == plain
