"""Nothing public goes without a word: functions, arguments, parameters, commands."""

import argparse
import ast
import importlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

import actuator_glue

ROOT = Path(actuator_glue.__file__).resolve().parent
REPOSITORY = ROOT.parent
SOURCES = sorted(
    p for f in (ROOT, REPOSITORY / 'studies', REPOSITORY / 'examples') for p in f.rglob('*.py')
)
COMMANDS = sorted(p.stem for p in (ROOT / 'cli').glob('[!_]*.py') if p.stem != 'main')
CONFIGS = sorted((REPOSITORY / 'config').rglob('*.yaml'))


def public(tree: ast.Module) -> Iterator[tuple[str, ast.AST]]:
    """Yield public functions and classes of a module, and their public methods."""
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    for node in tree.body:
        if not isinstance(node, kinds) or node.name.startswith('_'):
            continue
        if any(isinstance(d, ast.Name) and d.id == 'overload' for d in node.decorator_list):
            continue  # a signature of the function that follows and has the docstring
        yield node.name, node
        if isinstance(node, ast.ClassDef):
            for member in node.body:
                if isinstance(member, kinds) and not member.name.startswith('_'):
                    yield f'{node.name}.{member.name}', member


def commands_of(command: str) -> argparse.ArgumentParser:
    """Build the parser of one command."""
    parser = argparse.ArgumentParser(prog=command)
    importlib.import_module(f'actuator_glue.cli.{command}').add_arguments(parser)
    return parser


def test_every_public_name_has_a_docstring() -> None:
    """Modules, classes, functions and methods that others can call."""
    missing = []
    for path in SOURCES:
        tree = ast.parse(path.read_text(encoding='utf-8'))
        names = [name for name, node in public(tree) if not ast.get_docstring(node)]
        if tree.body and not ast.get_docstring(tree):
            names.append('the module')
        missing += [f'{path.relative_to(REPOSITORY)}: {name}' for name in names]
    assert not missing


@pytest.mark.parametrize('command', COMMANDS)
def test_every_command_line_argument_has_help(command: str) -> None:
    """`actuator-glue COMMAND --help` explains each argument."""
    for action in commands_of(command)._actions:
        names = '/'.join(action.option_strings) or action.dest
        assert action.help and len(action.help) > 8, f'{command} {names} has no help'


@pytest.mark.parametrize('command', COMMANDS)
def test_every_command_is_in_the_readme(command: str) -> None:
    """A reader of the README meets each command."""
    commands_of(command)
    assert f'`{command}`' in (REPOSITORY / 'README.md').read_text(encoding='utf-8')


@pytest.mark.parametrize('path', CONFIGS, ids=lambda p: p.name)
def test_every_parameter_in_yaml_has_a_comment(path: Path) -> None:
    """A comment on the line or right above says what the value means."""
    text = path.read_text(encoding='utf-8')
    yaml.safe_load(text)
    above = ''
    for line in text.splitlines():
        match = re.match(
            r'^\s*([\w*/]+):(?:\s+(?P<value>[^#\s].*?))?(?:\s+#\s*(?P<note>.+))?$', line
        )
        if match and match['value']:
            assert match['note'] or above.lstrip().startswith('#'), f'{path.name}: {line.strip()}'
        above = line


def test_sources_that_documents_name_are_there() -> None:
    """A file that has moved leaves no name behind."""
    folders = ('actuator_glue', 'studies', 'examples', 'test', 'benchmarks', 'scripts', 'docs')
    known = {
        '/' + p.relative_to(REPOSITORY).as_posix()
        for f in folders
        for p in (REPOSITORY / f).rglob('*.py')
    }
    for page in [*REPOSITORY.glob('*.md'), *(REPOSITORY / 'docs').glob('*.md')]:
        for name in re.findall(r'`([\w/]+\.py)`', page.read_text(encoding='utf-8')):
            assert any(path.endswith('/' + name) for path in known), f'{page.name}: {name}'
