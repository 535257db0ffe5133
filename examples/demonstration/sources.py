"""Where the samples of the demonstration come from: the simulator or a laboratory file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.records import Array, Hold

# Commands are published this far ahead, so that a forecast precedes its data.
PREVIEW = 2.0  # s
REST = 1.0  # s of rest before the simulated command
BLOCKS_PER_SECOND = 50.0
# The simulated actuator: near the paper's Table 2, not equal to it.
TRUTH = {'beta_1': 134.0, 'alpha_1_beta_0': 1.1e9, 'alpha_2': 2.5e5, 'alpha_3': 0.5}
STIFFNESS = 250e3  # N/m, the paper's second test
# What its oil does to it while it warms: one parameter grows by so much of itself in a second.
DRIFTS, DRIFT = 'alpha_1_beta_0', 0.03 / 60.0  # 1/s
# What the live chain has to find, in a test that leaves it the time to on a busy machine: a second
# look needs twice the data of the first.
PROMISED_EFFECT, PROMISED_SECONDS = 'backlash', 90.0


@dataclass(frozen=True, slots=True)
class Truth:
    """True parameters of Eq. (2), of which one drifts.

    Attributes:
        start: at the first sample, shape (4,).
        growth: of each, as a share of itself per second, shape (4,) [1/s].
    """

    start: Array
    growth: Array

    def over(self, posteriors: Sequence[Any]) -> Array:
        """Return what each window's posterior stands for, shape (windows, 4).

        That is the truth in its middle; with a model that has the drift itself, at its start.
        """
        found = np.empty((len(posteriors), len(self.start)))
        for row, p in zip(found, posteriors, strict=True):
            middle = 0.0 if 'gain-drift' in list(p.effects) else 0.5 * int(p.samples)
            row[:] = self.start * (1.0 + self.growth * (int(p.index) + middle) * float(p.period))
        return found


@dataclass(frozen=True, slots=True)
class Source:
    """What is streamed.

    Attributes:
        node: node that publishes the samples and ends after the last one.
        parameters: its parameters.
        samples: how many it will publish.
        title: what it is, for people.
        truth: true parameters where it is simulated.
        drift_of: what the estimator is told of their drift.
        hidden: names of the effects that no node is told of.
        promises: the live chain has to find all of them.
    """

    node: str
    parameters: dict[str, Any]
    samples: int
    title: str
    truth: Truth | None = None
    drift_of: tuple[str, ...] = ()
    hidden: tuple[str, ...] = ()
    promises: bool = False


def simulator(
    seconds: float, rate: float, stiffness: float | None, effect: str, sealed: Path, seed: int
) -> Source:
    """Return the simulated actuator under the paper's sweep, 0 to 10 Hz in `seconds`.

    Args:
        seconds: length of the sweep [s].
        rate: samples per second [Hz].
        stiffness: specimen stiffness [N/m], the paper's where None.
        effect: effects the nodes are not told of, joined by '+'; empty for none. Beside them
            the oil warms, unless they say how the gain drifts.
        sealed: file that gets the truth.
        seed: seed of the noise.
    """
    k = STIFFNESS if stiffness is None else stiffness
    parameters: dict[str, Any] = {
        'rate': float(rate),
        'block': max(1, round(rate / BLOCKS_PER_SECOND)),
        'duration': float(seconds),
        'rest': REST,
        'specimen_stiffness': float(k),
        'seed': seed,
        'preview': PREVIEW,
        'exit_at_end': True,
        **TRUTH,
    }
    growth = np.zeros(len(TRUTH))
    hidden = [effect] if effect else []
    drift_of: tuple[str, ...] = ()
    if 'gain-drift' not in effect:
        growth[list(TRUTH).index(DRIFTS)] = DRIFT
        hidden.append(f'gain-drift:gain_drift={DRIFT!r}')
        # A random walk that comes as far in the time of the test.
        drift_of = (f'{DRIFTS}={DRIFT * np.sqrt(3600.0 * seconds):.3g}',)
    parameters |= {'undeclared_effect': '+'.join(hidden), 'sealed_file': str(sealed.resolve())}
    return Source(
        'actuator_sim',
        parameters,
        round(seconds * rate) + 1 + round(REST * rate),
        f'simulated actuator, {k / 1e3:g} kN/m',
        Truth(np.array(list(TRUTH.values())), growth),
        drift_of,
        tuple(word.partition(':')[0] for word in '+'.join(hidden).split('+') if word),
        effect == PROMISED_EFFECT and seconds >= PROMISED_SECONDS,
    )


def laboratory(
    path: Path, channels: Path | None, stiffness: float | None, hold: Hold | None
) -> Source:
    """Return a laboratory file or bag, streamed at its own rate.

    Raises:
        InputError: the file cannot be used, or nobody says its specimen stiffness.
    """
    from actuator_glue.io.load import load_records

    records = load_records(
        [str(path)],
        stiffness=None if stiffness is None else [stiffness],
        channels=None if channels is None else str(channels),
        hold=hold,
    )
    for record in records:
        record.known_stiffness()
    parameters: dict[str, Any] = {
        'file': str(path.resolve()),
        'block': max(1, round(records[0].rate / BLOCKS_PER_SECOND)),
        'preview': PREVIEW,
    }
    if channels is not None:
        parameters['channels'] = str(channels.resolve())
    if stiffness is not None:
        parameters['specimen_stiffness'] = float(stiffness)
    if hold is not None:
        parameters['hold'] = hold
    return Source('lab_bridge', parameters, sum(len(r) for r in records), path.name)
