"""Simulate tests of a servo-hydraulic actuator: command, plant, specimen, sensors, effects."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_glue.cli._effects import NOISE, chosen, unseen
from actuator_glue.cli._effects_file import add_effects_file, definitions, load_effects
from actuator_glue.cli._output import note, progress, write_json
from actuator_glue.cli._parser import claim, number
from actuator_glue.cli._save import add_out, check_out, save
from actuator_glue.errors import InputError
from actuator_glue.records import Array, Record

if TYPE_CHECKING:
    from actuator_glue.model.plant import Plant

COMMANDS = ('sweep', 'sine', 'noise', 'earthquake')
BLOCK = 4096  # samples simulated at a time
PAUSE = 1_000_000_000  # ns between two tests of one bag


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
        'ones. The output does not tell: OUT.truth.json does',
    )
    add_effects_file(plant)
    plant.add_argument('--noise-mm', type=number, help='displacement noise, sd (default 0.01)')
    plant.add_argument('--force-noise-n', type=number, help='force noise, sd [N] (default 2)')
    plant.add_argument('--bits', type=int, help='resolution of both converters (default none)')
    plant.add_argument('--seed', type=int, default=1, help='seed of the noise (default 1)')
    plant.add_argument('--actuator', default='simulated', help='name (default simulated)')
    command = parser.add_argument_group('command')
    command.add_argument(
        '--command',
        dest='shape',
        default='sweep',
        metavar='|'.join((*COMMANDS, 'FILE')),
        help='shape, or a bag or laboratory file whose command is used (default sweep)',
    )
    command.add_argument('--rate', type=number, metavar='HZ', help='sample rate (default 1000)')
    command.add_argument('--duration', type=number, metavar='S', help='length (default 60)')
    command.add_argument('--amplitude-mm', type=number, help='peak displacement (default 2)')
    command.add_argument('--f0', type=number, metavar='HZ', help='lowest frequency (default 0)')
    command.add_argument('--f1', type=number, metavar='HZ', help='highest frequency (default 10)')
    command.add_argument('--frequency', type=number, default=1.0, metavar='HZ', help='of a sine')
    command.add_argument('--command-seed', type=int, default=0, help='of noise and earthquake')
    command.add_argument('--channels', metavar='MAP.yaml', help='channel map of FILE')
    parser.add_argument('--hold', choices=('zoh', 'linear'), default='zoh', help='default zoh')


def run(args: argparse.Namespace) -> int:
    """Simulate and write one record per stiffness.

    Raises:
        InputError: an option cannot be used, or the output exists or cannot be written.
    """
    if args.seed < 0 or args.command_seed < 0:
        raise InputError('seeds are whole numbers of at least 0')
    load_effects(args)
    out = check_out(args)
    sealed = out.with_name(out.name + '.truth.json')
    if args.effect:
        claim(sealed, args)
    if args.plant == 'problem-r':
        save(_problem_r(args), args)
        return 0
    command, rate = _command(args)
    stiffnesses = args.stiffness or [0.0]
    records: list[Record] = []
    truth: dict[str, Any] = {}
    with progress('simulating', len(command) * len(stiffnesses)) as done:
        for test, stiffness in enumerate(stiffnesses):
            plant, truth = _plant(args, stiffness, command, rate, test)
            start = records[-1].stamp_ns(len(records[-1])) + PAUSE if records else PAUSE
            record = _measure(plant, command, rate, done, test * len(command))
            # The benchmark's specimen is part of its transfer system.
            known = truth.get('specimen_stiffness', stiffness)
            record = replace(record, stiffness=known, hold=args.hold, start_ns=start)
            records.append(replace(record, actuator=args.actuator))
    save(records, args)
    if args.effect:
        write_json({'schema': 'actuator_glue.truth/1', **truth}, str(sealed))
        note(f'what was switched on is in {sealed}')
        for line in unseen(args, stiffnesses, command, rate):
            note(line)
    return 0


def _given(value: float | None, default: float) -> float:
    return default if value is None else value


def _problem_r(args: argparse.Namespace) -> list[Record]:
    from actuator_glue.model.problem_r import NOISE, RATE, STIFFNESS, records

    noise = NOISE if args.noise_mm is None else args.noise_mm * 1e-3
    made = records(args.seed, noise=noise, rate=args.rate or RATE, duration=args.duration or 60.0)
    wanted = args.stiffness or list(STIFFNESS)
    chosen = [r for r in made if r.stiffness in wanted]
    if len(chosen) != len(wanted) or args.effect or args.theta:
        raise InputError(
            'problem-r is known for the stiffnesses 0 and 250e3 N/m, as the paper identified it; '
            'it takes no --theta and no --effect'
        )
    starts = [PAUSE]
    for record in chosen[:-1]:
        starts.append(starts[-1] + record.stamp_ns(len(record)) + PAUSE)
    return [
        replace(r, start_ns=s, actuator=args.actuator) for r, s in zip(chosen, starts, strict=True)
    ]


def _command(args: argparse.Namespace) -> tuple[Array, float]:
    """Return the command [m] and its rate [Hz]."""
    from actuator_glue.model import commands

    if args.shape not in COMMANDS:
        from actuator_glue.io.load import load_records

        if not Path(args.shape).exists():
            raise InputError(
                f'--command {args.shape}: neither one of {", ".join(COMMANDS)} nor a file'
            )
        record = load_records(args.shape, channels=args.channels, hold=args.hold)[0]
        amplitude = None if args.amplitude_mm is None else args.amplitude_mm * 1e-3
        rate = _given(args.rate, record.rate)
        return commands.recorded(record, rate, amplitude), rate
    rate, duration = _given(args.rate, 1000.0), _given(args.duration, 60.0)
    peak, f1 = _given(args.amplitude_mm, 2.0) * 1e-3, _given(args.f1, 10.0)
    if args.shape == 'sweep':
        return commands.sweep(rate, duration, _given(args.f0, 0.0), f1, peak), rate
    if args.shape == 'sine':
        return commands.sine(rate, duration, args.frequency, peak), rate
    if args.shape == 'noise':
        return commands.noise(
            rate, duration, _given(args.f0, 0.1), f1, peak, args.command_seed
        ), rate
    return commands.earthquake(rate, duration, peak, args.command_seed), rate


def _plant(
    args: argparse.Namespace, stiffness: float, command: Array, rate: float, test: int
) -> tuple[Plant, dict[str, Any]]:
    """Return the plant of one test and what is true about it."""
    import numpy as np

    from actuator_glue.model import benchmark_plant
    from actuator_glue.model.plant import MeasuredPlant
    from actuator_glue.model.sensor import SensorSpec
    from actuator_glue.model.stream import Stream

    seed = int(np.random.SeedSequence((args.seed, test)).generate_state(1)[0])
    noise = None if args.noise_mm is None else args.noise_mm * 1e-3
    if args.plant == 'benchmark':
        if args.effect or args.theta:
            raise InputError('the benchmark plant takes no --theta and no --effect')
        if stiffness:
            raise InputError('the benchmark plant has its own specimen; leave --stiffness out')
        spec = benchmark_plant.DISPLACEMENT_SENSOR
        if noise is not None:
            spec = replace(spec, noise=noise)
        made = benchmark_plant.benchmark_plant(
            period=1.0 / rate, hold=args.hold, seed=seed, displacement=spec
        )
        return made, {'specimen_stiffness': benchmark_plant.BenchmarkParameters().stiffness}
    structure, theta = chosen(args, stiffness, command, rate)
    stream = Stream(
        structure,
        theta,
        stiffness=stiffness,
        period=1.0 / rate,
        hold=args.hold,
        rng=np.random.default_rng((seed, 1)),
    )
    span = 2.0 * float(np.abs(command).max()) or 1e-3
    force = _given(args.force_noise_n, 2.0)
    made = MeasuredPlant(
        stream,
        SensorSpec(NOISE if noise is None else noise, args.bits, span),
        SensorSpec(force, args.bits, max(2.0 * stiffness * span, 1e3)),
        seed,
    )
    truth = {
        'plant': args.plant,
        'theta': dict(zip(structure.names, theta.tolist(), strict=True)),
        'effects': list(structure.effects),
        **definitions(structure.effects),
        'seed': args.seed,
    }
    return made, truth


def _measure(plant: Plant, command: Array, rate: float, done: Any, before: int) -> Record:
    import numpy as np

    measured, force = np.empty(len(command)), np.empty(len(command))
    for start in range(0, len(command), BLOCK):
        part = slice(start, min(start + BLOCK, len(command)))
        measured[part], force[part] = plant.step(command[part])
        done(before + part.stop)
    return Record(command, measured, 1.0 / rate, force=force, source='simulated')
