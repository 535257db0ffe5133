"""The report of a diagnosis: one HTML file, verdict on top."""

from __future__ import annotations

import math
from collections.abc import Sequence

from actuator_glue.diagnosis.telling.headline import names_of
from actuator_glue.diagnosis.telling.result import DiagnosisData
from actuator_glue.json_value import Json
from actuator_glue.online.stream import structure_name
from actuator_glue.report import diagnosis_figures as figures
from actuator_glue.report.diagnosis_summary import advice, closing, first_page
from actuator_glue.report.html import Block, Note, Page, Picture, Section, Table, Text
from actuator_glue.report.learned_figure import learned_terms
from actuator_glue.report.quantity import plain, said_in, word
from actuator_glue.report.worst import chosen

_ROWS = 8  # of the table of structures
_SAMPLERS = {
    'importance': '{effective_draws:.0f} effective draws by importance sampling, k {pareto_k:.2f}',
    'dream': '{effective_draws:.0f} effective draws by DREAM(ZS), R-hat {rhat:.3f}',
    'laplace': 'Laplace approximation',
}


_STATISTICS = {
    'ljung_box_p': ('p-value of whiteness (Ljung-Box, 20 lags, least of the records)', 1.0),
    'input_correlation': ('largest correlation with the command within 0.5 s', 1.0),
    'even_share': ('share of variance that even functions of the motion explain [%]', 100.0),
    'odd_share': ('share of variance that odd functions of the motion explain [%]', 100.0),
    'trend': ('largest trend [um/s]', 1e6),
}


def _drawn(sampler: Json) -> str:
    """Return how a posterior was drawn; chains that stand still have no R-hat."""
    known = {k: math.nan if v is None else v for k, v in sampler.items()}
    return _SAMPLERS.get(sampler.get('method', ''), 'draws').format(**known)


def _um(value: float) -> str:
    return f'{1e6 * value:.2f}'


def _error(found: DiagnosisData) -> Section:
    e, called = found.error, names_of(found)
    sides = (
        ('before: Eq. (2), refitted', e.before, e.before_ci, found.coverage[0]),
        (
            'after' if figures.moved(found) else 'after (the same: nothing was added)',
            e.after,
            e.after_ci,
            found.coverage[1],
        ),
    )
    rows = [
        [text, _um(rms), f'{_um(low)} to {_um(high)}', f'{100 * inside:.1f}']
        for text, rms, (low, high), inside in sides
    ]
    rows.append(['sham effect of equal size (control)', _um(e.sham), '', ''])
    rows.append(['noise floor', _um(e.noise_floor), '', ''])
    blocks: list[Block] = [
        Table(
            ['', 'rms [um]', '95 % interval [um]', 'inside the 95 % band [%]'],
            rows,
            'Free-run simulation error on held-out data, looked at once after all decisions.',
        ),
        Text(f'Share of the removable error removed: {100 * e.removable_removed:.1f} %.'),
        Table(
            ['held-out record', 'before [um]', 'after [um]'],
            [[called[source], _um(b), _um(a)] for source, b, a in e.records],
            'The same for each record.',
        ),
        Picture.of(figures.bands(found), '95 % predictive bands where both models differ most.'),
    ]
    return Section('Error before and after', blocks)


def _posterior(found: DiagnosisData) -> Table:
    rows = []
    for e in found.effects:
        meanings = {p.name: p.meaning for p in found.entry(e.name).parameters}
        for name, p in e.parameters.items():
            factor, unit = said_in(p.unit, p.mean, p.lower, p.upper)
            numbers = [(p.mean, 4), (p.stddev, 2), (p.lower, 4), (p.upper, 4)]
            mean, sd, low, high = (plain(factor * v, digits) for v, digits in numbers)
            told = meanings.get(name, word(name))
            rows.append([e.name, told, mean, sd, f'{low} to {high}', unit or '-'])
    header = ['effect', 'size', 'mean', 'sd', '95 % interval', 'unit']
    return Table(header, rows, 'Posterior of the effects.')


def _effects(found: DiagnosisData) -> Section:
    blocks: list[Block] = []
    if found.effects:
        rows = [
            [
                e.name,
                ', '.join(e.alternatives) or '-',
                found.entry(e.name).equation,
                e.place,
                _um(e.error_without),
                _um(e.error_with),
                f'{e.evidence:.0f}',
                {True: 'yes', False: 'no', None: 'not known'}[e.agrees_across_windows],
            ]
            for e in found.effects
        ]
        blocks.append(
            Table(
                [
                    'effect',
                    'or',
                    'equation',
                    'place',
                    'without [um]',
                    'with [um]',
                    'nats',
                    'same in all halves',
                ],
                rows,
                'What the model lacks. Names under "or" cannot be told apart by these records.',
                prose=True,
            )
        )
        blocks.append(_posterior(found))
        if len(found.names) > 4:
            drawn = _drawn(found.sampler)
            blocks.append(
                Picture.of(figures.posteriors(found), f'Posterior of the effects ({drawn}).')
            )
    if found.learned:
        blocks.append(
            Picture.of(
                learned_terms(found),
                'What each learned term adds to its signal, with its 95 % band, along a sine over '
                'the range that was excited (or over the time of the test): beyond it, no '
                'statement is made.',
            )
        )
    blocks.append(
        Picture.of(figures.ranking(found), 'Every candidate added alone, everything refitted.')
    )
    s = found.surrogate
    blocks.append(
        Text(
            f'Left-out blocks of the fitting part: {" + ".join(s["structure"])} leaves '
            f'{_um(s["structure_error"])} um, a generic regression of as many parameters '
            f'({", ".join(s["features"])}) {_um(s["error"])} um.'
        )
    )
    return Section('What is missing', blocks)


