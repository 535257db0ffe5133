"""What `simulate` writes, and what it refuses."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.api.simulation import Command, Sensors, simulate, sizes
from actuator_glue.io.load import load_records
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.records import Hold


def test_simulated_bag_holds_what_was_asked(run, short_bag: Path) -> None:
    """Rate, length, stiffness and channels are as the options said."""
    done = run('info', short_bag, '--json', '-')
    assert done.code == 0
    assert done.json['schema'] == 'actuator_glue.info/1'
    (file,) = done.json['files']
    assert file['finished'] is True
    assert {t['name'] for t in file['topics']} == {'/samples', '/test_setup'}
    assert all(t['type_hash'].startswith('RIHS01_') for t in file['topics'])
    (record,) = file['records']
    assert (record['samples'], record['rate_hz']) == (801, 100.0)
    assert record['stiffness_n_per_m'] == 250e3
    assert record['force_n'] is not None
    assert 'record' in done.err  # people's lines go to standard error beside JSON


def test_same_seed_same_bits_other_seed_other_noise(run, tmp_path: Path) -> None:
    """A simulation repeats to the last bit; its noise depends on the seed alone."""
    options = ('--rate', 100, '--duration', 2, '--f1', 5)
    for name, seed in (('a', 1), ('b', 1), ('c', 2)):
        assert run('simulate', tmp_path / name, *options, '--seed', seed).code == 0
    a, b, c = (load_records(tmp_path / name)[0] for name in 'abc')
    assert a.measured.tobytes() == b.measured.tobytes()
    assert 0.5e-5 < (a.measured - c.measured).std() / np.sqrt(2) < 2e-5


@pytest.mark.parametrize('shape', ['sweep', 'sine', 'noise', 'earthquake'])
@pytest.mark.parametrize('plant', ['paper', 'benchmark'])
def test_commands_and_plants(run, tmp_path: Path, shape: str, plant: str) -> None:
    """Each command drives each plant, which follows it."""
    out = tmp_path / 'r.csv'
    options = ('--command', shape, '--plant', plant, '--rate', 256, '--duration', 8)
    highest = {'sweep': ('--f1', 4), 'noise': ('--f1', 4), 'sine': ('--frequency', 1)}
    assert run('simulate', out, *options, *highest.get(shape, ())).code == 0
    (record,) = load_records(out)
    assert np.abs(record.command).max() == pytest.approx(2e-3, rel=0.01)
    assert np.corrcoef(record.command, record.measured)[0, 1] > 0.8


def test_a_recorded_command_and_an_undeclared_effect(run, tmp_path: Path, short_bag: Path) -> None:
    """A record's command is used again; the output does not tell which effect acts."""
    out = tmp_path / 'effect'
    effect = ('--effect', 'backlash:backlash=2e-4', '--noise-mm', 0)
    done = run('simulate', out, '--command', short_bag, '--stiffness', 250e3, *effect)
    assert done.code == 0, done.err
    assert (
        run('simulate', tmp_path / 'none', '--command', short_bag, '--stiffness', 250e3).code == 0
    )
    (with_effect,), (without,) = load_records(out), load_records(tmp_path / 'none')
    assert with_effect.command.tobytes() == load_records(short_bag)[0].command.tobytes()
    assert (with_effect.measured - without.measured).std() > 3e-5
    truth = json.loads((tmp_path / 'effect.truth.json').read_text())
    assert truth['effects'] == ['backlash']
    for file in out.iterdir():
        assert b'backlash' not in file.read_bytes()


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (('--effect', 'gremlins'), 'not in the catalogue'),
        (('--effect', 'backlash:width=1'), 'no parameter'),
        (('--effect', 'backlash:width'), 'PARAMETER=VALUE'),
        (('--effect', 'backlash:backlash=5'), 'bounds of the catalogue, [0, '),
        (('--effect', 'backlash:backlash=-1e-5'), 'bounds of the catalogue, [0, '),
        (('--effect', 'backlash:backlash=nan'), 'no number'),
        (('--stiffness', '-1'), 'outside'),
        (('--rate', '5'), '10 Hz'),
        (('--duration', '0'), 'no full sample'),
        (('--amplitude-mm', '-1'), 'amplitude'),
        (('--command', 'nothing.csv'), 'nor a file'),
        (('--plant', 'problem-r', '--stiffness', '5'), 'problem-r'),
        (('--plant', 'problem-r', '--hold', 'linear'), '--hold linear does nothing'),
        (('--plant', 'problem-r', '--rate', '0'), 'rate'),
        (('--plant', 'problem-r', '--duration', '0'), 'no full sample'),
        (('--plant', 'benchmark', '--stiffness', '5'), 'own specimen'),
        (('--seed', '-1'), 'seed'),
        (('--noise-mm', '-1'), 'noise'),
        (('--bits', '90'), 'bits'),
        (('--block', '0'), 'at least one'),
        (('--theta', '1', '2', 'x', '4'), 'not a number'),
    ],
)
def test_simulate_refuses(run, tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    """One message, exit 2, and nothing left behind."""
    done = run('simulate', tmp_path / 'out', *options)
    assert done.code == 2
    assert words in (done.err if 'usage:' in done.err else done.message)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ('options', 'seen'),
    [
        (('--effect', 'backlash:backlash=1e-4'), True),
        (('--effect', 'backlash:backlash=1e-7'), False),
        (('--effect', 'backlash:backlash=1e-7', '--noise-mm', 0), True),
        (('--effect', 'backlash:backlash=1e-5', '--noise-mm', 0, '--bits', 6), False),
        (('--effect', 'specimen-gap', '--stiffness', 0), False),
        (('--effect', 'specimen-gap', '--stiffness', 0, 250e3, '--noise-mm', 0), True),
    ],
)
def test_an_effect_too_small_to_be_seen_is_told(
    run, tmp_path: Path, options: tuple[object, ...], seen: bool
) -> None:
    """With and without it the displacement is the same but for noise and resolution."""
    done = run('simulate', tmp_path / 'a.csv', '--rate', 200, '--duration', 8, '--f1', 4, *options)
    assert done.code == 0, done.err
    assert ('cannot be seen' not in done.err) == seen


