"""Look whether this computer is ready for live tests: ROS, messages, DDS, compiled code, disk."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from actuator_glue.cli._output import add_json, say
from actuator_glue.io.json_file import write_json

MARKS = {'ok': 'ok     ', 'advice': 'advice ', 'missing': 'MISSING'}

EXAMPLES = (
    'doctor',
    'doctor --json -',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        '--bags',
        metavar='FOLDER',
        default='~/.ros/actuator_glue',
        help='where bags will be recorded (32 MB are written there, and removed)',
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print each finding as it is there; 1 where something is missing, advice is none.

    Raises:
        InputError: the JSON cannot be written, or no home folder is known.
    """
    from actuator_glue.api.doctor import examine
    from actuator_glue.errors import InputError

    try:
        folder = Path(args.bags).expanduser().absolute()
    except RuntimeError as error:
        text = f'{args.bags}: no home folder is known; name another folder with --bags'
        raise InputError(text) from error
    found = []
    for finding in examine(folder):
        found.append(finding)
        say(f'{MARKS[finding.verdict]} {finding.name}: {finding.text}', args)
        if finding.remedy:
            say(f'        -> {finding.remedy}', args)
    missing = [f.name for f in found if f.verdict == 'missing']
    advice = [f.name for f in found if f.verdict == 'advice']
    if missing:
        say(f'not ready for live tests: {", ".join(missing)}', args)
    else:
        more = f'; advice on {", ".join(advice)}' if advice else ''
        say(f'ready for live tests{more}', args)
    write_json(
        {
            'schema': 'actuator_glue.doctor/1',
            'ready': not missing,
            'findings': [asdict(f) for f in found],
        },
        args.json,
    )
    return 1 if missing else 0
