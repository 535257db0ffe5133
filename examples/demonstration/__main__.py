"""Run the suite as real nodes for 90 s; replay, report, and diagnose what the model lacks.

Exit codes: 0 done; 1 a sample was lost, the replay differs, or the live chain did not find what
is hidden; 2 the input cannot be used.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from actuator_glue.arguments import Folder, add_force, claim_outputs, number
from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json
from examples.demonstration import session as demonstration
from examples.demonstration import sources
from examples.demonstration.domain import own_domain
from examples.demonstration.processes import end_in_order
from examples.demonstration.progress import Display


def parser() -> argparse.ArgumentParser:
    """Return the command line."""
    summary, _, exit_codes = (__doc__ or '').partition('\n\n')
    found = argparse.ArgumentParser(
        prog='python -m examples.demonstration', description=summary, epilog=exit_codes
    )
    add = found.add_argument
    add(
        '--out',
        type=Folder,
        default='out/demo',
        metavar='DIR',
        help='where everything lands (%(default)s)',
    )
    add_force(found)
    add('--data', type=Path, metavar='FILE', help='stream this record, not the simulator')
    add('--channels', type=Path, metavar='MAP.yaml', help='channel map of FILE')
    add(
        '--stiffness',
        type=number,
        metavar='N/m',
        help='specimen stiffness (simulator: 250e3; FILE: what the file says)',
    )
    add('--hold', choices=('zoh', 'linear'), help='how the command runs between its samples')
    for name, value, unit, meaning in (
        ('--seconds', sources.PROMISED_SECONDS, 'S', 'length of the test'),
        ('--rate', 1000.0, 'HZ', 'rate of the simulator'),
        ('--window', 5.0, 'S', 'length of a window'),
        ('--hop', 1.0, 'S', 'time from one window to the next'),
    ):
        add(name, type=number, default=value, metavar=unit, help=f'{meaning} (%(default)g)')
    add(
        '--effect',
        default=sources.PROMISED_EFFECT,
        metavar='NAME',
        help='effect of the simulated actuator that no node is told of (%(default)s; none for '
        'none); its oil warms, too',
    )
    add('--seed', type=int, default=1, help='seed of noise and sampler (%(default)s)')
    add(
        '--calibration',
        type=Path,
        metavar='FILE',
        help='what an earlier `calibrate --save` knew of the actuator of --data (simulator: two '
        'short tests tell it)',
    )
    add('--no-diagnosis', action='store_true', help='leave the diagnosis out')
    return found


def run(args: argparse.Namespace) -> int:
    """Run the demonstration; 1 where a sample was lost, the replay differs or a promise is broken.

    Raises:
        InputError: no sourced workspace, unusable data, or a node that dies.
    """
    claim_outputs(args)
    if args.seconds < args.window:
        raise InputError(
            f'--seconds {args.seconds:g} is shorter than the window {args.window:g} s'
        )
    folder = Path(args.out)
    source = _source(args, folder)
    end_in_order()
    demonstration.prepare(folder)
    own_domain()
    settings: dict[str, Any] = {'window': args.window, 'hop': args.hop, 'seed': args.seed}
    settings['time_budget'] = min(0.5, args.hop)
    diagnose = not args.no_diagnosis
    console = demonstration.terminal()
    started = time.monotonic()
    with Display(console) as display:
        known = demonstration.known(source, args.calibration, folder, display, args.seed)
        if known is not None:
            settings |= {'prior': 'sequential', 'calibration': str(known.resolve())}
            settings |= {'drift_of': list(source.drift_of)} if source.drift_of else {}
        demonstration.stream(source, settings, folder, display, diagnose=diagnose)
        outcome = demonstration.finish(source, folder, display, args.seed, diagnose=diagnose)
    outcome.seconds = time.monotonic() - started
    write_json(outcome.to_json(), str(folder / 'summary.json'))
    outcome.show(console)
    console.print(f'results   {folder}')
    kept = not outcome.broken_promises()
    return 0 if outcome.lossless and outcome.comparison.identical and kept else 1


def _source(args: argparse.Namespace, folder: Path) -> sources.Source:
    if args.data is not None:
        return sources.laboratory(args.data, args.channels, args.stiffness, args.hold)
    if args.channels is not None:
        raise InputError('--channels belongs to --data FILE')
    if args.calibration is not None:
        raise InputError('--calibration belongs to --data FILE')
    effect = '' if args.effect == 'none' else args.effect
    sealed = folder / 'truth.json'
    return sources.simulator(args.seconds, args.rate, args.stiffness, effect, sealed, args.seed)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    try:
        return run(parser().parse_args(argv))
    except (InputError, OSError) as error:
        print(f'demonstration: {error}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print('demonstration: interrupted', file=sys.stderr)
        return 130


if __name__ == '__main__':
    sys.exit(main())
