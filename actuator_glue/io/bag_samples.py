"""SampleBlock and TestSetup messages of a bag, checked one by one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from actuator_glue import sample_block
from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import BagMessage, Summary, content
from actuator_glue.io.messages import full_name
from actuator_glue.records import check_period
from actuator_glue.sample_block import Block, stamp_ns
from actuator_glue.setups import StreamSetup, from_message

SAMPLE_BLOCK = full_name('SampleBlock')


class BagBlock(NamedTuple):
    """One SampleBlock, and whose samples it has."""

    topic: str
    actuator: str
    block: Block


@dataclass(frozen=True, slots=True)
class BagSetup:
    """One TestSetup, and the time from which on it holds."""

    topic: str
    stamp_ns: int
    setup: StreamSetup


def samples(found: BagMessage, path: Path | str) -> BagBlock:
    """Return a SampleBlock of a bag.

    Raises:
        InputError: bytes that are no such message, an absurd period, channels of different
            lengths.
    """
    said = content(found, path)
    block = sample_block.from_message(said)
    at = f'{path}: topic {found.topic}: block at sample {block.index}'
    check_period(block.period, at)
    channels = block.command, block.measured, block.force
    if len({len(channel) for channel in channels if channel is not None}) != 1:
        raise InputError(f'{at} has channels of different lengths')
    return BagBlock(found.topic, said.header.frame_id, block)


def setup(found: BagMessage, path: Path | str) -> BagSetup:
    """Return a TestSetup of a bag.

    Raises:
        InputError: bytes that are no such message, or an impossible stiffness, rate or hold.
    """
    said = content(found, path)
    try:
        return BagSetup(found.topic, stamp_ns(said.header), from_message(said))
    except InputError as error:
        raise InputError(f'{path}: topic {found.topic}: {error}') from None


def topics_of_actuator(
    bag: Path | str, summary: Summary, namespace: str | None, option: str = '--namespace'
) -> list[str]:
    """Return the topics of one actuator, that of a namespace or the only one.

    Args:
        bag: for messages.
        summary: what it holds.
        namespace: the one that is wanted; None for the only one.
        option: by which a namespace is chosen, for messages.

    Raises:
        InputError: no samples there, or several actuators and no namespace.
    """
    samples = [t.name for t in summary.topics.values() if t.type.endswith('/SampleBlock')]
    spaces = [name.rpartition('/')[0] for name in samples]
    if namespace is not None:
        wanted = '/' + namespace.strip('/') if namespace.strip('/') else ''
        if wanted not in spaces:
            raise InputError(
                f'{bag}: no samples under {namespace!r}; there are samples under '
                f'{", ".join(s or "/" for s in spaces) or "nothing"}'
            )
    elif len(samples) > 1:
        raise InputError(
            f'{bag}: samples of {len(samples)} actuators ({", ".join(samples)}); choose one with '
            f'{option}'
        )
    else:
        wanted = spaces[0] if spaces else ''
    found = [t for t in summary.topics if t.rpartition('/')[0] == wanted]
    setups = [t.name for t in summary.topics.values() if t.type.endswith('/TestSetup')]
    # Where topics were renamed, the only set-up is that of the only samples: as in records.
    if len(samples) == len(setups) == 1 and setups[0] not in found:
        found += setups
    return found
