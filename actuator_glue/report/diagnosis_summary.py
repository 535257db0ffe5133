"""First and last pages of a diagnosis: what came out, what to do; words, provenance."""

from __future__ import annotations

import math
from collections.abc import Callable

from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.finding import Finding
from actuator_glue.diagnosis.telling.headline import left_open
from actuator_glue.diagnosis.telling.result import DiagnosisData
from actuator_glue.diagnosis.verdict.rules import likely
from actuator_glue.model.parameters import BASE
from actuator_glue.report.diagnosis_figures import residual_summary
from actuator_glue.report.first_page import FirstPage, command
from actuator_glue.report.html import Block, Note, Picture, Section, Table, Text
from actuator_glue.report.quantity import percents, said, spread, word

_TOLD = 5.0  # Hz, at which the delay is told
_MEANS = {
    'none': 'The model is enough: nothing material is missing.',
    'missing-effect': 'Something is missing, and what is named below is all of it as far as '
    'these records go.',
    'unexplained': 'Not explained: material structure remains beside what is named.',
    'undecided': 'Not decided: fitting and held-out records contradict each other.',
}
_WORDS = (
    ('Eq. (2)', 'the linear model of the actuator with four parameters, without additions'),
    ('free-run error', 'measured displacement less the simulation, which never sees it'),
    ('held out', 'records or stretches that decided nothing and were looked at once'),
    ('removable error', 'what exceeds the noise: squared error less squared noise'),
    (
        'own zero',
        "offset and drift of a held-out record's channel, which no other one tells",
    ),
    ('noise', 'what no function of the command can explain'),
    ('nats', 'gain in log-likelihood out of sample; 4.6 nats are odds of 100 to 1'),
    ('or', 'names that these records cannot tell apart'),
    ('none of these', 'nothing, or something that the catalogue does not hold'),
    (
        'sham',
        'the best of as many effects that cannot be there as were tried: what chance does',
    ),
    ('gain, phase, delay', 'first harmonic of the displacement over that of a sine of command'),
    ('bandwidth', 'frequency from which on the gain stays below 0.71 of that at 1 Hz'),
    ('95 % interval', 'posterior of the parameter; block bootstrap of an error'),
)


def _um(value: float) -> str:
    return f'{1e6 * value:.1f}'


def _range(pair: tuple[float, float], scale: float, digits: int = 1) -> str:
    if not all(map(math.isfinite, pair)):
        return 'not known'
    return f'{scale * pair[0]:.{digits}f} to {scale * pair[1]:.{digits}f}'


def _odds(e: Finding) -> tuple[int, list[str], int | None]:
    """Return how sure a name is [%], its rivals with theirs, and none of them where known [%]."""
    tied = [r for r in e.rivals if r.tied and r.name != e.name]
    known = [e.none] if math.isfinite(e.none) else []
    own, *rest = percents([e.probability, *(r.probability for r in tied), *known])
    others = [f'{r.name} {share} %' for r, share in zip(tied, rest, strict=False)]
    return own, others, rest[-1] if known else None


def _names(found: DiagnosisData) -> list[Block]:
    """What is missing, how large it is, and how sure the name is."""
    rows = []
    for e in found.effects:
        sizes = ', '.join(f'{word(n)} {_estimate(p)}' for n, p in e.parameters.items())
        if math.isfinite(e.probability):
            own, others, none = _odds(e)
            left = '-' if none is None else f'{none} %'
            rows.append([e.name, sizes, f'{own} %', ', '.join(others) or '-', left])
        else:
            rows.append([e.name, sizes, 'a description, or noise: no name', '-', '-'])
    if not rows:
        return []
    header = ['effect', 'size (95 % interval)', 'probability', 'or', 'none of these']
    return [Table(header, rows, 'What is missing, and how sure its name is.', prose=True)]


def _meaning(found: DiagnosisData) -> str:
    """Return what the verdict means, in a sentence."""
    if found.doubts:
        return 'In doubt, for what is told first; the rest is what the records say by themselves.'
    if found.verdict == 'missing-effect' and all(e.noise is not None for e in found.effects):
        return 'The model is enough for what moves; what is named below is in what measures it.'
    open_ = left_open(found)
    if open_ is not None:
        known = 'Named below, with parameters open' if found.structure else 'Not decided'
        return (
            f'{known}: of held-out records nothing but noise is left {open_.how}, and the '
            'fitting records leave that open.'
        )
    return _MEANS[found.verdict]


