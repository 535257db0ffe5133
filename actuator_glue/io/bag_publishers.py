"""Whether the samples of a topic are those of several publishers in turn."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_glue.sample_block import Block

# How often each of two streams must go on after the other: chance may send one block elsewhere.
_SURE = 2
# Streams that may go on: more than one where samples are lost or a test begins again.
_OPEN = 8


@dataclass(slots=True)
class _Followed:
    """Blocks that follow each other by index and time; what the next one begins with."""

    index: int
    stamp_ns: int
    # Number of the block with which it last took over from another; how often it did so again.
    taken_over: int
    resumed: int = 0


class Publishers:
    """Takes the blocks of a topic in order, and finds two publishers that share it.

    A test that begins again, or loses samples, leaves its old numbers for good. Where two publish,
    blocks go on with the numbers and the times of the one, then again with those of the other.

    Attributes:
        told: at which sample and when they begin to take turns, and what to do; empty where one
            publishes.
    """

    def __init__(self) -> None:
        self.told = self._begun = ''
        self._first = self._last = -1
        self._blocks = 0
        self._streams: list[_Followed] = []  # that of the last block at the end

    def take(self, block: Block) -> None:
        """Take the next block."""
        number, end = self._blocks, block.index + len(block)
        end_ns = block.stamp_ns + round(len(block) * block.period * 1e9)
        self._blocks += 1
        current = self._streams[-1] if self._streams else None
        follows = [one for one in self._streams[::-1] if one.index == block.index]
        # Of those that agree to the same sample the one that agrees in time; the last one of two.
        found = min(follows, key=lambda s: abs(s.stamp_ns - block.stamp_ns), default=None)
        if found is None:
            found = _Followed(end, end_ns, number)
        elif found is not current:
            self._turn(number, block, current)
            found.taken_over, found.resumed = number, found.resumed + 1
        found.index, found.stamp_ns = end, end_ns
        others = [one for one in self._streams if one is not found]
        self._streams = [*others[1 - _OPEN :], found]
        if sum(one.resumed >= _SURE for one in self._streams) > 1:
            self.told = self._begun

    def in_turn(self, number: int) -> bool:
        """Whether a block, counted from 0, is one of those that two sent in turn."""
        return bool(self.told) and self._first <= number <= self._last

    def _turn(self, number: int, block: Block, current: _Followed | None) -> None:
        """Note that a stream goes on which another one had interrupted."""
        self._last = number
        if self._begun or current is None:
            return
        self._first = current.taken_over
        self._begun = (
            f'two publishers share it: from a stamp of {1e-9 * block.stamp_ns:.3f} s on, samples '
            f'go on in turn at {block.index} and at {current.index}; have one publish, or each in '
            'a namespace of its own, and record again'
        )
