"""The first page of an answer on a terminal: what a report says first, in the same order."""

from __future__ import annotations

import argparse
import importlib
import shlex
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from actuator_glue.arguments import Input, Output, duration
from actuator_glue.cli._output import say, table

if TYPE_CHECKING:
    from actuator_glue.report.first_page import FirstPage

# What a command says of records by itself, and options of no meaning without another one.
_SAID = ('stiffness', 'holdout', 'effect')
_BEHIND = {'resample_by': 'resample', 'drift': 'prior', 'prior_age': 'prior'}


def add_partition(parser: argparse.ArgumentParser) -> None:
    """Declare `--partition`."""
    parser.add_argument(
        '--partition',
        type=Input,
        metavar='FILE|NAME',
        help='a hybrid test, as `rths` takes it: the answer says whether it bears the delay of '
        'the actuator',
    )


def show_first(page: FirstPage, args: argparse.Namespace) -> str:
    """Print the first page of a result; return the command that it ends with, for its report."""
    from actuator_glue.report.html import Picture, Table

    page = page._replace(command=_as_asked(page.command, args))
    for block in page.blocks():
        if isinstance(block, Table):
            table(block.caption, block.header, [[str(c) for c in r] for r in block.rows], args)
        elif not isinstance(block, Picture):
            say(block.text, args)
    return page.command


def _as_asked(command: str, args: argparse.Namespace) -> str:
    """Return a command with this command's options added, where it has them too."""
    words = shlex.split(command)
    kept = getattr(args, 'save', None)
    if kept is not None and kept.lower().endswith('.npz') and '--save' in words:
        # The draws have been saved: the next command plots them.
        tests = words[2 : min(words.index(w) for w in ('--effect', '--save') if w in words)]
        words = ['actuator-glue', 'plot', *tests, '--draws', kept]
    for option, texts in _given(words[1], args):
        if option not in words:
            for text in texts:
                words += [option, *text]
    return shlex.join(words)


def _given(verb: str, args: argparse.Namespace) -> Iterator[tuple[str, list[list[str]]]]:
    """Yield options of a command that this one was given, too, with their texts."""
    of_verb = argparse.ArgumentParser()
    importlib.import_module(f'actuator_glue.cli.{verb}').add_arguments(of_verb)
    for action in of_verb._actions:
        value = getattr(args, action.dest, action.default)
        if not action.option_strings or isinstance(value, Output) or action.dest in _SAID:
            continue
        if value == action.default or action.dest in ('force', 'help'):
            continue
        if getattr(args, _BEHIND.get(action.dest, action.dest)) is not None:
            several = value if isinstance(value, list) else [value]
            texts = [[] if one is True else [_text(one, action.type)] for one in several]
            yield action.option_strings[0], texts


def _text(value: Any, kind: Any) -> str:
    """Return an option's value as it is typed."""
    text = f'{value:.12g}' if isinstance(value, float) else f'{value}'
    return f'{text}s' if kind is duration else text
