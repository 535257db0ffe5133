"""Run the suite as real nodes for a minute; replay, report, and diagnose what the model lacks."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from actuator_glue.cli._output import write_json
from actuator_glue.cli._parser import Folder, add_force, number
from actuator_glue.errors import InputError

if TYPE_CHECKING:
    from actuator_glue.demo.sources import Source


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        '--out',
        type=Folder,
        default='out/demo',
        metavar='DIR',
        help='where everything lands (out/demo)',
    )
    add_force(parser)
    parser.add_argument('--data', metavar='FILE', help='stream this record, not the simulator')
    parser.add_argument('--channels', metavar='MAP.yaml', help='channel map of FILE')
    parser.add_argument(
        '--stiffness',
        type=number,
        metavar='N/m',
        help='specimen stiffness (simulator: 250e3; FILE: what the file says)',
    )
    parser.add_argument(
        '--hold', choices=('zoh', 'linear'), help='how the command runs between its samples'
    )
    parser.add_argument(
        '--seconds', type=number, default=60.0, metavar='S', help='length of the test (60)'
    )
    parser.add_argument(
        '--rate', type=number, default=1000.0, metavar='HZ', help='rate of the simulator (1000)'
    )
    parser.add_argument(
        '--window', type=number, default=5.0, metavar='S', help='length of a window (5)'
    )
    parser.add_argument(
        '--hop', type=number, default=1.0, metavar='S', help='time from one window to the next (1)'
    )
    parser.add_argument(
        '--effect',
        default='backlash',
        metavar='NAME',
        help='effect of the simulated actuator that no node is told of (backlash; none for none)',
    )
    parser.add_argument('--seed', type=int, default=1, help='seed of noise and sampler (1)')
    parser.add_argument('--no-diagnosis', action='store_true', help='leave the diagnosis out')


def run(args: argparse.Namespace) -> int:
    """Run the demonstration; 1 where a sample was lost or the replay differs.

    Raises:
        InputError: no sourced workspace, unusable data, or a node that dies.
    """
    import time

    from actuator_glue.demo import run as demo
    from actuator_glue.demo.processes import end_in_order
    from actuator_glue.demo.progress import Display

    end_in_order()
    if args.seconds < args.window:
        raise InputError(
            f'--seconds {args.seconds:g} is shorter than the window {args.window:g} s'
        )
    folder = Path(args.out)
    source = _source(args, folder)
    demo.prepare(folder)
    demo.own_domain()
    settings = {'window': args.window, 'hop': args.hop, 'seed': args.seed}
    settings['time_budget'] = min(0.5, args.hop)
    diagnose = not args.no_diagnosis
    console = demo.terminal()
    started = time.monotonic()
    with Display(console) as display:
        demo.stream(source, settings, folder, display, diagnose=diagnose)
        outcome = demo.finish(source, folder, display, args.seed, diagnose=diagnose)
    outcome.seconds = time.monotonic() - started
    write_json(outcome.to_json(), str(folder / 'summary.json'))
    outcome.show(console)
    console.print(f'results   {folder}')
    return 0 if outcome.lossless and outcome.comparison.identical else 1


def _source(args: argparse.Namespace, folder: Path) -> Source:
    from actuator_glue.demo import sources

    if args.data is not None:
        channels = None if args.channels is None else Path(args.channels)
        return sources.laboratory(Path(args.data), channels, args.stiffness, args.hold)
    if args.channels is not None:
        raise InputError('--channels belongs to --data FILE')
    effect = '' if args.effect == 'none' else args.effect
    sealed = folder / 'truth.json'
    return sources.simulator(args.seconds, args.rate, args.stiffness, effect, sealed, args.seed)
