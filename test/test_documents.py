"""Documents say what is true: links lead somewhere, every block of code is run or says why not."""

import ast
import json
import re
import shlex
import shutil
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
import pytest
import yaml

import actuator_glue as ag
from actuator_glue.cli.main import build_parser, main
from actuator_glue.errors import InputError
from actuator_glue.io.load import load_records
from actuator_glue.streams.layout_file import read_layout
from actuator_glue.streams.play import check

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *sorted((ROOT / 'docs').rglob('*.md'))]
NOTEBOOKS = sorted((ROOT / 'examples' / 'notebooks').glob('*.ipynb'))
FENCE = re.compile(r'^```(\S*)\n(.*?)^```', re.MULTILINE | re.DOTALL)
LINK = re.compile(r'\]\(([^)\s]+)\)')

WORDS = 2500  # of a page that somebody is to read
KIND_WORDS = 1500  # of the one page for a kind of user

# Commands of documents that no test runs as they stand, and why.
NOT_RUN = {
    r'make\b': 'targets of the Makefile: continuous integration runs them',
    r'git clone|colcon|pip install|\. install/': 'set-up of a computer: continuous integration',
    r'ros2|install/actuator_glue/lib': 'nodes and tools of ROS 2 that run until Ctrl-C: test/ros',
    r'actuator-glue view': 'serves until Ctrl-C: test/view',
    r'actuator-glue send': 'needs a receiver: test/streams, test/ros',
    r'actuator-glue doctor': 'asks what this computer is: test/cli',
    r'ssh|eval|tshark|openssl|head|printf|python3? ': 'tools of the system, told as examples',
    r'jq ': 'asks JSON that a command wrote: test/cli/test_json_pages.py',
    r'(export )?[A-Z_]+=': 'settings of the environment',
}
# Commands of ours that are run elsewhere: a server, a receiver, this computer, a folder of tests.
ELSEWHERE = {'view', 'send', 'doctor', 'campaign', 'history', 'compare'}
# Commands that estimate: a minute each, run with the slow tests.
LONG = {'calibrate', 'diagnose', 'replay', 'rths', 'plot', 'simulate'}
# Blocks of Python that are no programs, by their first line, and why.
NO_PROGRAM = {
    'block = SampleBlock(': 'part of a node: test/ros publishes so',
    'samples = node.create_publisher': 'part of a node: test/ros waits so',
}


class Block(NamedTuple):
    """One fenced block of a page."""

    page: Path
    language: str
    text: str


def blocks(*languages: str) -> list[Block]:
    """Return the blocks of some languages."""
    found = [
        Block(page, *match.groups())
        for page in PAGES
        for match in FENCE.finditer(page.read_text('utf-8'))
    ]
    return [block for block in found if block.language in languages]


def indented() -> list[Block]:
    """Return the commands of ours that stand in blocks by indentation; a synopsis is none."""
    return [
        Block(page, 'sh', match[0])
        for page in PAGES
        for match in re.finditer(
            r'(?:^ {4}actuator-glue (?!.*\.\.\.).*\n)+', page.read_text('utf-8'), re.MULTILINE
        )
    ]


def name(value: object) -> str:
    """Name a page or block in a test's id."""
    page = value.page if isinstance(value, Block) else value
    return page.name if isinstance(page, Path) else str(page)


def commands(block: Block) -> Iterator[list[str]]:
    """Yield the commands of a block of shell as words, comments and paths of tools left out."""
    for line in block.text.replace('\\\n', ' ').splitlines():
        words = shlex.split(line, comments=True)
        if words:
            yield [
                'actuator-glue' if words[0].endswith('bin/actuator-glue') else words[0],
                *words[1:],
            ]


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub and the site make them."""
    text = FENCE.sub('', page.read_text('utf-8'))
    titles = re.findall(r'^#+ (.+)$', text, re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', t.lower()).replace(' ', '-') for t in titles}


@pytest.mark.parametrize('page', PAGES, ids=name)
def test_a_page_is_read_in_a_quarter_of_an_hour(page: Path) -> None:
    """What is longer is two pages."""
    assert len(page.read_text('utf-8').split()) <= WORDS, f'{page.name} is too long'


def test_each_kind_of_user_has_a_short_page() -> None:
    """For whoever runs the actuator, the computers, or the numbers."""
    kinds = {page.stem: len(page.read_text('utf-8').split()) for page in PAGES}
    kinds = {stem: words for stem, words in kinds.items() if stem.startswith('for_')}
    assert set(kinds) == {'for_test_engineers', 'for_ros_engineers', 'for_statisticians'}
    assert max(kinds.values()) < KIND_WORDS


@pytest.mark.parametrize('page', PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    """Files that are there, headings that are there; others' pages are not asked for."""
    for link in LINK.findall(FENCE.sub('', page.read_text('utf-8'))):
        if link.startswith(('http://', 'https://', 'mailto:')):
            continue
        place, _, heading = link.partition('#')
        target = (page.parent / place).resolve() if place else page
        assert target.exists(), f'{page.name}: {link}'
        assert not heading or heading in anchors(target), f'{page.name}: {link}'


