"""The terminal and the first page of the report say the same things in the same order."""

import html
import json
import re
import shlex
from pathlib import Path

import pytest

import actuator_glue as ag
from actuator_glue.cli._as_asked import as_asked
from actuator_glue.cli.main import build_parser, main
from actuator_glue.io.export import write
from actuator_glue.report.first_page import command

PARTITION = 'benchmark_case_1'
# What comes first, in this order, of a calibration that fits.
ORDER = (
    'the model fits',
    'How sure: +-',
    'rms [um]',
    'Parameters before',
    'Delay: ',
    f'Hybrid test {PARTITION}',
    'Next: actuator-glue',
    'Posterior moments',
)


def text_of(page: Path) -> str:
    """Return what a report says, without pictures and the look."""
    text = re.sub(
        r'data:image/png;base64,[^"]*|<style.*?</style>',
        '',
        page.read_text('utf-8'),
        flags=re.DOTALL,
    )
    return html.unescape(re.sub(r'<[^>]+>', ' ', text))


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two tests of one actuator, one of them under a specimen."""
    out = tmp_path_factory.mktemp('first page')
    for name, k in (('free', 0.0), ('clamped', 250e3)):
        record = ag.simulate(ag.Command(rate=200.0, duration=15.0), stiffness=k, seed=(2, int(k)))
        write(out / f'{name}.csv', record)
    return out


@pytest.mark.usefixtures('undrawn')
def test_terminal_and_report_agree(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Verdict, how sure, errors, parameters, delay, hybrid test, command; then the rest."""
    monkeypatch.chdir(folder)
    files = ['free.csv', 'clamped.csv', '--stiffness', '0', '250e3']
    options = ['--evaluations', '16000', '--partition', PARTITION, '--report', 'c.html']
    assert main(['calibrate', *files, *options, '--json', 'c.json']) == 0
    said, page = capsys.readouterr().out, text_of(folder / 'c.html')
    for text in (said, page):
        places = [text.index(words) for words in ORDER]
        assert places == sorted(places)
    # A picture after how sure it is, before the first table.
    raw = (folder / 'c.html').read_text('utf-8')
    assert raw.index('How sure') < raw.index('<img') < raw.index('<table')
    told = json.loads((folder / 'c.json').read_text())
    (following,) = re.findall(r'Next: (.*)', said)
    assert following == (
        'actuator-glue diagnose free.csv clamped.csv --stiffness 0 250000 --report report.html '
        f'--partition {PARTITION}'
    )
    assert following in page
    words = shlex.split(following)
    assert build_parser(words[1]).parse_args(words[1:]).run
    delay = told['tracking'][1]['predicted']['delay_at_5_hz_s']
    for text in (said, page):
        (shown,) = re.findall(r'(\S+) ms \((\S+) to (\S+)\) at 5 Hz in clamped.csv', text)
        limits = [1e3 * delay[key] for key in ('median', 'lower', 'upper')]
        assert [float(v) for v in shown] == pytest.approx(limits, abs=6e-3)
        assert len(set(shown)) == 3
        assert f'{1e6 * told["error"]["rms_m"]:.1f}' in text
        assert 'it is unstable without a compensator' in text  # 67 ms in a loop that bears 15
    mean, sd = (told['parameters']['beta_1'][key] for key in ('mean', 'stddev'))
    low = float(re.search(r'beta_1 .*\((\S+) to', said)[1])  # type: ignore[index]  # it is there
    assert low == pytest.approx(mean - 1.96 * sd, rel=2e-3)