def _search(found: DiagnosisData) -> Section:
    rows = [
        [
            step.what,
            structure_name(step.effects),
            str(step.parameters),
            _um(step.error),
        ]
        for step in found.history
    ]
    header = ['step', 'structure', 'parameters', 'leaves [um]']
    return Section(
        'How it was found',
        [
            Table(
                header,
                rows,
                'Steps that were taken on the fitting part, noise included in what they leave.',
                prose=True,
            ),
            _structures(found),
        ],
    )


def _structures(found: DiagnosisData) -> Table:
    rows = [
        [
            structure_name(row.effects)
            + (f' ({row.scope})' if row.scope else '')
            + (' (told)' if row.chosen else ''),
            _um(row.left_out),
            plain(row.price),
            plain(row.log_weight),
        ]
        for i, row in enumerate(found.structures)
        if i < _ROWS or row.chosen or not row.effects
    ]
    return Table(
        ['structure', 'leaves of blocks left out [um]', 'price [nats]', 'log weight [nats]'],
        rows,
        f'The table: {len(found.structures)} structures were refitted, '
        'those of the greatest weight stand here, and Eq. (2). Structures with as many effects '
        'are told apart by smaller differences of error than those with more or fewer: Eq. (2) '
        'may weigh more than a wrong name that leaves less.',
        prose=True,
    )


def _residual(found: DiagnosisData) -> Section:
    a, called, some = found.alarm, names_of(found), chosen(len(found.traces), 'parts of records')
    tests = [
        [text, plain(factor * a.tests[name])]
        for name, (text, factor) in _STATISTICS.items()
        if name in a.tests
    ]
    rows = [
        [
            called[r['source']],
            _um(r['structure']),
            _um(r['noise']),
            ' to '.join(f'{f:g}' for f in r['frequency_hz']),
            ' to '.join(f'{t:g}' for t in r['time_s']),
            ' to '.join(f'{1e3 * x:.2g}' for x in r['displacement']),
            f'{100 * r["share_at_low_velocity"]:.0f}',
            f'{100 * r["share_at_large_displacement"]:.0f}',
        ]
        for r in found.remaining['records']
    ]
    return Section(
        'The residual',
        [
            Text(
                f'Structure in the residual of Eq. (2): {_um(a.structured)} um rms, against a '
                f'threshold of {_um(a.threshold)} um; noise {_um(a.noise)} um; '
                f'bootstrap p-value {a.p_value:.2g}.'
            ),
            Picture.of(figures.residuals_in_time(found), f'Residual against time.{some}'),
            Picture.of(
                figures.residuals_in_frequency(found), f'Residual against frequency.{some}'
            ),
            Picture.of(
                figures.loops(found),
                f'Residual against displacement and against velocity.{some}',
            ),
            Table(['statistic', 'value'], tests, 'Statistics of the residual of Eq. (2).'),
            Table(
                [
                    'record',
                    'structure [um]',
                    'noise [um]',
                    'frequency [Hz]',
                    'time [s]',
                    'displacement [mm]',
                    'at low velocity [%]',
                    'at large displacement [%]',
                ],
                rows,
                'Where the rest after the diagnosis sits on the fitting part (middle 80 %).',
            ),
        ],
    )


def _records(found: DiagnosisData) -> Section:
    called = names_of(found)
    rows = [
        [
            called[t.source],
            'held out' if t.held_out else 'fitted',
            f'{t.stiffness / 1e3:g}',
            str(len(t.time)),
            t.source,
        ]
        for t in found.traces
    ]
    header = ['record', 'part', 'stiffness [kN/m]', 'samples', 'source']
    table = Table(header, rows, 'What was read, and from where.', prose=True)
    return Section('Records', [table, *(Note(line) for line in found.preparation)])


def brief(found: DiagnosisData) -> list[Block]:
    """Return the first page in text and tables, and advice."""
    told = [line for line in found.advice if line not in found.preparation]
    return [*first_page(found, drawn=False).blocks(), *(Note(line) for line in told)]


def page(
    found: DiagnosisData,
    tracking: Sequence[Block] = (),
    hybrid: str = '',
    next_command: str = '',
) -> Page:
    """Return the report of a diagnosis.

    Args:
        found: the diagnosis.
        tracking: tells how it follows its command.
        hybrid: what it means for a hybrid test.
        next_command: what to type next; empty for a command over the same files.
    """
    told = first_page(found, hybrid).ending_with(next_command)
    first = Section('The answer', told.blocks(headline=False))
    evidence = [_error(found), _effects(found), _residual(found), _records(found)]
    if found.history:
        evidence.insert(2, _search(found))
    if tracking:
        evidence.insert(2, Section('How the actuator follows its command', tracking))
    sections = [first, *advice(found), *evidence, *closing(found)]
    return Page('Diagnosis', found.summary(), sections)
