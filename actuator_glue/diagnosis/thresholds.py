"""Thresholds of a diagnosis: what counts as material, as decisive, as explained."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Thresholds:
    """Thresholds, calibrated on benchmark seeds that are not reported (docs/scores.md).

    Attributes:
        noise_share: an effect is material where it removes more than this share of the noise rms,
        stroke_share: and more than this share of the command's amplitude.
        later_share: where most is explained, a further effect must remove this share of it.
        false_alarms: probability of an addition on a healthy machine (score/false_alarms.py).
        nats: smallest out-of-sample evidence for another set-up or a generic surrogate.
        tie_nats: two effects cannot be told apart where their weights differ by less.
        tie_share: between equations for the same thing an error of this share of what they remove
            costs a nat.
        left_noise: the model is unexplained where structure above this share of the noise
        left_share: and above this share of the structure found at first remains;
        beaten_noise, beaten_share: as left_noise and left_share, where a generic surrogate
            explains more than the names do (0.28 of the noise is found in noise alone).
        most: most effects added.
        beam: structures of one effect carried on to two; one fewer with each further effect.
        evaluations: of the posterior's likelihood, at most; 0 takes the Laplace approximation.
        tried: refits per structure after the first stage, best screened first.
        terms: the same of learned terms.
        effort: work of all refits after which no further search is begun (diagnosis/effort.py).
        use_force: the recorded force chooses among tied names (search/force_ranking.py).
    """

    noise_share: float = 0.5
    stroke_share: float = 1e-3
    later_share: float = 0.08
    false_alarms: float = 0.01
    nats: float = 10.0
    tie_nats: float = 4.0
    tie_share: float = 0.03
    left_noise: float = 0.6
    left_share: float = 0.3
    beaten_noise: float = 0.3
    beaten_share: float = 0.15
    most: int = 6
    beam: int = 3
    tried: int = 5
    terms: int = 4
    evaluations: int = 12_000
    effort: float = 7e7
    use_force: bool = False

    def material(self, noise: float, stroke: float) -> float:
        """Return the least rms error that matters [m].

        Args:
            noise: rms of what no structure explains [m].
            stroke: amplitude of the command [m].
        """
        return max(self.noise_share * noise, self.stroke_share * stroke)