def test_every_page_is_on_the_site() -> None:
    """Some toctree names it; `make docs` would end otherwise."""
    docs = ROOT / 'docs'
    trees = [b.text for b in blocks('{toctree}')]
    named = {line for text in trees for line in text.split() if not line.startswith(':')}
    pages = {p.relative_to(docs).with_suffix('').as_posix() for p in docs.rglob('*.md')}
    assert pages - {'index'} <= named


def test_every_block_has_a_language_that_is_known() -> None:
    """What is in a block decides how it is tested."""
    known = {'sh', 'python', 'yaml', 'matlab', '', '{toctree}', '{eval-rst}'}
    assert {b.language for b in blocks(*known)} == {
        match[1] for page in PAGES for match in FENCE.finditer(page.read_text('utf-8'))
    }


@pytest.mark.parametrize('block', blocks('yaml'), ids=name)
def test_yaml_is_yaml(block: Block) -> None:
    """Every block of YAML is a mapping that loads safely."""
    assert isinstance(yaml.safe_load(block.text), dict)


@pytest.mark.parametrize('block', [*blocks('sh'), *indented()], ids=name)
def test_commands_exist_with_their_options(block: Block) -> None:
    """Every command of ours is parsed; of others it is said why no test runs them."""
    for words in commands(block):
        line = ' '.join(words)
        if words[0] == 'actuator-glue':
            parser = build_parser(words[1])
            assert parser.parse_args(words[1:]).run
        else:
            assert any(re.match(pattern, line) for pattern in NOT_RUN), line


@pytest.fixture
def laboratory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files that documents speak of."""
    from actuator_glue.io.export import write
    from actuator_glue.io.load import load

    monkeypatch.chdir(tmp_path)
    names = {
        'free': ('free', 'raw'),
        'clamped': ('clamped', 'test'),
        'undeclared_earthquake': ('earthquake',),
    }
    for bag, files in names.items():
        record = load(ROOT / 'bags' / bag)
        for file in files:
            write(tmp_path / f'{file}.csv', record)
    for seed, day in enumerate(('tuesday', 'today')):
        made = ['simulate', f'{day}.csv', '--stiffness', '250e3', '--duration', '10']
        assert main([*made, '--seed', str(seed)]) == 0
    write(tmp_path / 'test.mat', load(tmp_path / 'test.csv'))
    for file, columns in (('command', (0, 1)), ('response', (0, 2))):
        rows = [
            line.split(',') for line in (tmp_path / 'test.csv').read_text('utf-8').splitlines()
        ]
        kept = [','.join(row[i] for i in columns) for row in rows if len(row) > max(columns)]
        (tmp_path / f'{file}.csv').write_text('\n'.join(kept) + '\n')
    lines = (tmp_path / 'raw.csv').read_text('utf-8').splitlines()
    rows = [line.split(',')[1:] for line in lines if line[0].isdigit()]
    text = '\n'.join(['Logger', 'a,b,f', *(','.join(row) for row in rows)]) + '\n'
    (tmp_path / 'raw.txt').write_text(text)
    (tmp_path / 'out').mkdir()
    shutil.copytree(ROOT / 'bags' / 'session', tmp_path / 'out' / 'tuesday')
    shutil.copytree(ROOT / 'bags', tmp_path / 'bags')
    assert main(['map', 'raw.txt', '--rate', '200', '--out', 'map.yaml']) == 0
    return tmp_path


@pytest.fixture
def earlier(laboratory: Path) -> None:
    """What commands that estimate take from elsewhere: a calibration, an earthquake."""
    shaking = 0.3 * np.sin(np.linspace(0.0, 40.0, 1000)) * np.linspace(1.0, 0.0, 1000)
    (laboratory / 'elcentro.AT2').write_text(
        'Ground motion\nof nowhere\nACCELERATION IN UNITS OF G\nNPTS= 1000, DT= .0100 SEC\n'
        + '\n'.join(f'{a:.6E}' for a in shaking)
    )
    monday = ['free.csv', 'clamped.csv', '--stiffness', '0', '250e3', '--save', 'monday.npz']
    assert main(['calibrate', *monday]) == 0
    (laboratory / 'priors').mkdir()
    shutil.copy('monday.npz', 'priors/north.npz')


def run(words: list[str]) -> int:
    """Run one of our commands; whatever it would write over is its own."""
    written = {'calibrate', 'convert', 'diagnose', 'map', 'plot', 'simulate'}
    return main([*words[1:], *(['--force'] if words[1] in written else [])])


SHORT = ('howto_your_data.md', 'howto_record_and_replay.md', 'howto_recover.md', 'recipes.md')


@pytest.mark.parametrize('page', SHORT)
def test_short_commands_do_what_the_page_says(page: str, laboratory: Path) -> None:
    """Commands that look at files and convert them, in the order of the page."""
    missing = {'out/monday', 'run.tdms'}  # told of, and made by nobody here
    ran = 0
    for block in blocks('sh'):
        for words in commands(block):
            wanted = block.page.name == page and words[0] == 'actuator-glue'
            if not wanted or words[1] in {*LONG, *ELSEWHERE}:
                continue
            if missing & set(words):
                continue
            assert run(words) == 0, words
            ran += 1
    assert ran


@pytest.mark.parametrize('page', PAGES, ids=name)
def test_what_is_sent_has_the_rate_of_its_layout(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of records that the page makes, or docs/start.md; the rest of sending needs a receiver."""
    monkeypatch.chdir(tmp_path)
    found = re.findall(r'actuator-glue ((?:simulate|send) [^`\n]+)', page.read_text('utf-8'))
    lines = [shlex.split(line, comments=True) for line in found]
    sent = {words[1] for words in lines if words[0] == 'send'}
    if 'test.csv' in sent:
        assert main(['simulate', 'test.csv', '--duration', '1']) == 0
    for words in lines:
        if words[0] == 'simulate' and words[1] in sent:
            assert main([*words, '--duration', '1', '--force']) == 0, words
        if words[0] == 'send' and '--layout' in words:
            (record,) = load_records(words[1])
            check(record, read_layout(words[words.index('--layout') + 1]))


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize('page', PAGES, ids=name)
@pytest.mark.usefixtures('earlier')
def test_long_commands_do_what_the_page_says(page: Path) -> None:
    """Commands that estimate, with those before them; 1 is an answer, too."""
    for block in blocks('sh'):
        for words in commands(block):
            if block.page != page or words[0] != 'actuator-glue':
                continue
            if words[1] in ELSEWHERE or {'out/monday', 'run.tdms'} & set(words):
                continue
            assert run(words) in (0, 1), words


