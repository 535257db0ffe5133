"""Simulate tests of a servo-hydraulic actuator: command, plant, specimen, sensors, effects."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_glue.api.bar import progress
from actuator_glue.arguments import Input, claim, given, number, whole
from actuator_glue.cli._effects_file import add_effects_file, load_effects
from actuator_glue.cli._output import note
from actuator_glue.cli._save import add_out, check_out, save
from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json
from actuator_glue.records import Record

if TYPE_CHECKING:
    from actuator_glue.api.simulation import Command, Sensors

COMMANDS = ('sweep', 'sine', 'noise', 'earthquake')
PAUSE = 1_000_000_000  # ns between two tests of one bag

EXAMPLES = (
    'simulate test.csv --stiffness 0 250e3',
    'simulate test.csv --duration 20 --effect backlash:backlash=40e-6',
)


# Options of a command, and those that each shape uses; a file has its length and frequencies.
_OF_COMMANDS = '--rate --duration --amplitude-mm --f0 --f1 --frequency --command-seed --channels'
_USED = {
    'sweep': '--rate --duration --amplitude-mm --f0 --f1',
    'sine': '--rate --duration --amplitude-mm --frequency',
    'noise': '--rate --duration --amplitude-mm --f0 --f1 --command-seed',
    'earthquake': '--rate --duration --amplitude-mm --command-seed',
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_out(parser)
    plant = parser.add_argument_group('plant')
    plant.add_argument(
        '--plant',
        choices=('paper', 'benchmark', 'problem-r'),
        default='paper',
        help='paper: Eq. (2); benchmark: transfer system of the RTHS benchmark (its own specimen, '
        'sensors and 7 mm stroke); problem-r: the responses the paper identified, Eqs. (3a), (3b)',
    )
    plant.add_argument(
        '--theta',
        nargs=4,
        type=number,
        metavar=('BETA_1', 'ALPHA_1_BETA_0', 'ALPHA_2', 'ALPHA_3'),
        help='parameters of Eq. (2), SI units (default Table 2 of the paper)',
    )
    plant.add_argument(
        '--stiffness',
        action='append',
        type=number,
        metavar='N/m...',
        help='specimen stiffness; one test for each (default 0)',
    )
    plant.add_argument(
        '--effect',
        action='append',
        default=[],
        metavar='NAME[:PARAMETER=VALUE,...]',
        help='switch an effect of the catalogue on; repeatable. Values not given are typical '
        'ones, the same for every command and specimen. The output does not tell: the screen '
        'and OUT.truth.json do',
    )
    add_effects_file(plant)
    plant.add_argument('--noise-mm', type=number, help='displacement noise, sd (default 0.01)')
    plant.add_argument('--force-noise-n', type=number, help='force noise, sd [N] (default 2)')
    plant.add_argument('--bits', type=whole, help='resolution of both converters (default none)')
    plant.add_argument('--seed', type=whole, default=1, help='seed of the noise (default 1)')
    plant.add_argument('--actuator', default='simulated', help='name (default simulated)')
    command = parser.add_argument_group('command')
    command.add_argument(
        '--command',
        dest='shape',
        default='sweep',
        type=Input,
        metavar='|'.join((*COMMANDS, 'FILE')),
        help='shape, or a bag or laboratory file whose command is used (default sweep)',
    )
    command.add_argument('--rate', type=number, metavar='HZ', help='sample rate (default 1000)')
    command.add_argument('--duration', type=number, metavar='S', help='length (default 60)')
    command.add_argument('--amplitude-mm', type=number, help='peak displacement (default 2)')
    command.add_argument('--f0', type=number, metavar='HZ', help='lowest frequency (default 0)')
    command.add_argument('--f1', type=number, metavar='HZ', help='highest frequency (default 10)')
    command.add_argument('--frequency', type=number, metavar='HZ', help='of a sine (default 1)')
    command.add_argument(
        '--command-seed', type=whole, metavar='S', help='of noise and earthquake (default 0)'
    )
    command.add_argument('--channels', type=Input, metavar='MAP.yaml', help='channel map of FILE')
    parser.add_argument('--hold', choices=('zoh', 'linear'), default='zoh', help='default zoh')


def run(args: argparse.Namespace) -> int:
    """Simulate and write one record per stiffness.

    Raises:
        InputError: an option cannot be used, or the output exists or cannot be written.
    """
    from actuator_glue.api.simulation import named_effects, simulate
    from actuator_glue.api.visibility import unseen

    if args.seed < 0 or (args.command_seed or 0) < 0:
        raise InputError('seeds are whole numbers of at least 0')
    _refuse_idle(args)
    load_effects(args)
    out = check_out(args)
    sealed = out.with_name(out.name + '.truth.json')
    if args.effect:
        claim(sealed, args)
    effects = named_effects('+'.join(args.effect))
    stiffnesses = args.stiffness or [0.0]
    if args.plant == 'problem-r':
        made = _problem_r(args)
    else:
        command = _command(args)
        test = {'effects': effects, 'theta': args.theta, 'hold': args.hold}
        test['sensors'] = _sensors(args)
        made = []
        with progress('simulating', len(stiffnesses)) as done:
            for k in stiffnesses:
                seed = args.seed, len(made)
                made.append(simulate(command, stiffness=k, plant=args.plant, seed=seed, **test))
                done(len(made))
    save(_in_turn(made, args.actuator), args)
    if args.effect:
        truth = _truth(args, effects)
        write_json(truth, str(sealed))
        note(f'hidden: {_hidden(truth)}; {sealed} holds it')
        for line in unseen(command, stiffnesses, **test):
            note(line)
    return 0


def _in_turn(made: Sequence[Record], actuator: str) -> list[Record]:
    """Return tests of an actuator that follow each other."""
    records: list[Record] = []
    for record in made:
        start = records[-1].stamp_ns(len(records[-1])) + PAUSE if records else PAUSE
        records.append(replace(record, start_ns=start, actuator=actuator))
    return records


def _refuse_idle(args: argparse.Namespace) -> None:
    """Refuse options that the plant or the command does not use.

    Raises:
        InputError: one of them was given.
    """
    used = _USED.get(args.shape, '--channels --amplitude-mm --rate').split()
    by = f'--command {args.shape}'
    if args.plant == 'problem-r':
        used, by = (
            ['--duration', '--rate'],
            '--plant problem-r, whose command is that of the paper',
        )
        usual = (('--command', args.shape, 'sweep'), ('--hold', args.hold, 'zoh'))
        for option, value, only in usual:
            if value != only:
                raise InputError(f'{option} {value} does nothing with {by}; take it out')
        if (args.force_noise_n, args.bits) != (None, None):
            raise InputError('--force-noise-n and --bits do nothing with --plant problem-r')
    for option in _OF_COMMANDS.split():
        if given(args, option) and option not in used:
            raise InputError(f'{option} does nothing with {by}; take it out')


def _sensors(args: argparse.Namespace) -> Sensors:
    from actuator_glue.api.simulation import Sensors

    noise = None if args.noise_mm is None else args.noise_mm * 1e-3
    force = 2.0 if args.force_noise_n is None else args.force_noise_n
    return Sensors(noise, force, args.bits)


def _truth(args: argparse.Namespace, effects: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is true about the plant."""
    from actuator_glue.api.simulation import sizes
    from actuator_glue.model.effects import CATALOGUE

    structure, theta = sizes(effects, args.theta)
    return {
        'schema': 'actuator_glue.truth/1',
        'plant': args.plant,
        'theta': dict(zip(structure.names, theta.tolist(), strict=True)),
        'effects': list(structure.effects),
        **CATALOGUE.definitions(structure.effects),
        'seed': args.seed,
    }


