"""Print what makes bash, zsh or fish complete commands, options and their choices."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator
from dataclasses import dataclass

_USE = {
    'bash': 'echo \'eval "$(actuator-glue completion bash)"\' >> ~/.bashrc',
    'zsh': 'echo \'eval "$(actuator-glue completion zsh)"\' >> ~/.zshrc',
    'fish': 'actuator-glue completion fish > ~/.config/fish/completions/actuator-glue.fish',
}
_BASH = """\
_actuator_glue() {{
    local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD-1]}} command='' word
    for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
        [[ $word == -* ]] || {{ command=$word; break; }}
    done
    local words=''
    case "$command $prev" in
{choices}
    esac
    if [[ -z $words ]]; then
        if [[ -z $command ]]; then
            words={commands}
        elif [[ $cur == -* ]]; then
            case "$command" in
{options}
            esac
        fi
    fi
    COMPREPLY=()
    if [[ -n $words ]]; then
        COMPREPLY=($(compgen -W "$words" -- "$cur"))
    else
        compopt -o filenames 2>/dev/null
        COMPREPLY=($(compgen -f -- "$cur"))
    fi
}}
complete -F _actuator_glue actuator-glue
"""


@dataclass(frozen=True, slots=True)
class _Option:
    command: str
    names: list[str]
    choices: list[str]
    takes: bool
    help: str


EXAMPLES = (
    'completion bash',
    'completion fish',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    uses = '; '.join(f'{shell}: `{line}`' for shell, line in _USE.items())
    parser.add_argument('shell', choices=tuple(_USE), help=f'which shell; to install, {uses}')


def run(args: argparse.Namespace) -> int:
    """Print the script."""
    print(script(args.shell), end='')
    return 0


def script(shell: str) -> str:
    """Return the completion script of a shell."""
    from actuator_glue.cli.main import commands, summary

    options = list(_options())
    if shell == 'fish':
        lines = ['complete -c actuator-glue -n __fish_use_subcommand -f']
        for name, file in commands().items():
            text = shlex.quote(summary(file))
            lines.append(f'complete -c actuator-glue -n __fish_use_subcommand -a {name} -d {text}')
        return '\n'.join([*lines, *map(_fish, options)]) + '\n'
    choices = [
        f'        {"|".join(_quoted(f"{o.command} {n}") for n in o.names)}) '
        f'words={_quoted(" ".join(o.choices))} ;;'
        for o in options
        if o.choices and o.names
    ]
    choices += [
        f'        {_quoted(f"{o.command} {o.command}")}) words={_quoted(" ".join(o.choices))} ;;'
        for o in options
        if o.choices and not o.names
    ]
    by_command = {
        name: ' '.join(n for o in options if o.command == name for n in o.names)
        for name in commands()
    }
    text = _BASH.format(
        choices='\n'.join(choices),
        commands=_quoted(' '.join(by_command)),
        options='\n'.join(
            f'            {n}) words={_quoted(w)} ;;' for n, w in by_command.items()
        ),
    )
    return ('autoload -U +X bashcompinit && bashcompinit\n' if shell == 'zsh' else '') + text


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "'\\''") + "'"


def _options() -> Iterator[_Option]:
    """Yield the options of every command, and arguments without a name that have choices."""
    from actuator_glue.cli.main import build_parser, commands

    for name in commands():
        parser = build_parser(name)
        (subparsers,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
        for action in subparsers.choices[name]._actions:
            choices = [str(c) for c in action.choices or ()]
            if action.option_strings or choices:
                help_text = (action.help or '').replace('%%', '%').split(';')[0]
                takes = action.nargs != 0
                yield _Option(name, list(action.option_strings), choices, takes, help_text)


def _fish(option: _Option) -> str:
    where = f'complete -c actuator-glue -n "__fish_seen_subcommand_from {option.command}"'
    parts = [where]
    for name in option.names:
        parts.append(f'-l {name[2:]}' if name.startswith('--') else f'-s {name[1:]}')
    if option.choices:
        parts.append(f'-x -a {_quoted(" ".join(option.choices))}')
    elif option.takes:
        parts.append('-r')
    return ' '.join([*parts, f'-d {_quoted(option.help)}'])
