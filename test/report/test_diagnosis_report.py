"""The report of a diagnosis: gaps, legends, titles and names, looked at as a reader does."""

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from actuator_glue.diagnosis.finding import Rival
from actuator_glue.diagnosis.posterior.posterior import Draws
from actuator_glue.diagnosis.telling.next_experiment import Experiment
from actuator_glue.diagnosis.telling.response import Response, Sine
from actuator_glue.diagnosis.telling.result import (
    Alarm,
    Candidate,
    DiagnosisData,
    Estimate,
    Finding,
    HeldOutError,
)
from actuator_glue.diagnosis.verdict.traces import Trace
from actuator_glue.report import diagnosis_figures as figures
from actuator_glue.report import diagnosis_report
from actuator_glue.report.diagnosis_report import page as page_of
from actuator_glue.report.diagnosis_summary import remedies
from actuator_glue.report.html import render
from actuator_glue.report.worst import chosen

RATE = 100.0
FOLDER = '/laboratory/2026/campaign'
LONG = 'structural_laboratory_actuator_B_specimen_17_sweep_0_to_10_Hz_repeat_3_free_of_load.csv'
DRAWN = ('residuals_in_time', 'residuals_in_frequency', 'loops', 'ranking', 'posteriors', 'bands')


def trace(name: str, held_out: bool, play: float) -> Trace:
    """Return a sweep of 24 s; every fourth block of two seconds is held out."""
    rng = np.random.default_rng(len(name))
    time = np.arange(int(24 * RATE)) / RATE
    time = time[(np.floor(time / 2.0) % 4 == 3) == held_out]
    before = 2e-3 * np.sin(np.pi * 0.4 * time**2)
    after = before - play * np.sign(np.gradient(before, time))
    measured = after + 1e-5 * rng.standard_normal(len(time))
    width = 2e-5
    return Trace(
        f'{FOLDER}/{name}',
        held_out,
        time,
        250e3,
        before,
        measured,
        before,
        after,
        before - width,
        before + width,
        after - width,
        after + width,
    )


def diagnosis(play: float, records: int = 2) -> DiagnosisData:
    """Return a diagnosis that found play, or nothing where there is none."""
    names = (LONG, 'spring.csv')[:records]
    size = Estimate(play, 1e-7, 0.9 * play, 1.1 * play, 'm', 0.0)
    found = Finding(
        'backlash',
        (),
        1.0,
        'sensor',
        {'backlash': size},
        3e-5,
        1e-5,
        500.0,
        records=(f'{FOLDER}/{LONG}',),
    )
    effects = (found,) if play else ()
    draws = np.random.default_rng(1).normal(1.0, 1e-3, (400, 4 + len(effects)))
    draws[:, 4:] *= play
    rest = {
        'source': f'{FOLDER}/{LONG}',
        'structure': 1e-6,
        'noise': 1e-5,
        'frequency_hz': [1, 2],
        'time_s': [0, 20],
        'displacement': [0.0, 2e-3],
        'share_at_low_velocity': 0.5,
        'share_at_large_displacement': 0.5,
    }
    after = 1e-5 if play else 3e-5
    return DiagnosisData(
        verdict='missing-effect' if play else 'none',
        effects=effects,
        error=HeldOutError(
            3e-5,
            (3e-5, 3e-5),
            after,
            (after, after),
            1e-5,
            1.0,
            (0.9, 1.0),
            3e-5,
            ((f'{FOLDER}/{LONG}', 3e-5, after),),
        ),
        candidates=tuple(Candidate(f'effect-{i}', 1.0, 1e-5 * (1 + i), 0.1) for i in range(14)),
        coverage=(0.4, 0.95),
        alarm=Alarm(bool(play), 3e-5, 1e-6, 1e-5, 0.001),
        advice=(),
        base={},
        structure=tuple(e.name for e in effects),
        names=('beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3', 'backlash')[: 4 + len(effects)],
        posterior=draws,
        rhat=1.0,
        best=draws[0],
        traces=tuple(trace(n, held, play) for held in (False, True) for n in names),
        surrogate={
            'structure': ['Eq. (2)'],
            'structure_error': 1e-5,
            'features': ['u'],
            'error': 1e-5,
        },
        remaining={'records': [rest]},
        seconds=1.0,
    )


def drawn(name: str, found: DiagnosisData) -> Figure:
    """Return one of the report's figures."""
    draw: Callable[[DiagnosisData], Figure] = getattr(figures, name)
    return draw(found)


