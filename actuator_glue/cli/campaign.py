"""Analyse every record of a laboratory once: a table with a row each, on all cores or a cluster.

Exit code 0: every group has its numbers. 1: some rows tell why there are none. 2: the input cannot
be used.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from actuator_glue.api.bar import progress
from actuator_glue.arguments import Input, whole
from actuator_glue.cli._output import add_json, beside, note, say, table
from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json
from actuator_glue.report.first_lines import few

EXAMPLES = (
    'campaign records/ --out campaign --recipe campaign.yaml',
    'campaign --watch campaign',
)
_EVERY = 2.0  # s, between looks at another campaign


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        'records', nargs='*', type=Input, metavar='RECORD', help='files, bags, and folders of them'
    )
    parser.add_argument(
        '--out',
        metavar='DIR',
        help='folder for rows, results.parquet, draws and reports; a campaign goes on in its own',
    )
    parser.add_argument(
        '--recipe',
        type=Input,
        metavar='CAMPAIGN.yaml',
        help='how to read, group and analyse the records (default: every file by itself)',
    )
    parser.add_argument(
        '--workers',
        type=whole,
        metavar='N',
        help='processes of this machine (default: one for each core)',
    )
    parser.add_argument(
        '--scheduler',
        metavar='ADDRESS',
        help='a dask scheduler whose workers compute, as tcp://node:8786 (default: this machine)',
    )
    parser.add_argument(
        '--again', action='store_true', help='make rows that tell a failure once more'
    )
    parser.add_argument(
        '--watch',
        metavar='DIR',
        help='show how far the campaign of this folder is, from any terminal, until it ends',
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Run or watch a campaign.

    Raises:
        InputError: as `campaign`, or options that do not belong together.
    """
    if args.watch is not None:
        others = (args.records, args.out, args.recipe, args.workers, args.scheduler, args.again)
        if any((*others, args.json)):
            raise InputError('--watch looks at a campaign that runs; give it alone')
        return _watch(Path(args.watch))
    if not args.records or args.out is None:
        raise InputError('give records and --out DIR, or --watch DIR')
    if args.workers is not None and args.scheduler is not None:
        raise InputError('--workers are of this machine; a --scheduler has its own')
    from actuator_glue.campaigns.campaign import campaign

    with progress('campaign', 1.0) as done:
        found = campaign(
            args.records,
            args.out,
            args.recipe,
            scheduler=args.scheduler,
            workers=args.workers,
            again=args.again,
            progress=lambda now: done(now.done / max(now.total, 1)),
        )
    now, failures = found.progress, found.failures
    verdicts = found.table['verdict'].value_counts()
    content = {
        'schema': 'actuator_glue.campaign_summary/1',
        'groups': now.total,
        'known_before': now.known,
        'computed': now.computed,
        'failed': now.failed,
        'verdicts': {str(v): int(n) for v, n in verdicts.items()},
        'results': str(found.results),
    }
    failed = beside(args.json, lambda out: write_json(content, out))
    say(now.line(time.time()), args)
    table('Verdicts', ['verdict', 'groups'], [[str(v), str(n)] for v, n in verdicts.items()], args)
    told = [f'{row["group"]}: {row["failure"]}' for _, row in failures.iterrows()]
    shown, more = few(told, 'failures', f'all in {found.results}')
    for line in (*shown, *more):
        note(line)
    say(f'{len(found.table)} rows: {found.results}', args)
    return failed or (1 if now.failed else 0)


def _watch(folder: Path) -> int:
    from actuator_glue.campaigns.progress_file import STALE, read_progress

    with progress('campaign', 1.0) as done:
        while True:
            now = read_progress(folder)
            done(now.done / max(now.total, 1))
            if now.state != 'running' or time.time() - now.updated > STALE:
                break
            time.sleep(_EVERY)
    print(now.line(time.time()))
    return 0 if now.state == 'finished' and not now.failed else 1
