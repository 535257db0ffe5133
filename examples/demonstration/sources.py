"""Where the samples of the demonstration come from: the simulator or a laboratory file."""

from __future__ import annotations

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


@dataclass(frozen=True, slots=True)
class Source:
    """What is streamed.

    Attributes:
        node: node that publishes the samples and ends after the last one.
        parameters: its parameters.
        samples: how many it will publish.
        title: what it is, for people.
        truth: true parameters of Eq. (2) where it is simulated.
    """

    node: str
    parameters: dict[str, Any]
    samples: int
    title: str
    truth: Array | None = None


def simulator(
    seconds: float, rate: float, stiffness: float | None, effect: str, sealed: Path, seed: int
) -> Source:
    """Return the simulated actuator under the paper's sweep, 0 to 10 Hz in `seconds`.

    Args:
        seconds: length of the sweep [s].
        rate: samples per second [Hz].
        stiffness: specimen stiffness [N/m], the paper's where None.
        effect: effects the nodes are not told of, joined by '+'; empty for none.
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
    if effect:
        parameters |= {'undeclared_effect': effect, 'sealed_file': str(sealed.resolve())}
    return Source(
        'actuator_sim',
        parameters,
        round(seconds * rate) + 1 + round(REST * rate),
        f'simulated actuator, {k / 1e3:g} kN/m',
        np.array(list(TRUTH.values())),
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
