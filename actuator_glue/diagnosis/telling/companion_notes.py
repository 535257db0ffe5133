"""Effects that are there but too small to be told, in sentences for people."""

from __future__ import annotations

from collections import Counter

from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.search.companions import beyond, with_companions
from actuator_glue.diagnosis.thresholds import SEEN
from actuator_glue.diagnosis.trial import Trial, removed
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import rms
from actuator_glue.model.effects import CATALOGUE


def sentences(final: Trial, larger: Trial, held: Data, missed: bool) -> tuple[str, ...]:
    """Name the companions, and how little error they remove.

    Args:
        final: the reported structure.
        larger: the same with its companions.
        held: the held-out part.
        missed: whether the held-out part shows more than noise. Then its error with and without
            them is told, too: that they do not matter holds for the fitting records only.
    """
    names = beyond(final, larger)
    if not names:
        return ()
    kinds = Counter(e.group for e in CATALOGUE.values())
    like = any(kinds[e.group] > 1 for e in larger.structure.entries if e.name in names)
    said = (
        f'{", ".join(names)}{" (or what is like it)" if like else ""} may be there, too: '
        'beyond chance, but it removes '
        f"{1e6 * removed(final, larger):.1f} um of the fitting records' error, less than what "
        'matters; intervals allow for it'
    )
    if missed:
        left = (1e6 * _left(held, t) for t in (larger, final))
        said += '; the held-out part leaves {:.1f} um with it, {:.1f} um without'.format(*left)
    return (said,)


def hint(beam: BeamSearch, final: Trial, held: Data) -> tuple[str, ...]:
    """Name effects that may explain the held-out part where the answer does not.

    Args:
        beam: what chose the structure.
        final: a structure that leaves nothing material of the fitting records.
        held: the held-out part, which shows more than noise.

    Returns:
        Nothing where no effect beyond chance in the fitting records explains the held-out part.
    """
    larger = with_companions(beam, final, alone=False)
    names = beyond(final, larger)
    with_it, without = _left(held, larger), _left(held, final)
    if not names or without - with_it < SEEN * beam.material:
        return ()
    return (
        f'{", ".join(names)} (or what is like it) is not added: beyond chance, but it removes '
        f"{1e6 * removed(final, larger):.2g} um of the fitting records' error, less than what "
        f'matters; the held-out part leaves {1e6 * with_it:.2g} um with it, {1e6 * without:.2g} '
        'um without: fit a record like it',
    )


def _left(held: Data, trial: Trial) -> float:
    return rms(held.target - held.simulate(trial.model, trial.fit.theta)[0])