def certainty(found: DiagnosisData) -> str:
    """Return how sure the answer is: one number, and what it is a number of."""
    inside = f'{100 * found.coverage[1]:.0f} % of what was held out lies in the 95 % band'
    named = [e for e in found.effects if math.isfinite(e.probability)]
    if found.doubts:
        return f'{inside}, and the answer is in doubt'
    if left_open(found) is not None:
        return f'{inside}; the fitting records leave open where in it'
    if not found.complete:
        return f'{inside}, and the answer is not complete: intervals are too narrow'
    if not named:
        return inside + (' (a learned term is a description, no cause)' if found.learned else '')
    least = min(named, key=lambda e: e.probability)
    own, told, none = _odds(least)
    told += [] if none is None else [f'none of these {none} %']
    which = f', the least sure of {len(named)} names' if len(named) > 1 else ''
    return (
        f'{own} % is the probability of the name {least.name}{which}, among all effects that were '
        f'tried and none of them' + (f' ({", ".join(told)})' if told else '')
    )


def _error(found: DiagnosisData) -> Table:
    e = found.error
    removed = f'{100 * e.removable_removed:.0f} % ({_range(e.removed_ci, 100.0, 0)} %)'
    rows = [
        ['before: Eq. (2), refitted', _um(e.before), _range(e.before_ci, 1e6), ''],
        ['after: with the additions', _um(e.after), _range(e.after_ci, 1e6), removed],
        *(
            [["after, without each record's own zero", _um(e.after_without_zero), '', '']]
            if e.after_without_zero is not None
            else []
        ),
        ['noise', _um(e.noise_floor), '', ''],
    ]
    header = ['held-out data', 'rms [um]', '95 % interval [um]', 'removable error removed']
    return Table(header, rows, 'Free-run error before and after.')


def _estimate(p: Estimate | None) -> str:
    if p is None:
        return '-'
    text = spread(p.mean, p.lower, p.upper, p.unit)
    return text if p.identified else f'{text}, not identified'


def _parameters(found: DiagnosisData, name: Callable[[str], str]) -> Table | None:
    meanings = {p.name: p.meaning for p in BASE}
    rows = [
        [name(n), meanings.get(n, ''), _estimate(found.base_before.get(n)), _estimate(p)]
        for n, p in found.base.items()
    ]
    for e in found.effects:
        own = {p.name: p.meaning for p in found.entry(e.name).parameters}
        rows += [[name(n), own.get(n, e.name), '-', _estimate(p)] for n, p in e.parameters.items()]
    header = ['parameter', 'what it is', 'before', 'after']
    caption = 'Parameters before and after: means, 95 % intervals.'
    return Table(header, rows, caption, prose=True) if rows else None


def delay(found: DiagnosisData) -> str:
    """Return the delay at one frequency under each stiffness; empty where it is not known."""
    told = []
    for r in found.responses:
        known = [s for s in r.sines if math.isfinite(s.delay)]
        if known:
            s = min(known, key=lambda s: abs(s.frequency - _TOLD))
            where = 'free' if r.stiffness == 0.0 else f'with {r.stiffness / 1e3:g} kN/m'
            told.append(f'{spread(s.delay, *s.delay_ci, "s")} at {s.frequency:g} Hz {where}')
    return '; '.join(told)


def remedies(found: DiagnosisData) -> tuple[str, ...]:
    """Return what each effect is at the machine, and what to do, a line each."""
    out = []
    for e in found.effects:
        entry = found.entry(e.name)
        if not entry.remedy:
            continue
        known = [said(p.mean, p.unit) for p in e.parameters.values() if p.identified]
        what = f'{e.name}, {", ".join(known) or "of a size that is not known"}'
        if likely(e):
            go = '' if e.noise is not None else f'; go on with --effect {e.name}, or mend it'
            out.append(f'{what}: {entry.meaning}. What to do: {entry.remedy}{go}.')
        else:
            out.append(
                f'{what}: {entry.meaning}. Not likely enough for a repair; what to look at: '
                f'{entry.remedy}.'
            )
    return tuple(out)