@pytest.mark.parametrize('block', blocks('python'), ids=name)
def test_python_is_python(block: Block) -> None:
    """It compiles, and every name it takes from the package is there."""
    tree = ast.parse(block.text)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith('actuator_glue'):
            module = __import__(str(node.module), fromlist=['x'])
            assert all(hasattr(module, alias.name) for alias in node.names)
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == 'ag':
            assert hasattr(ag, node.attr), node.attr


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize('page', PAGES, ids=name)
def test_python_runs(page: Path, laboratory: Path) -> None:
    """The programs of a page one after the other, in a folder with the files they name."""
    names: dict[str, object] = {'ag': ag}
    found = [b for b in blocks('python') if b.page == page]
    if any('posterior.npz' in b.text for b in found):
        ag.calibrate([ag.load('free.csv'), ag.load('clamped.csv')], evaluations=30_000).save(
            'posterior.npz'
        )
    for block in found:
        if not any(block.text.startswith(first) for first in NO_PROGRAM):
            exec(compile(block.text, page.name, 'exec'), names)


def program(path: Path) -> list[str]:
    """Return the cells of code of a notebook, without what only notebooks know."""
    cells = json.loads(path.read_text('utf-8'))['cells']
    code = [''.join(cell['source']) for cell in cells if cell['cell_type'] == 'code']
    return [re.sub(r'^%.*$', '', source, flags=re.MULTILINE) for source in code]


@pytest.mark.parametrize('path', NOTEBOOKS, ids=name)
def test_notebooks_are_stored_without_outputs(path: Path) -> None:
    """Outputs are made when the site is built; code compiles."""
    for cell in json.loads(path.read_text('utf-8'))['cells']:
        if cell['cell_type'] == 'code':
            assert not cell['outputs']
            assert cell['execution_count'] is None
    assert all(ast.parse(source) for source in program(path))


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize('path', NOTEBOOKS, ids=name)
def test_notebooks_run_in_half_a_minute(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each from its first cell to its last; the second run, when all is compiled, is timed."""
    mpl.use('Agg')
    monkeypatch.chdir(path.parent)
    seconds = 0.0
    for _ in range(2):
        names: dict[str, object] = {}
        begin = time.process_time()
        for source in program(path):
            exec(compile(source, path.name, 'exec'), names)
        seconds = time.process_time() - begin
        with suppress(InputError, KeyError):
            ag.effects.unregister('bent-sensor')
    assert seconds < 30.0
