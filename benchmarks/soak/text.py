"""The result of a soak for people: one table, and a headline made of the same numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from benchmarks.soak.judge import WINDOW

GROWTH = 1.0  # MB per hour


def report(found: dict[str, Any]) -> tuple[str, bool]:
    """Return the report, and whether everything held that is asked for."""
    faults = found['faults']
    told = sum(f['told'] for f in faults)
    # Two windows, and the time that the second may be computed.
    limit = 2.0 * WINDOW + 1.0
    back = sum(f['back'] <= limit for f in faults)
    missing = found['samples_missing_in_the_bag']
    lines = [
        f'{found["minutes"]:g} minutes at 1 kHz, {len(faults)} faults, seed {found["seed"]}, '
        f'{found["cores"]} cores, load {found["load_before_and_after"][0]:.1f} before and '
        f'{found["load_before_and_after"][1]:.1f} after.',
        *([f'Ended early: {found["ended_early"]}'] if found['ended_early'] else []),
        '',
        f'- told on /diagnostics: {told} of {len(faults)}',
        f'- bands good again within two windows ({limit:g} s): {back} of {len(faults)}',
        '- good bands over the whole run, faults included: '
        f'{100 * found["good_bands_per_hop"]:.0f} of 100 hops',
        f'- samples missing in the bag beyond the gaps that were told: {missing}',
        f'- from the sending of a block to the callback of the recorder: median '
        f'{1e3 * found["callback_delay_s"]["median"]:.2f} ms, p99 '
        f'{1e3 * found["callback_delay_s"]["p99"]:.1f} ms (stalls of the recorder included)',
        f'- worst bag write lag: {found["worst_write_lag_s"]} s',
        '- estimator at the end: '
        + ', '.join(f'{name} {value}' for name, value in found['estimator'].items()),
        '',
        '| fault | times | told | bands back: worst, s |',
        '|---|---|---|---|',
    ]
    for kind in sorted({f['kind'] for f in faults}):
        own = [f for f in faults if f['kind'] == kind]
        worst = max((math.inf if math.isnan(f['back']) else f['back']) for f in own)
        shown = 'not before the next fault' if math.isinf(worst) else f'{worst:.1f}'
        lines.append(f'| {kind} | {len(own)} | {sum(f["told"] for f in own)} | {shown} |')
    lines += [
        '',
        '| process | MB at the end | growth, MB/h (95 %) | below 1 MB/h | started |',
        '|---|---|---|---|---|',
    ]
    for name, part in found['memory'].items():
        lines.append(
            f'| {name} | {part["megabytes"]:.0f} | {part["slope"]:+.2f} ({part["lower"]:+.2f} to '
            f'{part["upper"]:+.2f}) | {judged(part)} | {part["processes"]} |'
        )
    bounded = all(judged(part) == 'yes' for part in found['memory'].values())
    whole = bounded and not missing and not found['ended_early']
    passed = told == back == len(faults) and whole
    verdict = 'Everything held.' if passed else 'Not everything held: see the numbers below.'
    return '\n'.join([f'**{verdict}**', '', *lines]) + '\n', passed


def judged(part: Mapping[str, float]) -> str:
    """Return whether the growth of a part is shown to be less than is allowed."""
    if part['upper'] < GROWTH:
        return 'yes'
    return 'no' if part['lower'] > GROWTH else 'not shown'
