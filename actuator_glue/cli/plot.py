"""Draw records, the bands and posteriors a bag holds, and those of a calibration."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from actuator_glue.arguments import Input, add_force, claim
from actuator_glue.cli._output import note, say
from actuator_glue.cli._records import add_records, load
from actuator_glue.errors import InputError
from actuator_glue.records import Record

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from actuator_glue.report.bag_content import Content

EXAMPLES = (
    'plot test.csv --out pictures',
    'plot test.csv --draws monday.npz --format pdf',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_records(parser)
    parser.add_argument(
        '--out', default='out/plots', metavar='DIR', help='where pictures go (default out/plots)'
    )
    add_force(parser)
    parser.add_argument(
        '--draws',
        type=Input,
        metavar='DRAWS.npz',
        help='what `calibrate --save` wrote: also its picture, and its bands over every record',
    )
    parser.add_argument(
        '--format', choices=('png', 'svg', 'pdf'), default='png', help='default png'
    )


def run(args: argparse.Namespace) -> int:
    """Draw every record, and bands and parameters of bags that have them.

    Raises:
        InputError: a record cannot be used, or a picture cannot be written.
    """
    from actuator_glue.io.bag_reader import is_bag
    from actuator_glue.report.records import record_figure

    folder = Path(args.out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f'{folder}: cannot be made ({error.strerror or error})') from error
    records = load(args)
    posterior = None
    if args.draws is not None:
        from actuator_glue.api.calibration_report import LEVEL, bands_figure
        from actuator_glue.api.calibration_result import Calibration

        posterior = Calibration.load(args.draws)
        path = folder / f'{Path(args.draws).stem}.{args.format}'
        told = f'{len(posterior.posterior)} draws of {args.draws}'
        _save(posterior.plot(), path, told, args)
    for i, record in enumerate(records, start=1):
        name = f'{_stem(record)}_{i}' if len(records) > 1 else _stem(record)
        path = folder / f'{name}.{args.format}'
        _save(record_figure(record), path, f'{len(record)} samples of {record.source}', args)
        if posterior is not None:
            figure, inside = bands_figure(posterior, record)
            told = (
                f'{100 * LEVEL:.0f} % bands; the total one holds {100 * inside:.1f} % of the '
                'samples it was made from'
            )
            _save(figure, folder / f'{name}_bands.{args.format}', told, args)
    for path in args.records:
        if is_bag(path):
            _draw_estimate(Path(path), folder, args)
    return 0


def _stem(record: Record) -> str:
    name = Path(record.source.split(' (record')[0]).stem or 'record'
    return ''.join(c if c.isalnum() or c in '-_.' else '_' for c in name)


def _save(figure: Figure, path: Path, what: str, args: argparse.Namespace) -> None:
    from actuator_glue.report import style

    style.save(figure, claim(path, args))
    say(f'{path}: {what}', args)


def _draw_estimate(bag: Path, folder: Path, args: argparse.Namespace) -> None:
    """Draw the forecast bands and the posteriors that a live estimator left in a bag."""
    from actuator_glue.report import estimate_figures as figures
    from actuator_glue.report.bag_content import read

    content: Content = read(bag)
    if not content.posteriors:
        note(f'{bag}: holds no posterior; `actuator-glue replay {bag}` makes them')
        return
    for draw, name in ((figures.bands, 'bands'), (figures.parameters, 'parameters')):
        path = claim(folder / f'{bag.stem}_{name}.{args.format}', args)
        try:
            draw(content, path)
        except InputError as error:
            note(str(error))
            continue
        say(f'{path}: {name} of {bag}', args)