def test_what_only_the_prior_says_is_marked(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A free actuator tells of the valve alone, and of no parameter of the load by itself."""
    main(['calibrate', str(folder / 'free.csv'), '--stiffness', '0', '--evaluations', '16000'])
    rows = capsys.readouterr().out.partition('Parameters before')[2].partition('Delay:')[0]
    marked = re.findall(r'^ (\w+) .* little more than its prior\s*$', rows, re.MULTILINE)
    assert {'alpha_2', 'alpha_3'} <= set(marked)
    assert 'beta_1' in rows and 'beta_1' not in marked


@pytest.mark.usefixtures('undrawn')
def test_the_next_command_reads_as_this_one_did(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With its channel map, in the report, too; where chains have not met, with more of them."""
    monkeypatch.chdir(folder)
    (folder / 'map.yaml').write_text(
        'time: {column: time_s, unit: s}\ncommand: {column: command_mm, unit: mm}\n'
        'measured: {column: measured_mm, unit: mm}\n'
    )
    line = ['calibrate', 'clamped.csv', '--stiffness', '250e3', '--channels', 'map.yaml']
    assert main([*line, '--evaluations', '12000', '--report', 'm.html']) in (0, 1)
    (following,) = re.findall(r'Next: (.*)', capsys.readouterr().out)
    assert following.endswith('--channels map.yaml') and '--stiffness 250000' in following
    assert following in text_of(folder / 'm.html')


@pytest.mark.parametrize(
    ('typed', 'said', 'told'),
    [
        (
            'calibrate a.csv --resample 27 --resample-by lines --use-force --seed 3 --settle 1',
            'diagnose a.csv --report report.html',
            '--resample 27 --resample-by lines --use-force --seed 3',
        ),
        (
            'calibrate a.csv --bounds x=0:1 --bounds y=0:2 --likelihood ar1 --settle 0.5',
            'calibrate a.csv --evaluations 120000',
            '--likelihood ar1 --settle 0.5 --bounds x=0:1 --bounds y=0:2',
        ),
        (
            'calibrate a.csv --evaluations 60001',
            'calibrate a.csv --evaluations 120002',
            '',
        ),
        (
            'diagnose a.csv --prior m.npz --prior-age 24h --split --effects-file "my own.yaml"',
            'calibrate a.csv --effect backlash --save posterior.npz',
            "--split --effects-file 'my own.yaml' --prior m.npz --prior-age 86400s",
        ),
        ('diagnose a.csv --drift 0.1 --resample-by lines --jobs 1', 'calibrate a.csv', ''),
        (
            'diagnose a.csv --stiffness 0 --holdout b.csv --json - --force --hold linear',
            'diagnose a.csv --stiffness 5 --hold zoh',
            '',
        ),
    ],
)
def test_what_was_asked_for_is_asked_again(typed: str, said: str, told: str) -> None:
    """Options that the next command has, too; those it says itself stand; it can be typed."""
    words = shlex.split(typed)
    args = build_parser(words[0]).parse_args(words)
    following = as_asked(f'actuator-glue {said}', args)
    assert following == f'actuator-glue {said} {told}'.rstrip()
    words = shlex.split(following)[1:]
    assert build_parser(words[0]).parse_args(words).run


def test_draws_that_are_kept_are_looked_at() -> None:
    """No second run of what was saved; draws for MATLAB are none that a command reads."""
    args = build_parser('calibrate').parse_args(
        ['calibrate', 'a.csv', '--channels', 'map.yaml', '--save', 'tuesday.npz']
    )
    said = 'actuator-glue calibrate a.csv --stiffness 0 --effect backlash --save posterior.npz'
    assert as_asked(said, args) == (
        'actuator-glue plot a.csv --stiffness 0 --draws tuesday.npz --channels map.yaml'
    )
    args.save = 'tuesday.mat'
    assert as_asked(said, args) == f'{said} --channels map.yaml'


@pytest.mark.parametrize(
    ('tests', 'typed'),
    [
        ([('a.csv', 0.0), ('b.csv', 250e3)], 'a.csv b.csv --stiffness 0 250000'),
        ([('a b.csv', 1.5)], "'a b.csv' --stiffness 1.5"),
        ([('a.csv', None), ('b.csv', 1.0)], 'a.csv b.csv'),
        ([('', 1.0)], 'RECORD --stiffness 1'),
        (
            [('bag:/samples (record 1 of 2)', 5.0), ('bag:/samples (record 2 of 2)', 5.0)],
            'bag --stiffness 5',
        ),
        ([('x.csv (resampled to 500 Hz)', 0.0)], 'x.csv --stiffness 0'),
        ([('C:/lab/x.csv', 0.0)], 'C:/lab/x.csv --stiffness 0'),
    ],
)
def test_records_are_written_as_a_shell_takes_them(
    tests: list[tuple[str, float | None]], typed: str
) -> None:
    """Paths alone, each once; stiffnesses where all are known."""
    assert command('calibrate', tests) == f'actuator-glue calibrate {typed}'
