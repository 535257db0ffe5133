"""Remarks that a calibration comes with: first those that forbid its use, then its limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from actuator_glue.api.calibration_parts import FitError, Marginal
from actuator_glue.diagnosis.verdict.residual_structure import ResidualStructure
from actuator_glue.inference.at_bound import Pressed
from actuator_glue.inference.convergence import APART
from actuator_glue.inference.prior_use import PriorUse
from actuator_glue.records import Array, Record

# R-hat above which draws are not yet the posterior (Vehtari et al. 2021).
CONVERGED = 1.01
TIED = 0.99  # correlation above which two parameters are only known together
MISFIT = 0.1  # share of a record's spread: a model that leaves more does not describe the test


def converged(parameters: Mapping[str, Marginal]) -> bool:
    """Whether the chains of every parameter have met."""
    return all(p.rhat <= CONVERGED for p in parameters.values())


def problems(
    found: Sequence[Pressed],
    parameters: Mapping[str, Marginal],
    fit: FitError,
    prior: PriorUse | None,
    left: ResidualStructure | None,
    doubtful: Sequence[str],
) -> list[str]:
    """Return why a posterior must not be used as it stands, one line each; empty where it may.

    Args:
        found: parameters at a bound.
        parameters: posterior of each parameter.
        fit: error of the best draw.
        prior: what was known before, if anything.
        left: structure and noise of the residual, where they can be told.
        doubtful: of records that cannot be what they say, see `suspicions` and `unlike_rest`.
    """
    told = []
    apart = {n: p.rhat for n, p in parameters.items() if not p.rhat <= APART}
    if apart:
        name = max(apart, key=apart.__getitem__)
        told.append(
            f'no posterior was reached: the chains of {", ".join(apart)} have not met (R-hat '
            f'{apart[name]:.3g} of {name}, above {APART}); give more --evaluations'
        )
    poor = [r for r in fit.records if r.nrmse is not None and r.nrmse > MISFIT]
    if poor:
        where = ', '.join(
            f'{100 * (r.nrmse or 0.0):.0f} % in {r.source or "a record"}' for r in poor
        )
        offset = ''
        if any(abs(r.offset_m) > 0.5 * r.rms_m for r in poor):
            most = max((r.offset_m for r in poor), key=abs)
            offset = f' (a constant offset of {1e3 * most:.3g} mm takes part of it)'
        told.append(
            f'the model does not fit: the best draw leaves {where} of the spread measured'
            f'{offset}; check channels, signs, units and which record has which stiffness, then '
            '`diagnose`'
        )
    structure = None if left is None else left.problem()
    if structure is not None and left is not None:
        # If the set-up is wrong, the other problems follow from it.
        told.insert(0 if left.setup else len(told), structure)
    told += doubtful
    if prior is not None and prior.contradicted:
        told.append(prior.contradiction())
    for p in found:
        if p.physical:
            continue
        unit = parameters[p.name].unit
        unit = '' if unit == '1' else f' {unit}'
        told.append(
            f'{p.name} is pressed against the {p.side} bound {p.bound:g}{unit} of its prior: the '
            'records ask for more, and its mean and spread are those of the bound; widen it with '
            f'--bounds {p.name}=LO:HI'
        )
    return told


def remarks(
    records: Sequence[Record],
    parameters: Mapping[str, Marginal],
    draws: Array,
    met: bool,
    found: Sequence[Pressed],
    prior: PriorUse | None = None,
) -> list[str]:
    """Return what these records cannot tell, and what would."""
    told = []
    if prior is not None:
        told.append(prior.remark())
    if not met:
        told.append(
            f'not converged (R-hat above {CONVERGED}); give more evaluations or, where the search '
            'for the start ended beside the posterior, another seed'
        )
    told += [
        f'{p.name} lies at 0, below which it has no meaning: the records tell how large it is at '
        'most'
        for p in found
        if p.physical
    ]
    names = list(parameters)
    open_ = [f'{n}: little more than its prior' for n in names if parameters[n].prior_dominated]
    correlation = np.corrcoef(draws, rowvar=False)
    for i, j in zip(*np.triu_indices(len(names), 1), strict=True):
        if abs(correlation[i, j]) > TIED:
            open_.append(f'{names[i]} and {names[j]}: only a combination of them is known')
    if open_ and len({r.stiffness for r in records}) < 2:
        open_.append('a second record with another specimen stiffness would tell more')
    return told + open_
