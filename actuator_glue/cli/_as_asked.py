"""A command to type next, with the options that this one was given."""

from __future__ import annotations

import argparse
import importlib
import shlex
from collections.abc import Iterator
from typing import Any

from actuator_glue.arguments import Output, duration

# What a command says of records by itself, and options of no meaning without another one.
_SAID = ('stiffness', 'holdout', 'effect')
_BEHIND = {'resample_by': 'resample', 'drift': 'prior', 'prior_age': 'prior'}


def as_asked(command: str, args: argparse.Namespace) -> str:
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
