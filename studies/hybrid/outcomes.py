"""Outcomes in a file that grows by a line an actuator, so that a study can be gone on with."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from actuator_glue.errors import InputError
from studies.hybrid.trial import Outcome, design, trial


class Outcomes:
    """The outcomes of a study so far.

    Args:
        path: the file; made where there is none.

    Attributes:
        known: outcomes by seed.

    Raises:
        InputError: a file of another study, or of this one with other settings.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.known: dict[int, Outcome] = {}
        if not path.exists():
            path.write_text(json.dumps(design()) + '\n', encoding='utf-8')
            return
        first, *rest = path.read_text(encoding='utf-8').split('\n')
        try:
            if json.loads(first) != design():
                raise InputError(
                    f'{path} was made with other settings of the study; --force begins anew'
                )
            for line in rest[:-1]:  # what a stopped run left half written has no end of line
                found = Outcome(**json.loads(line))
                self.known[found.seed] = found
        except (TypeError, ValueError) as error:
            raise InputError(f'{path} holds no outcomes ({error}); --force begins anew') from error
        if rest and rest[-1]:
            path.write_text('\n'.join([first, *rest[:-1], '']), encoding='utf-8')

    def add(self, found: Outcome) -> None:
        """Note an outcome, in the file as well."""
        self.known[found.seed] = found
        with self._path.open('a', encoding='utf-8') as file:
            file.write(json.dumps(found.to_json()) + '\n')


def made(seeds: Iterable[int], workers: int) -> Iterator[Outcome]:
    """Yield the outcomes of actuators as they are made, in so many processes."""
    if workers == 1:
        yield from map(trial, seeds)
        return
    with ProcessPoolExecutor(workers, get_context('spawn')) as pool:
        for done in as_completed([pool.submit(trial, seed) for seed in seeds]):
            yield done.result()
