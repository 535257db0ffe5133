"""What each compensator reaches over the benchmark's spread: its four cases, several motions."""

from __future__ import annotations

import argparse
import sys

import numpy as np

import actuator_glue as ag
from studies.hybrid.plants import spread

CASES = tuple(f'benchmark_case_{i}' for i in (1, 2, 3, 4))


def main(argv: list[str] | None = None) -> int:
    """Print J2 in the median and at the 95th percentile [%]; return 1 where a draw is unstable."""
    parser = argparse.ArgumentParser(
        prog='python -m studies.hybrid.compensators', description=__doc__
    )
    parser.add_argument('--draws', type=int, default=96, metavar='N', help='(%(default)s)')
    parser.add_argument(
        '--kind', action='append', metavar='NAME', help='repeatable (inverse, robust and ats)'
    )
    parser.add_argument(
        '--motion', action='append', metavar='RECORD', help='repeatable (artificial:1)'
    )
    args = parser.parse_args(argv)
    posterior, unstable = spread(args.draws), 0
    for motion in args.motion or ['artificial:1']:
        for kind in args.kind or ['inverse', 'robust', 'ats']:
            row = []
            for case in CASES:
                found = ag.rths(
                    case, posterior, draws=args.draws, compensator=kind, ground_motion=motion
                )
                virtual = found.virtual
                assert virtual is not None
                unstable += virtual.diverged.value > 0.0
                worst = virtual.j2_percentile_95
                j2 = virtual.indicators['J2'].median if virtual.indicators else float('nan')
                row.append(f'{100 * j2:.2f}, {"-" if worst is None else f"{100 * worst:.2f}"}')
            print(f'{motion} {kind}: {" | ".join(row)}', flush=True)
    return int(unstable > 0)


if __name__ == '__main__':
    np.seterr(all='ignore')
    sys.exit(main())