@pytest.mark.parametrize('name', DRAWN)
def test_no_text_or_legend_lies_on_another_thing(name: str, overlapping_texts) -> None:
    """Long names, legends and powers of ten included; a legend covers no bar and no curve."""
    figure = drawn(name, diagnosis(6e-5))
    assert overlapping_texts(figure) == []
    assert all(axes.get_legend() is None for axes in figure.axes)
    for legend in figure.legends:
        box = legend.get_window_extent()
        assert not any(box.overlaps(axes.get_window_extent()) for axes in figure.axes)


def test_lines_break_where_samples_were_held_out() -> None:
    """No line runs across a gap, in time or in a loop."""
    found = diagnosis(6e-5)
    for axes in drawn('residuals_in_time', found).axes:
        for line in axes.lines:
            steps = np.diff(line.get_xdata())
            assert not (steps > 1.0).any()
            assert np.isnan(steps).sum() >= 4
    for t in found.traces:
        part = figures._slow_part(t)
        assert np.diff(t.time[part]).max() < 1.5 / RATE
        second = figures._differing(t, 1.0)
        assert t.time[second][-1] - t.time[second][0] < 1.0


@pytest.mark.slow
def test_of_hundreds_of_records_the_worst_are_drawn() -> None:
    """A picture of all would be of more points than a file may have; all of a few are drawn."""
    few = diagnosis(6e-5)
    worse = [replace(t, measured=t.measured + 1e-3) for t in few.traces[:3]]
    many = replace(few, traces=(*few.traces * 60, *worse))
    for name, columns in (('residuals_in_time', 1), ('residuals_in_frequency', 1), ('loops', 2)):
        assert len(drawn(name, many).axes) == 12 * columns
        assert len(drawn(name, few).axes) == len(few.traces) * columns
    lines = [a.lines[1].get_ydata() for a in drawn('residuals_in_time', many).axes]
    assert sum(np.nanmean(y) > 900.0 for y in lines) == 3
    assert f'The 12 of {len(many.traces)} parts of records' in chosen(
        len(many.traces), 'parts of records'
    )
    assert chosen(12, 'records') == ''


def test_a_gap_is_no_frequency() -> None:
    """White noise with gaps and a slow drift between its stretches has a flat density."""
    t = trace('a', False, 0.0)
    rng = np.random.default_rng(0)
    white = rng.standard_normal(len(t.time)) + 100.0 * np.floor(t.time / 8.0)
    f, density = figures._density(t, white)
    assert density[f > 3.0].mean() == pytest.approx(np.sqrt(2.0 / RATE), rel=0.15)


def test_what_was_not_added_is_not_drawn() -> None:
    """One curve, called Eq. (2), where nothing was added."""
    for name in ('residuals_in_time', 'residuals_in_frequency', 'bands'):
        two, one = drawn(name, diagnosis(6e-5)), drawn(name, diagnosis(0.0))
        names = [t.get_text() for t in one.legends[0].get_texts()]
        assert any('Eq. (2)' in n for n in names)
        assert not any('after' in n or 'before' in n for n in names)
        assert any('after' in t.get_text() for t in two.legends[0].get_texts())


@pytest.mark.slow
@pytest.mark.usefixtures('undrawn')
def test_paths_stand_in_one_table() -> None:
    """The headline names files; where they lay is told once for each."""
    found = diagnosis(6e-5)
    assert f'backlash in {LONG} only' in found.summary()
    assert FOLDER not in found.summary()
    page = render(page_of(found))
    text = re.sub(r'data:image/png;base64,[^"]*', '', page)
    assert '<title>Diagnosis</title>' in text
    typed, rest = text.split('What was read')
    assert rest.count(FOLDER) == len(found.traces)
    assert typed.count(FOLDER) == 2 and f'calibrate {FOLDER}/{LONG}' in typed  # what to type next
    same = replace(found, effects=(), structure=(), verdict='none')
    page = render(page_of(same))
    assert 'nothing was added' in page


@pytest.mark.usefixtures('undrawn')
def test_first_page_says_what_came_out_and_what_to_do() -> None:
    """Verdict, certainty, errors, response, equation, tests to come; glossary, provenance."""
    sine = Sine(5.0, 1e-3, 0.9, (0.89, 0.91), -20.0, (-21.0, -19.0), 0.0111, (0.011, 0.0112))
    rivals = (
        Rival('backlash', 0.0, 0.0, 0.0, True, 0.7, 0.7),
        Rival('valve-deadband', 3.0, 2.0, 1e-6, True, 0.2, 0.2),
    )
    found = diagnosis(6e-5)
    finding = replace(found.effects[0], rivals=rivals, probability=0.7)
    base = {'beta_1': Estimate(128.0, 1.0, 126.0, 130.0, '1/s')}
    found = replace(
        found,
        effects=(finding,),
        base=base,
        base_before=base,
        responses=(Response(250e3, (sine,), 12.3),),
        experiments=(Experiment('a down-sweep', 5e-4, 0.0, 42.0),),
        provenance={'seed': '7', 'sha256 of a.csv': 'abc'},
    )
    text = re.sub(r'<[^>]+>', ' ', render(page_of(found)))
    assert text.index('removable error removed') < text.index('sham effect of equal size')
    for shown in ('70 %', 'valve-deadband 20 %', '10 %', 'a down-sweep', '42', '126 to 130'):
        assert shown in text
    for shown in (
        '0.900',
        '-20.0',
        '11.10',
        '12.3',
        'sha256 of a.csv',
        'Glossary',
        'beta_1 = 128',
    ):
        assert shown in text