def _hidden(truth: dict[str, Any]) -> str:
    """Return the effects of a plant and how large they are, in SI units and as people say it."""
    from actuator_glue.model.effects import CATALOGUE
    from actuator_glue.report.quantity import said, said_in

    told = []
    for name in truth['effects']:
        values = []
        for p in CATALOGUE[name].parameters:
            value = truth['theta'][p.name]
            factor, _ = said_in(p.unit, value)
            people = f' ({said(value, p.unit)})' if factor != 1.0 else ''
            unit = '' if p.unit == '1' else f' {p.unit}'
            values.append(f'{p.name} = {value:.6g}{unit}{people}')
        told.append(f'{name} ({", ".join(values)})' if values else name)
    return ' + '.join(told)


def _problem_r(args: argparse.Namespace) -> list[Record]:
    from actuator_glue.model.reference_problem import NOISE, RATE, STIFFNESS, records

    noise = NOISE if args.noise_mm is None else args.noise_mm * 1e-3
    rate = RATE if args.rate is None else args.rate
    duration = 60.0 if args.duration is None else args.duration
    made = records(args.seed, noise=noise, rate=rate, duration=duration)
    wanted = args.stiffness or list(STIFFNESS)
    chosen = [r for r in made if r.stiffness in wanted]
    if len(chosen) != len(wanted) or args.effect or args.theta:
        raise InputError(
            'problem-r is known for the stiffnesses 0 and 250e3 N/m, as the paper identified it; '
            'it takes no --theta and no --effect'
        )
    return chosen


def _command(args: argparse.Namespace) -> Command | Record:
    """Return the command: a shape, or that of a file."""
    from actuator_glue.api.simulation import Command
    from actuator_glue.model import commands

    amplitude = None if args.amplitude_mm is None else args.amplitude_mm * 1e-3
    if args.shape in COMMANDS:
        frequency = 1.0 if args.frequency is None else args.frequency
        given = {
            'rate': args.rate,
            'duration': args.duration,
            'amplitude': amplitude,
            'low': args.f0,
            'high': frequency if args.shape == 'sine' else args.f1,
            'seed': args.command_seed,
        }
        return Command(args.shape, **{k: v for k, v in given.items() if v is not None})
    from actuator_glue.io.load import load_records

    if not Path(args.shape).exists():
        raise InputError(
            f'--command {args.shape}: neither one of {", ".join(COMMANDS)} nor a file'
        )
    record = load_records(args.shape, channels=args.channels, hold=args.hold)[0]
    rate = record.rate if args.rate is None else args.rate
    samples = commands.recorded(record, rate, amplitude)
    return Record(samples, samples, 1.0 / rate)