def test_an_effect_is_the_same_machine_under_every_command(run, tmp_path: Path) -> None:
    """Its default size depends on nothing, and is told as it is: in SI units and as people say."""
    options = {
        'usual': (),
        'small': ('--amplitude-mm', 0.4),
        'short': ('--duration', 4, '--rate', 250, '--f1', 3),
        'stiff': ('--stiffness', 0, 2e6),
        'other': ('--command', 'earthquake', '--duration', 5),
    }
    found = {}
    for name, given in options.items():
        common = ('--rate', 200, '--duration', 6)
        done = run('simulate', tmp_path / name, *common, *given, '--effect', 'backlash')
        assert done.code == 0, done.err
        truth = json.loads((tmp_path / f'{name}.truth.json').read_text())
        found[name] = truth['theta']['backlash']
        # The screen tells what the file holds.
        told = re.search(r'backlash = (\S+) m \((\S+) um\)', done.err)
        assert told is not None, done.err
        assert float(told[1]) == pytest.approx(found[name], rel=1e-4)
        assert float(told[2]) == pytest.approx(1e6 * found[name], rel=0.01)
    assert len(set(found.values())) == 1
    assert 2e-5 < found['usual'] < 1e-4


@pytest.mark.parametrize('hold', ['zoh', 'linear'])
@pytest.mark.parametrize('lead', [0.0034, 0.0123])
def test_a_displacement_ahead_of_its_command_is_simulated(lead: float, hold: Hold) -> None:
    """Less and more than a sample: as the model does, which knows the whole command.

    What was commanded before the first sample they take differently.
    """
    given = {'lead': {'lead': lead}}
    command = Command(rate=200.0, duration=6.0, amplitude=3e-3)
    record = simulate(command, effects=given, sensors=Sensors(noise=0.0), hold=hold, seed=1)
    structure, values = sizes(given)
    again = np.ravel(structure.simulate(values, record))
    later = record.time > 1.0
    np.testing.assert_allclose(again[later], record.measured[later], atol=1e-10)


@pytest.mark.parametrize('name', sorted(CATALOGUE))
def test_every_effect_has_one_default_size(name: str) -> None:
    """Neither specimen nor command of a test makes another machine of it."""
    structure, values = sizes([name])
    moved = [
        simulate(
            Command(rate=200.0, duration=3.0, amplitude=a), stiffness=k, effects=[name], seed=5
        )
        for a, k in ((5e-4, 0.0), (3e-3, 250e3))
    ]
    given = {name: dict(zip(structure.names[4:], values[4:].tolist(), strict=True))}
    for record in moved:
        again = simulate(record, stiffness=record.stiffness, effects=given, seed=5)
        np.testing.assert_array_equal(again.measured, record.measured)
