"""Thresholds of a diagnosis: what counts as material, as decisive, as explained.

What a caller may set, then limits of decisions that are fixed: each with its reason and, where it
was measured, the machines that it came from (docs/scores.md). None of these machines judges.
Numerical settings (iterations, tolerances, grids) stand where they are used.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Thresholds:
    """What a caller may set.

    Attributes:
        false_alarms: probability of an addition on a healthy machine (score/false_alarms.py).
        most: most effects added.
        evaluations: of the posterior's likelihood, at most; 0 takes the Laplace approximation.
        effort: work of all refits after which no further search is begun (diagnosis/effort.py).
        use_force: the recorded force chooses among tied names (search/force_ranking.py).
    """

    false_alarms: float = 0.01
    most: int = 6
    evaluations: int = 12_000
    effort: float = 7e7
    use_force: bool = False


# An effect is material where it removes more than this share of the noise rms, and more than this
# share of the command's amplitude.
NOISE_SHARE: Final = 0.5
STROKE_SHARE: Final = 1e-3


def least_material(noise: float, stroke: float) -> float:
    """Return the least rms error that matters [m].

    Args:
        noise: rms of what no structure explains [m].
        stroke: amplitude of the command [m].
    """
    return max(NOISE_SHARE * noise, STROKE_SHARE * stroke)


# Of the error removed so far: where most is explained, a further effect must remove so much.
LATER_SHARE: Final = 0.08
# Smallest out-of-sample evidence for another set-up or a generic surrogate.
NATS: Final = 10.0

# Unexplained means that material structure is left above this share of the noise and above this
# share of the structure found at first.
LEFT_NOISE: Final = 0.6
LEFT_SHARE: Final = 0.3
# The same two where a generic surrogate explains more than the names do: 0.28 of the noise is
# found in noise alone.
BEATEN_NOISE: Final = 0.3
BEATEN_SHARE: Final = 0.15

# Structures of one effect carried on to two; one fewer with each further effect.
BEAM: Final = 3
# Refits per structure after the first stage, best screened first; the same for learned terms.
TRIED: Final = 5
TERMS: Final = 4

# The weight of a structure (score/weights.py): error that costs a nat, over what matters. A tenth
# of what matters costs four; with twice this value friction's shape was lost, with ten times a
# delay was not told from a lag.
TELLING: Final = 0.05
# The same for another addition: an effect that just matters gains four nats.
MATTERING: Final = 0.5

# Of what matters: a description must remove so much beyond the name it replaces, since a name says
# what to mend.
REPLACING: Final = 0.5

# Of what matters: two effects that remove this share each remove what matters together.
TOGETHER: Final = 0.5**0.5
# Of what matters: a rough refit that removes less will not become material when finished.
ROUGHLY: Final = 0.5
# Times another's squared error: too far behind to be worth finishing.
FAR: Final = 1.5
# Squared error that signatures promise, over that of the refit, at most: for the learned terms of
# 13 machines it was 2.4 at most.
PROMISED: Final = 4.0
# Squared error that a refit removes, over what signatures promise, at most: for the names that
# came to matter on 16 machines it was 4.0 at most. Where none promises any of what remains, they
# say nothing (`Refits._wanted`).
UNDERSTATED: Final = 6.0
# Of the best one's removed error: a tie needs nearly all of it, so a rough refit of a rival that
# removes less is not worth finishing.
WORTH_FINISHING: Final = 0.9

# Two effects cannot be told apart where their weights differ by less [nats].
TIE_NATS: Final = 4.0
# Between equations for the same thing an error of this share of what they remove costs a nat.
TIE_SHARE: Final = 0.03
# Of what the best removes: a rival that removes less is not tied, whatever its weight.
TIED: Final = 0.5
# Effects too small to be told, at most, whose sizes are free beside those told.
COMPANIONS: Final = 2
# Of what matters: on long records, simulation steps cause smaller errors beyond chance, too.
SEEN: Final = 0.2
# Share of the weight of all effects tried that a group must have to be told from the others.
GROUP_ALONE: Final = 0.9

# Names after which learned terms are tried: they may be plainer than further names.
NAMES_FIRST: Final = 2
MOST_TERMS: Final = 2
# Share of the squared error that a generic regression must remove to point at a place.
POINTING: Final = 0.3

# Times the other set-up's mean square: more than half of the error is the set-up's.
SETUP_FAR: Final = 2.0
# Share of the squared error that impulses must carry to have swayed a search: two per cent of it
# are one per cent of the rms error. Or the standard deviations that they move a parameter by.
SWAYING: Final = 0.02
MOVING: Final = 1.0
# A move that was refused with this share of the present data would be refused again.
STILL_REFUSED: Final = 0.125

# p-value below which the sizes of an effect in stretches of the records differ, where their
# spread is also above a share of the size: a smaller one matters to nobody. A stretch counts where
# its standard error is below a share of the size.
DISAGREE: Final = 0.01
SPREAD: Final = 0.25
STRETCH_KNOWN: Final = 0.5

# Times the noise's mean square: less than half of the held-out error is noise then.
FAR_FROM_NOISE: Final = 2.0
# Of what matters, removed in the held-out part by what was added.
SOME_REMOVED: Final = 0.5
# Probability that a name, or one of those tied with it, must have to be told as missing.
LIKELY: Final = 0.5
