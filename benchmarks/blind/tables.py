"""Replay the choice of a structure from stored tables: `tables.py FOLDER... [--telling 0.05]`.

Campaigns leave the table of all structures that each diagnosis refitted. Here a rule chooses from
it again, without any refit: a minute for hundreds of machines. The rule is the weight that the
diagnosis goes by (`diagnosis/score/weights.py`), with another error that tells if asked for. It is
held against the structure that was told: how often both agree, how often either is the machine's,
and what either leaves of the held-out record.
"""

from __future__ import annotations

import argparse
import json
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from case import Case
from equivalents import catalogued
from reliability import answers
from score import row_weights, share

from actuator_glue.diagnosis.refits.candidates import mean_effects
from actuator_glue.diagnosis.thresholds import TELLING
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

Json = dict[str, Any]


def held_out(case: Case, row: Json) -> float:
    """Rms error that a row's parameters leave of the machine's held-out record [m]."""
    known = {'period': 1.0 / case.rate, 'stiffness': case.stiffness[2]}
    record = Record(case.commands[2], case.measured[2], **known)
    data = Data.whole([record])
    theta = np.array(list(row['parameters'].values()))
    error = data.target - data.simulate(Structure(row['effects']), theta)[0]
    return float(np.sqrt(np.mean(error**2)))


def replay(result: Json, generator: str, telling: float) -> Json | None:
    """Choose again from one machine's table; None where it holds terms of no catalogue."""
    found = result['diagnosis']
    rows = [r for r in found['structures'] if set(r['effects']) <= set(CATALOGUE)]
    told = next((r for r in rows if r['chosen']), None)
    if told is None or not rows:
        return None
    weights = row_weights(rows, found['alarm']['threshold'], telling)
    chosen = rows[int(np.argmax(weights))]
    truth = {catalogued(n) for n in result['effects']}
    moved = truth & {*mean_effects(), *mean_effects(reserved=True)}
    case = import_module(generator).build(result['seed'])
    return {
        'seed': result['seed'],
        'same': set(chosen['effects']) == set(told['effects']),
        'rules_true': set(told['effects']) == moved,
        'weight_true': set(chosen['effects']) == moved,
        'ratio': held_out(case, chosen) / max(held_out(case, told), 1e-12),
        'behind': -float(weights[rows.index(told)]),
        'told': told['effects'],
        'chosen': chosen['effects'],
        'truth': sorted(truth),
    }


def main() -> int:
    """Replay every stored table and print how both choices compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('folders', nargs='+', type=Path, help='OUT of campaigns of one generator')
    parser.add_argument('--generator', default='cases')
    parser.add_argument(
        '--telling', type=float, default=TELLING, help='of what matters: error that costs a nat'
    )
    args = parser.parse_args()
    table = [replay(r, args.generator, args.telling) for r in answers(args.folders)]
    rows = [row for row in table if row is not None]
    if not rows:
        raise SystemExit('no stored table of these folders can be replayed')
    for row in rows:
        if not row['same']:
            print(json.dumps(row))
    print(f'{len(rows)} machines of {args.generator}, {len(table) - len(rows)} with learned terms')
    for name, key in (
        ('same structure', 'same'),
        ('true effects by the rules', 'rules_true'),
        ('true effects by the weight', 'weight_true'),
    ):
        of = share([r[key] for r in rows])
        low, high = of['ci']
        print(f'{name}: {sum(r[key] for r in rows)} of {of["n"]} (95 % {low:.2f} to {high:.2f})')
    ratios = np.array([r['ratio'] for r in rows])
    mean, low, high = np.exp(np.mean(np.log(ratios))), ratios.min(), ratios.max()
    print(f'held-out error, weight over rules: {mean:.3f} ({low:.3f} to {high:.3f})')
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
