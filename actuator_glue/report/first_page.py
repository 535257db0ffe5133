"""The first page of an answer: on a terminal and in a report the same things in the same order."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable
from typing import NamedTuple

from actuator_glue.report.html import Block, Note, Picture, Table, Text

# What stands behind the path of a file or bag in the name of a record; one letter is a drive.
_BEHIND = re.compile(r'(?:(?<=\w\w):/.*| \((?:resampled|record \d|join).*\))$')


class FirstPage(NamedTuple):
    """What a person is told first.

    Attributes:
        verdict: what came out, a line each, the shortest first.
        certainty: how sure that is: one number with its meaning.
        picture: what the model leaves, and the noise; None on a terminal.
        error: before and after [um].
        parameters: before and after, with 95 % intervals.
        delay: of the actuator [ms]; empty where it is not known.
        remedies: what each effect is at the machine, and what to do.
        hybrid: what it means for a hybrid test; empty without one.
        command: what to type next.
    """

    verdict: tuple[str, ...]
    certainty: str
    picture: Picture | None
    error: Table
    parameters: Table | None
    delay: str = ''
    remedies: tuple[str, ...] = ()
    hybrid: str = ''
    command: str = ''

    def ending_with(self, command: str) -> FirstPage:
        """Return the page with another command to type next; as it is for an empty one."""
        return self._replace(command=command) if command else self

    def blocks(self, *, headline: bool = True) -> list[Block]:
        """Return the page; without its headline where that stands above already."""
        lines = self.verdict if headline else self.verdict[1:]
        out: list[Block] = [Text(line) for line in (*lines, f'How sure: {self.certainty}.')]
        if self.picture is not None:
            out.append(self.picture)
        out.append(self.error)
        if self.parameters is not None:
            out.append(self.parameters)
        if self.delay:
            out.append(Text(f'Delay: {self.delay}.'))
        out += [Text(line) for line in self.remedies]
        if self.hybrid:
            out.append(Text(self.hybrid))
        if self.command:
            out.append(Note(f'Next: {self.command}'))
        return out


def command(
    verb: str,
    tests: Iterable[tuple[str, float | None]],
    *options: str,
    held: Iterable[tuple[str, float | None]] = (),
) -> str:
    """Return a command over tests as a shell takes it.

    Args:
        verb: the command.
        tests: source and specimen stiffness [N/m] of each record; a stiffness that the file says
            may be None.
        options: what is typed behind them.
        held: the same of records that are held out.
    """
    stiffness: dict[str, list[str]] = {}
    for source, k in tests:
        of = stiffness.setdefault(_BEHIND.sub('', source) or 'RECORD', [])
        if k is not None:
            of.append(f'{k:g}')
    words = ['actuator-glue', verb, *(shlex.quote(path) for path in stiffness)]
    told = [k[0] for k in stiffness.values() if k]
    apart = {_BEHIND.sub('', source): k for source, k in held}
    if len(told) == len(stiffness) and all(len(set(k)) == 1 for k in stiffness.values()):
        others = [f'{k:g}' for k in apart.values() if k is not None]
        # One that all of them have is that of held-out records, too.
        more = others if len(others) == len(apart) and len({*told, *others}) > 1 else []
        words += ['--stiffness', *told, *more]
    for source in apart:
        words += ['--holdout', shlex.quote(source)]
    return ' '.join([*words, *(shlex.quote(option) for option in options)])
