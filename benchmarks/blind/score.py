"""Scores of the blind benchmark with exact binomial intervals."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from equivalents import catalogued
from statsmodels.stats.proportion import proportion_confint

from actuator_glue.diagnosis.score.weights import counted, log_weights
from actuator_glue.diagnosis.search.table import additions
from actuator_glue.diagnosis.thresholds import TELLING
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.records import Array

Json = dict[str, Any]
_BINS = ((0.0, 0.5), (0.5, 1.0), (1.0, 2.0), (2.0, 4.0), (4.0, np.inf))
_NEAR = 1.2  # held-out error over noise below which an effect counts as described
_CLEAR = 2.0  # post-refit residual over noise from which the bars hold


def share(hits: list[bool]) -> Json:
    """Share of hits with its 95 % Clopper-Pearson interval."""
    n, k = len(hits), int(sum(hits))
    if not n:
        return {'n': 0, 'share': None, 'ci': [None, None]}
    low, high = proportion_confint(k, n, 0.05, 'beta')
    return {'n': n, 'share': k / n, 'ci': [float(np.nan_to_num(low)), float(high)]}


def told(of: Json) -> str:
    """Say a share and its interval as a cell of a table."""
    if not of['n']:
        return '-'
    low, high = of['ci']
    return f'{round(of["share"] * of["n"])} of {of["n"]} ({100 * low:.0f} to {100 * high:.0f} %)'


def judging(results: list[Json], looked_at: Collection[str]) -> list[Json]:
    """Return the answers about machines that nothing was mended on.

    Args:
        results: answers.
        looked_at: the other machines, each `generator:seed`.
    """
    return [r for r in results if f'{r["generator"]}:{r["seed"]}' not in looked_at]


def ask_looked_at(parser: argparse.ArgumentParser) -> None:
    """Add the option that names machines which something was mended on."""
    parser.add_argument(
        '--looked-at', nargs='*', default=[], help='machines left out, each GENERATOR:SEED'
    )


def without(looked_at: Collection[str]) -> str:
    """Say which machines were left out; nothing for none."""
    names = ', '.join(sorted(looked_at))
    return f' Left out, because something was mended on them: {names}.' if names else ''


def _named(result: Json) -> list[list[str]]:
    """Names of causes, which learned terms are not, unless they are another shape of one."""
    d = result['diagnosis']
    described = {term['name'] for term in d.get('learned', ())}
    rows = [(e.get('cause') if e['name'] in described else e['name'], e) for e in d['effects']]
    return [[name, *e['alternatives']] for name, e in rows if name]


def _told(result: Json) -> bool:
    """Whether it is said that the answer is not complete."""
    return result['diagnosis']['verdict'] in ('unexplained', 'undecided')


def _described(result: Json) -> bool:
    """Whether something, and no wrong name, leaves next to noise on the held-out record.

    A kind that had no name when the generators were written may have one in the catalogue now.
    """
    d = result['diagnosis']
    near = d['error']['after'] <= _NEAR * result['clean_floor']
    truth = {*result['effects'], *map(catalogued, result['effects'])}
    right = all(set(names) & truth for names in _named(result))
    return bool(d['effects']) and right and near


def _groups(names: list[str]) -> set[str]:
    return {CATALOGUE[n].group for n in names if n in CATALOGUE}


def _wrong(result: Json) -> bool:
    """A name without alternatives that is not the truth."""
    return any(len(names) == 1 and names[0] not in result['effects'] for names in _named(result))


def _both(result: Json) -> bool:
    sets = _named(result)
    return all(any(e in names for names in sets) for e in result['effects'])


def _false_scope(result: Json) -> bool:
    """Another hold, which no machine has, or an onset where nothing appeared."""
    told = result['diagnosis']
    hold = told.get('setup') is not None and bool(told['setup'].get('taken', True))
    return hold or (told.get('onset') is not None and 'onset' not in result['sizes'])


@dataclass(frozen=True)
class Question:
    """A question that is answered by yes or no for each machine of some kind.

    Attributes:
        text: what `yes` means, for people.
        of: whether it is asked of a machine.
        yes: its answer.
        wanted: whether yes is what is wanted.
    """

    text: str
    of: Callable[[Json], bool]
    yes: Callable[[Json], bool]
    wanted: bool = True


def _kind(kind: str) -> Callable[[Json], bool]:
    return lambda result: bool(result['kind'] == kind)


def _left_open(result: Json) -> bool:
    """Whether one stiffness was fitted, which leaves parameters open that the held-out one needs.

    The stiffness of the held-out record stands last.
    """
    *fitted, held = result['stiffness']
    return len(set(fitted)) == 1 and held not in fitted


def _clear(result: Json) -> bool:
    return bool(result['kind'] == 'single' and result['ratio'] >= _CLEAR)


def _clear_pair(result: Json) -> bool:
    return bool(result['kind'] == 'pair' and min(result['shares'].values()) >= 1.0)


def _first(result: Json) -> list[str]:
    """Return the first name and what is tied with it."""
    return (_named(result) or [[]])[0]


def row_weights(rows: list[Json], material: float, telling: float = TELLING) -> Array:
    """Return the logarithms of the weights of a stored table's rows (K,), the greatest 0.

    Args:
        rows: structures with `left_out` [m], `price` [nats], `scope` and `effects`.
        material: least rms error that matters [m].
        telling: of that, the error that costs a nat between structures with as many additions.
    """
    left_out = [np.inf if r['left_out'] is None else r['left_out'] for r in rows]
    return log_weights(
        [counted(e, r['effects'], material) for e, r in zip(left_out, rows, strict=True)],
        [r['price'] for r in rows],
        [additions(r['effects'], r['scope']) for r in rows],
        material,
        telling,
    )


def _behind(result: Json) -> float:
    """Nats by which the weight of the structure that is told is below the greatest."""
    rows = result['diagnosis']['structures']
    return next((-float(r['log_weight']) for r in rows if r['chosen']), np.inf)


QUESTIONS: dict[str, Question] = {
    'false_alarms': Question(
        'healthy machines said to lack something',
        _kind('none'),
        lambda r: bool(r['diagnosis']['effects'] or r['diagnosis']['verdict'] == 'unexplained'),
        wanted=False,
    ),
    'false_doubts': Question(
        'healthy machines not said to be healthy',
        _kind('none'),
        lambda r: bool(r['diagnosis']['verdict'] != 'none'),
        wanted=False,
    ),
    'open_doubts': Question(
        'the same: another stiffness was held out than the one under which both were fitted',
        lambda r: bool(r['kind'] == 'none' and _left_open(r)),
        lambda r: bool(r['diagnosis']['verdict'] != 'none'),
        wanted=False,
    ),
    'clear_exact': Question(
        'single effects of twice the noise and more: the first name is right',
        _clear,
        lambda r: bool(set(_first(r)[:1]) & set(r['effects'])),
    ),
    'clear_in_set': Question(
        'the same: the right name, or tied with the first',
        _clear,
        lambda r: bool(set(_first(r)) & set(r['effects'])),
    ),
    'clear_wrong_confident': Question(
        'the same: a wrong name without an alternative', _clear, _wrong, wanted=False
    ),
    'pair_both_clear': Question(
        'machines with several effects, each of the noise and more: all named',
        _clear_pair,
        _both,
    ),
    'false_scope': Question(
        'another hold, or an onset, told of a machine that has none',
        lambda r: True,
        _false_scope,
        wanted=False,
    ),
    'greatest_weight': Question(
        'the structure that is told has the greatest weight, or within a nat of it',
        lambda r: any('price' in row for row in r['diagnosis'].get('structures', ())),
        lambda r: _behind(r) < 1.0,
    ),
    'unknown_told_or_described': Question(
        'effects outside the catalogue when the generators were written: told as incomplete, or '
        'described or rightly named to within 1.2 of the noise',
        _kind('unknown'),
        lambda r: _told(r) or _described(r),
    ),
}


def scores(results: list[Json]) -> Json:
    """Score diagnosed cases."""
    by = {k: [r for r in results if r['kind'] == k] for k in ('none', 'single', 'pair', 'unknown')}
    clear = [r for r in results if _clear(r)]
    first = [(r, _first(r)) for r in clear]
    detection = {}
    for low, high in _BINS:
        inside = [r for r in by['single'] if low <= r['ratio'] < high]
        detection[f'{low:g}-{high:g}'] = share(
            [r['diagnosis']['verdict'] != 'none' for r in inside]
        )
    known = [r for r in results if r['kind'] != 'unknown']
    # Jitter and lines cannot be predicted: the aim there is what the true structure leaves.
    against = [
        r['diagnosis']['error']['after'] / max(r['true_structure_error'], r['clean_floor'])
        for r in known
    ]
    floors = [r['diagnosis']['error']['after'] / r['clean_floor'] for r in known]
    return {
        'schema': 'actuator_glue.blind/1',
        'cases': len(results),
        **{
            key: share([question.yes(r) for r in results if question.of(r)])
            for key, question in QUESTIONS.items()
        },
        'detection_by_ratio': detection,
        'clear_group': share([bool(_groups(n[:1]) & _groups(r['effects'])) for r, n in first]),
        'clear_mean_set_size': float(np.mean([len(n) for _, n in first if n] or [0.0])),
        'all_wrong_confident': share([_wrong(r) for r in results]),
        'clear_extra_effects': share([len(_named(r)) > 1 for r in clear]),
        'unknown_told': share([_told(r) for r in by['unknown']]),
        'unknown_told_clear': share([_told(r) for r in by['unknown'] if r['ratio'] >= _CLEAR]),
        'unknown_described': share([_described(r) for r in by['unknown']]),
        'pair_both': share([_both(r) for r in by['pair']]),
        'after_over_true_structure': _quantiles(against),
        'after_over_noise': _quantiles(floors),
        'seconds_median': float(np.median([r['seconds'] for r in results])),
    }


def _quantiles(values: list[float]) -> Json:
    if not values:
        return {'median': None, 'p90': None}
    return {'median': float(np.median(values)), 'p90': float(np.quantile(values, 0.9))}


def table(summary: Json) -> str:
    """Return the scores as text."""
    lines = []
    for key, value in summary.items():
        if isinstance(value, dict) and 'ci' in value:
            lines.append(_line(key, value))
        elif key == 'detection_by_ratio':
            lines += [_line(f'detected, diagnosis/noise {k}', v) for k, v in value.items()]
        elif isinstance(value, dict):
            lines.append(f'{key:34s} median {value["median"]}, 90 % {value["p90"]}')
        else:
            lines.append(f'{key:34s} {value}')
    return '\n'.join(lines)


def _line(key: str, value: Json) -> str:
    if not value['n']:
        return f'{key:34s} no case'
    low, high = value['ci']
    return f'{key:34s} {value["share"]:6.1%}  [{low:.1%}, {high:.1%}]  n = {value["n"]}'
