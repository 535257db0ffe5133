"""Entry point of `actuator-glue`: finds the commands beside this file and runs one.

Every `cli/COMMAND.py` has `add_arguments(parser)`, `run(args) -> int` and two EXAMPLES, with which
its help ends; the first line of its docstring is its help. Only the command that runs is imported,
and heavy libraries only inside it.
"""

from __future__ import annotations

import ast
import atexit
import gc
import importlib
import os
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from actuator_glue import __version__, cli
from actuator_glue.arguments import claim_outputs
from actuator_glue.cli._output import fault
from actuator_glue.cli._parser import Parser, examples
from actuator_glue.cli._standard_streams import StandardStream, standard_streams
from actuator_glue.errors import InputError
from actuator_glue.motion import METRES, speak

# What a process holds at its end is not searched for garbage: that takes up to a second.
atexit.register(gc.freeze)


def commands() -> dict[str, Path]:
    """Return file by command name, sorted."""
    folder = Path(next(iter(cli.__path__)))
    files = sorted(folder.glob('[a-z]*.py'))
    return {file.stem.replace('_', '-'): file for file in files if file.stem != 'main'}


def summary(file: Path) -> str:
    """Return the first line of a command's docstring without importing it."""
    text = ast.get_docstring(ast.parse(file.read_text('utf-8'))) or ''
    return text.split('\n', 1)[0]


def build_parser(chosen: str | None) -> Parser:
    """Return the parser; only the chosen command knows its arguments."""
    parser = Parser(
        prog='actuator-glue',
        description='Bayesian calibration and diagnosis of servo-hydraulic actuators.',
    )
    parser.add_argument('--version', action='store_true', help='print the version and exit')
    parser.add_argument('--debug', action='store_true', help='show where a fault came from')
    subparsers = parser.add_subparsers(dest='command', metavar='COMMAND')
    for name, file in commands().items():
        line = summary(file)
        # % would be read as a format by argparse.
        sub = subparsers.add_parser(name, help=line.replace('%', '%%'), description=line)
        if name == chosen:
            module = importlib.import_module(f'actuator_glue.cli.{file.stem}')
            module.add_arguments(sub)
            sub.epilog = examples(sub.epilog or '', module.EXAMPLES)
            sub.set_defaults(run=module.run)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    The code is the command's own, whether or not anybody reads what it prints; 2 where what it
    prints cannot be written, as on a full disk.
    """
    with standard_streams() as (out, _):
        code = _run(list(sys.argv[1:] if argv is None else argv), out)
        out.flush()
        if out.fault:
            fault(f'standard output: {out.fault}')
            return 2
    return code


def _run(argv: list[str], out: StandardStream) -> int:
    """Return the exit code of a command; what it raises becomes one line."""
    # Our matrices are small and our own threads use the cores: those of the linear algebra on top
    # would only wait for each other (a diagnosis takes 1.7 times the processor time).
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    debug = '--debug' in argv
    argv = [a for a in argv if a != '--debug']  # wherever it stands
    chosen = next((a for a in argv if not a.startswith('-')), None)
    speak(METRES)  # until records say otherwise
    if not debug:
        # Deprecations inside libraries are nothing a user can act on.
        warnings.simplefilter('ignore')
    try:
        parser = build_parser(chosen)
        args = parser.parse_args(argv)
        if args.version:
            print(f'actuator-glue {__version__}')
            return 0
        if args.command is None:
            parser.print_help()
            return 2
        if out.closed_before and getattr(args, 'json', None) == '-':
            raise InputError(
                '--json -: standard output is closed; give the name of a file, or leave it open'
            )
        claim_outputs(args)
        return int(args.run(args))
    except SystemExit as leaving:  # of argparse, which has told its help or what is wrong
        return int(leaving.code or 0)
    except InputError as error:
        return _fail(str(error), 2, debug)
    except KeyboardInterrupt:
        return _fail('interrupted', 130, debug=False)
    except MemoryError:
        return _fail('not enough memory for this; use shorter records or fewer samples', 2, debug)
    except OSError as error:
        return _fail(f'{error.filename or "file"}: {error.strerror or error}', 2, debug)
    except Exception as error:
        text = f'fault in actuator-glue: {type(error).__name__}: {error}'
        return _fail(f'{text} (run with --debug for details, and report it)', 3, debug)


def _fail(message: str, code: int, debug: bool) -> int:
    """Tell the exception that is being handled, or raise it again where it is looked for."""
    if debug:
        raise
    fault(message)
    return code


if __name__ == '__main__':
    sys.exit(main())