def next_command(found: DiagnosisData) -> str:
    """Return what to type next."""
    fitted = [(t.source, t.stiffness) for t in found.traces if not t.held_out]
    own = {source for source, _ in fitted}
    held = [(t.source, t.stiffness) for t in found.traces if t.held_out and t.source not in own]
    if found.setup is not None and not found.setup.taken:
        tests = list(zip(found.setup.sources, found.setup.stiffness, strict=True))
        return command('diagnose', tests, *found.setup.options(), held=held)
    if held and left_open(found) is not None:
        return command('diagnose', [*fitted, *held])
    if found.verdict == 'undecided' and held:
        return command('diagnose', held)
    if found.learned:
        return command('diagnose', fitted, '--save-effects', 'learned.yaml', held=held)
    if not found.complete:
        return command('diagnose', fitted, '--report', 'report.html', held=held)
    effects = [word for e in found.effects if e.noise is None for word in ('--effect', e.name)]
    return command('calibrate', fitted, *effects, '--save', 'posterior.npz')


def first_page(found: DiagnosisData, hybrid: str = '', *, drawn: bool = True) -> FirstPage:
    """Return what a person is told first.

    Args:
        found: the diagnosis.
        hybrid: what it means for a hybrid test.
        drawn: with its picture, and symbols for names; on a terminal neither.
    """
    picture = None
    if drawn:
        picture = Picture.of(
            residual_summary(found),
            'What the model leaves of held-out data, where both models differ most, and its rms '
            'error over all of them. No model explains the noise: grey, and the dashed line.',
            residual_summary(found, narrow=True),
        )
    return FirstPage(
        (found.summary(), _meaning(found)),
        certainty(found),
        picture,
        _error(found),
        _parameters(found, word if drawn else str),
        delay(found),
        remedies(found),
        hybrid,
        next_command(found),
    )


def _response(found: DiagnosisData) -> list[Block]:
    rows = []
    for r in found.responses:
        width = f'{r.bandwidth:.1f}' if math.isfinite(r.bandwidth) else 'above 60'
        rows += [
            [
                f'{r.stiffness / 1e3:g}', f'{s.frequency:g}', f'{1e3 * s.amplitude:.2g}',
                f'{s.gain:.3f} ({_range(s.gain_ci, 1.0, 3)})',
                f'{s.phase:.1f} ({_range(s.phase_ci, 1.0)})',
                f'{1e3 * s.delay:.2f} ({_range(s.delay_ci, 1e3, 2)})',
                width,
            ]
            for s in r.sines
        ]  # fmt: skip
    if not rows:
        return []
    header = ['k [kN/m]', 'f [Hz]', 'sine [mm]', 'gain', 'phase [deg]', 'delay [ms]', 'band [Hz]']
    return [Table(header, rows, 'What the augmented model does to sines, and its bandwidth.')]


def equation(found: DiagnosisData) -> str:
    """Return the model's equation with its additions, in words that a program could take."""
    lines = ["q' = -beta_1 q + alpha_1_beta_0 e, f' = q - alpha_2 v - alpha_3 f, e = u - x"]
    lines += [f'{e.place}: {found.entry(e.name).equation}' for e in found.effects if not e.noise]
    values = {n: p for e in found.effects for n, p in e.parameters.items() if not e.noise}
    sizes = ', '.join(f'{n} = {p.mean:.4g} {p.unit}' for n, p in (found.base | values).items())
    return '; '.join(lines) + (f'; with {sizes}' if sizes else '')


def advice(found: DiagnosisData) -> list[Section]:
    """Return names with their rivals, advice, tests to come, and what the model does to sines."""
    blocks = _names(found)
    blocks += [Note(line) for line in found.advice if line not in found.preparation]
    if found.experiments:
        rows = [
            [e.text, f'{1e3 * e.amplitude:.2g}', f'{e.stiffness / 1e3:g}', f'{e.nats:.3g}']
            for e in found.experiments[:5]
        ]
        header = ['test', 'amplitude [mm]', 'k [kN/m]', 'nats expected']
        blocks.append(Table(header, rows, 'Tests that would tell tied names apart.', prose=True))
    blocks += _response(found)
    return [Section('More on the answer', blocks)] if blocks else []


def closing(found: DiagnosisData) -> list[Section]:
    """Return the model for programs, the glossary and how the report was made."""
    model = Text(f'Names and SI units as programs have them: {equation(found)}')
    out = [
        Section('The model as text', [model]),
        Section('Glossary', [Table(['word', 'meaning'], _WORDS, 'Words.', prose=True)]),
    ]
    if found.provenance:
        rows = list(found.provenance.items())
        table = Table(['', 'value'], rows, 'How this was made.', prose=True)
        out.append(Section('Provenance', [table]))
    return out