def test_remedies_say_no_more_than_names_and_sizes_do() -> None:
    """A size that the records leave open is no size; an improbable name is no repair order."""
    found = diagnosis(6e-5)
    (effect,) = found.effects
    (line,) = remedies(found)
    assert line.startswith('backlash, 60 um: ') and 'go on with --effect backlash' in line
    open_ = {n: replace(p, identified=False) for n, p in effect.parameters.items()}
    (line,) = remedies(replace(found, effects=(replace(effect, parameters=open_),)))
    assert 'of a size that is not known' in line and '60 um' not in line
    (line,) = remedies(replace(found, effects=(replace(effect, probability=0.33),)))
    assert 'Not likely enough for a repair' in line and '--effect' not in line


def test_chains_that_stand_still_have_no_r_hat_and_a_report_all_the_same() -> None:
    """What cannot be told is null in the JSON."""
    still = Draws(np.zeros((4, 2)), 'dream', 128).to_json()
    assert still['rhat'] is None
    assert diagnosis_report._drawn(still) == 'nan effective draws by DREAM(ZS), R-hat nan'


@pytest.mark.usefixtures('undrawn')
def test_the_answer_comes_first_and_what_was_done_to_the_records_last() -> None:
    """Verdict, how sure, picture, errors, parameters, what to do, what to type; sampling last."""
    sampling = tuple(f'record {i} at 1000 Hz is fitted at 250 Hz' for i in range(3))
    base = {'alpha_2': Estimate(2.4e5, 1e3, 2.3e5, 2.5e5, 'N/m')}
    found = diagnosis(6e-5)
    finding = replace(found.effects[0], rivals=(), probability=0.9749)
    found = replace(
        found,
        effects=(finding,),
        base=base,
        base_before=base,
        advice=('check the pins', *sampling),
        preparation=sampling,
        alarm=replace(found.alarm, tests={'ljung_box_p': 0.5, 'trend': 2e-6}),
    )
    page = render(page_of(found))
    lead, first = page.index('class="lead"'), page.index('<img')
    assert lead < page.index('Something is missing') < first < page.index('<table')
    text = re.sub(r'data:image/png;base64,[^"]*|<style.*?</style>', '', page, flags=re.DOTALL)
    text = re.sub(r'<[^>]+>', ' ', text)
    order = [
        'How sure: 97 % is the probability of the name backlash',
        'removable error removed',
        '240 kN/m (230 to',
        '60 um (54 to 66)',
        'What to do: check pins',
        'Next: actuator-glue',
        'check the pins',
    ]
    places = [text.index(words) for words in order]
    assert places == sorted(places)
    records = text.index('What was read, and from where')
    assert all(text.index(line) > records and text.count(line) == 1 for line in sampling)
    before_programs = text[: text.index('Names and SI units as programs have them')]
    for key in ('alpha_2', 'ljung_box_p', 'missing-effect', 'e-05', 'e+05'):
        assert key not in before_programs, key
    assert 'largest trend [um/s]' in before_programs


def test_the_first_picture_shows_residual_and_noise(overlapping_texts) -> None:
    """Before and after over the same stretch of held-out data, and what noise makes of it."""
    for play in (6e-5, 0.0):
        found = diagnosis(play)
        figure = drawn('residual_summary', found)
        left, right = figure.axes
        assert len(left.lines) == len(right.patches) == (2 if play else 1)
        rms = [1e6 * found.error.before, 1e6 * found.error.after][: len(left.lines)]
        assert [p.get_height() for p in right.patches] == pytest.approx(rms)
        heights = [p.get_height() for p in left.patches]
        assert heights == pytest.approx([4e6 * found.error.noise_floor])
        assert right.lines[-1].get_ydata() == pytest.approx([1e6 * found.error.noise_floor] * 2)
        legend = [t.get_text() for t in figure.legends[0].get_texts()]
        assert {'noise (2 standard deviations)', 'noise (rms)'} <= set(legend)
        assert overlapping_texts(figure) == []
