"""The runs of an estimator that began again while it was recorded, each with its samples."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain

from actuator_glue.errors import InputError
from actuator_glue.online.playback import Item
from actuator_glue.online.replay_comparison import Published
from actuator_glue.sample_block import Block, check_block
from actuator_glue.setups import Setups, StreamSetup


def shares(
    items: Iterable[Item], runs: Sequence[Published]
) -> Iterator[tuple[Published, Iterator[Item]]]:
    """Yield each run of an estimator with what it received: set-ups in force, then samples.

    Whatever of a run's items is not taken before the next run is asked for is passed over. The
    last run has all that is left.

    Args:
        items: set-ups, blocks and previews as a bag holds them.
        runs: in order, those that can be repeated.
    """
    stream = _Stream(iter(items))
    for run, following in zip(runs, [*runs[1:], None], strict=True):
        share = chain(stream.in_force(), stream.until(run, last=following is None))
        yield run, share
        for _ in share:
            pass


class _Stream:
    """Items one after the other, and which set-ups hold where they stand."""

    def __init__(self, items: Iterator[Item]) -> None:
        self._items = items
        self._held: list[Item] = []
        self._setups = Setups()
        self._current: StreamSetup | None = None
        self._following: int | None = None
        self._blocks = 0

    def in_force(self) -> list[Item]:
        """Return the set-up that holds and those announced, as whoever joins late gets them."""
        now = [] if self._current is None else [self._current]
        return [*now, *self._setups.announced]

    def until(self, run: Published, last: bool) -> Iterator[Item]:
        """Yield what comes until the last result of a run; all of it where it is the last run."""
        for item in chain(self._held, self._items):
            self._held = []
            if isinstance(item, Block):
                # A recorder that stalls may take a posterior before the samples it is of.
                missed = item.index == self._following and item.index < run.stop
                if not last and self._blocks >= run.until and not missed:
                    self._held = [item]
                    return
                self._pass(item)
            elif isinstance(item, StreamSetup) and self._setups.announce(item, self._following):
                self._current = item
            yield item

    def _pass(self, block: Block) -> None:
        """Note the set-ups that begin within a block."""
        self._blocks += 1
        count = max(len(block.command), len(block.measured))
        try:
            check_block(block)
        except InputError:
            # Its index may be anything, too; an estimator does not follow it either.
            if block.index == self._following:
                self._following += count
            return
        for _, begun in self._setups.parts(block.index, count, self._following):
            self._current = begun[-1] if begun else self._current
        self._following = block.index + count
