"""Completion scripts, asked as the shells ask them."""

import shutil
import subprocess
from functools import cache

import pytest

from actuator_glue.cli import completion
from actuator_glue.cli.main import commands, main

script = cache(completion.script)  # it asks every command for its options


def bash(*words: str, shell: str = 'bash') -> list[str]:
    """Return what bash offers after some words, the last of which is being typed."""
    line = ' '.join(f"'{w}'" for w in ('actuator-glue', *words))
    ask = f'COMP_WORDS=({line}); COMP_CWORD={len(words)}; _actuator_glue; '
    done = subprocess.run(
        ['bash', '-c', script(shell) + ask + 'printf "%s\\n" "${COMPREPLY[@]}"'],
        capture_output=True,
        text=True,
        check=True,
    )
    assert not done.stderr
    return done.stdout.split()


def test_bash_offers_commands_options_and_choices() -> None:
    """All commands, the options of the command that stands there, the choices of an option."""
    assert set(bash('')) == set(commands())
    assert bash('cal') == ['calibrate']
    assert '--stiffness' in bash('calibrate', 'x.csv', '--st')
    assert '--report' not in bash('info', '--')
    assert set(bash('info', '--hold', '')) == {'zoh', 'linear'}
    assert set(bash('completion', '')) == {'bash', 'zsh', 'fish'}


def test_bash_offers_files(tmp_path, monkeypatch) -> None:
    """Where neither option nor choice is asked for."""
    (tmp_path / 'record.csv').touch()
    monkeypatch.chdir(tmp_path)
    assert bash('info', 'rec') == ['record.csv']


@pytest.mark.parametrize('shell', ['zsh', 'fish'])
def test_other_shells_take_the_script(shell: str) -> None:
    """Parsed by the shell itself, where it is installed."""
    text = script(shell)
    assert all(f' {name}' in text or f"'{name}" in text for name in commands())
    if shutil.which(shell) is None:
        pytest.skip(f'{shell} is not installed; its script was made')
    subprocess.run([shell, '-n', '-c', text], check=True)


def test_the_command_prints_it(capsys) -> None:
    """And nothing else."""
    assert main(['completion', 'bash']) == 0
    assert capsys.readouterr().out == script('bash')
