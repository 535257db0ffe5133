"""simulate, convert, info, recover, plot: files in, files out, one message where not."""

import shlex
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.cli._records import first_of
from actuator_glue.cli.main import build_parser
from actuator_glue.io.load import load_records


@pytest.mark.parametrize('suffix', ['csv', 'mat'])
def test_there_and_back(run, tmp_path: Path, short_bag: Path, suffix: str) -> None:
    """Bag to file to bag loses nothing where the unit is m."""
    middle, last = tmp_path / f'm.{suffix}', tmp_path / 'bag'
    assert run('convert', short_bag, middle, '--unit', 'm').code == 0
    assert run('convert', middle, last, '--block', 7).code == 0
    (a,), (b,) = load_records(short_bag), load_records(last)
    assert a.measured.tobytes() == b.measured.tobytes()
    assert (a.stiffness, a.hold, a.period) == (b.stiffness, b.hold, b.period)


def test_mapped_text_through_a_bag(run, tmp_path: Path) -> None:
    """Text with a channel map becomes a bag that needs no map any more."""
    lines = [f'{i};{np.sin(i / 9):.6f};{np.sin(i / 9 - 0.2):.6f}' for i in range(300)]
    (tmp_path / 'lab.txt').write_text('x;u;y\n' + '\n'.join(lines) + '\n')
    (tmp_path / 'map.yaml').write_text(
        'header_lines: 1\nrate: 50\ncommand: {column: u, unit: mm}\n'
        'measured: {column: y, unit: mm}\nhold: linear\n'
    )
    bag = tmp_path / 'bag'
    lab, channels = tmp_path / 'lab.txt', ('--channels', tmp_path / 'map.yaml')
    assert run('convert', lab, bag, *channels, '--stiffness', 5e4).code == 0
    (record,) = load_records(bag)
    assert (len(record), record.period, record.hold, record.stiffness) == (
        300,
        0.02,
        'linear',
        5e4,
    )
    assert 'no column for time' in run('info', lab).message


def test_several_records_are_one_bag_or_numbered_files(
    run, tmp_path: Path, problem_r: Path
) -> None:
    """The paper's pair of tests: two files, one bag, two files."""
    bag = tmp_path / 'pair'
    assert run('convert', problem_r / 'r_1.csv', problem_r / 'r_2.csv', bag).code == 0
    assert [r.stiffness for r in load_records(bag)] == [0.0, 250e3]
    assert run('convert', bag, tmp_path / 'x.csv').code == 0
    assert sorted(p.name for p in tmp_path.glob('*.csv')) == ['x_1.csv', 'x_2.csv']


def test_info_takes_a_stiffness_for_each_file(run, tmp_path: Path, problem_r: Path) -> None:
    """As the commands behind it do: one for each file, one for all, one for each of a bag."""
    one, two = problem_r / 'r_1.csv', problem_r / 'r_2.csv'

    def told(*arguments: object) -> list[float]:
        files = run('info', *arguments, '--json', '-').json['files']
        return [r['stiffness_n_per_m'] for file in files for r in file['records']]

    assert told(one, two, '--stiffness', 1e3, 2e3) == [1e3, 2e3]
    assert told(one, two, '--stiffness', 1e3) == [1e3, 1e3]
    assert run('convert', one, two, tmp_path / 'bag').code == 0
    assert told(tmp_path / 'bag', '--stiffness', 1e3, 2e3) == [1e3, 2e3]


def test_a_cut_bag_is_told_mended_and_used(run, tmp_path: Path, short_bag: Path) -> None:
    """Info and calibrate say what to do, recover does it, and then they work."""
    bag = tmp_path / 'bag'
    bag.mkdir()
    content = next(short_bag.glob('*.mcap')).read_bytes()
    (bag / 'bag_0.mcap').write_bytes(content[: len(content) * 2 // 3])
    done = run('info', bag, '--json', '-')
    assert done.code == 2
    assert done.json['files'][0]['finished'] is False
    assert done.json['files'][0]['records'][0]['samples'] > 300
    assert 'actuator-glue recover' in done.err
    for command in (('calibrate', bag), ('replay', bag), ('convert', bag, tmp_path / 'x.csv')):
        refused = run(*command)
        assert refused.code == 2
        assert 'recover' in refused.message
    mended = run('recover', bag, '--json', '-')
    assert mended.code == 0
    assert mended.json['schema'] == 'actuator_glue.recovery/1'
    assert mended.json['rewritten'] == ['bag_0.mcap']
    assert run('info', bag).code == 0
    assert 'nothing to mend' in run('recover', bag).out
    assert 'no such bag' in run('recover', tmp_path / 'nothing').message


def test_a_bad_set_up_is_told_and_the_rest_is_used(run, tmp_path: Path, short_bag: Path) -> None:
    """`info`, `convert` and `replay` go on as live nodes do; seconds of data are a number."""
    from actuator_glue.io import messages
    from actuator_glue.io.bag_records import write_record
    from actuator_glue.io.bag_writer import BagWriter

    (record,) = load_records(short_bag)
    wrong = messages.message(
        'TestSetup',
        header=messages.header(record.start_ns, ''),
        actuator='a',
        index=0,
        rate=100,
        specimen_stiffness=0.0,
        hold='cubic',
        source='',
        motion='',
    )
    block = messages.message(
        'SampleBlock',
        header=messages.header(0, ''),
        period=np.nan,
        index=10**6,
        command=np.zeros(2),
        measured=np.zeros(2),
        force=np.zeros(0),
    )
    for name in ('set-up', 'set-up and block'):
        with BagWriter(tmp_path / name) as writer:
            write_record(writer, record)
            writer.write('/test_setup', wrong, record.stamp_ns(len(record)))
            if 'block' in name:
                writer.write('/samples', block, record.stamp_ns(len(record)) + 1)
    done = run('info', tmp_path / 'set-up', '--json', '-')
    assert done.code == 0, done.err
    assert "hold 'cubic' is unknown" in done.json['files'][0]['warnings'][0]
    done = run('convert', tmp_path / 'set-up', tmp_path / 'out.csv', '--unit', 'm')
    assert done.code == 0, done.err
    assert 'note: ' in done.err and 'cubic' in done.err
    assert load_records(tmp_path / 'out.csv')[0].stiffness == record.stiffness
    options = ('--window', 3, '--evaluations', 4000)
    done = run('replay', tmp_path / 'set-up and block', *options)
    assert done.code == 0, done.err
    assert "hold 'cubic' is unknown" in done.err
    assert 'over 8.0 s of data' in done.out


def test_a_gap_is_refused_unless_it_may_split(run, tmp_path: Path, short_bag: Path) -> None:
    """Missing samples are one message; --split takes what is left and goes on telling."""
    from actuator_glue.io.bag_records import write_record
    from actuator_glue.io.bag_writer import BagWriter

    (record,) = load_records(short_bag)
    bag = tmp_path / 'gap'
    with BagWriter(bag) as writer:
        write_record(writer, record.slice(0, 300))
        write_record(writer, record.slice(350, 801))
    for command in (('calibrate', bag), ('plot', bag), ('convert', bag, tmp_path / 'x.csv')):
        done = run(*command)
        assert done.code == 2
        assert '50 samples (0.5 s) are missing before sample 350' in done.message
    shown = run('info', bag, '--json', '-')
    assert shown.code == 2
    assert [r['samples'] for r in shown.json['files'][0]['records']] == [300, 451]
    done = run('convert', bag, tmp_path / 'x.csv', '--split')
    assert done.code == 0
    assert 'missing' in done.err
    assert sorted(p.name for p in tmp_path.glob('*.csv')) == ['x_1.csv', 'x_2.csv']


def test_of_very_many_gaps_a_few_are_told_and_where_the_rest_is(
    run, tmp_path: Path, short_bag: Path
) -> None:
    """A line each hid what else was said; JSON has all."""
    from actuator_glue.io.bag_records import write_record
    from actuator_glue.io.bag_writer import BagWriter

    (record,) = load_records(short_bag)
    bag = tmp_path / 'many gaps'
    with BagWriter(bag) as writer:
        for first in range(0, 800, 10):
            write_record(writer, record.slice(first, first + 8))
    where = f"79 in all: `actuator-glue info '{bag}' --split --json OUT` has them"
    for options in ((), ('--split',)):
        shown = run('info', bag, *options, '--json', '-')
        assert shown.code == (0 if options else 2)
        assert shown.err.count(' are missing before sample ') == 20
        assert f'59 more of such lines, {where}' in shown.err
        assert '60 more records, 80 in all' in shown.err
        (content,) = shown.json['files']
        assert len(content['warnings' if options else 'damage']) == 79
        assert len(content['records']) == 80
    done = run('convert', bag, tmp_path / 'whole', '--split')
    assert done.code == 0
    assert done.err.count(' are missing before sample ') == 20
    assert f'and 59 more gaps, {where}' in done.err
    # Of several files the rest may be of any of them.
    done = run('convert', short_bag, bag, tmp_path / 'both', '--split')
    assert done.code == 0
    where = f"`actuator-glue info {short_bag} '{bag}' --split --json OUT` has them"
    assert f'and 59 more gaps, 79 in all: {where}' in done.err


@pytest.mark.parametrize('command', ['convert bag out', 'calibrate bag', 'info bag'])
def test_the_command_that_has_the_rest_reads_as_this_one_did(command: str) -> None:
    """Without its channel map it would find nothing in a bag of other topics."""
    verb, *words = command.split()
    asked = (verb, *words, '--channels', 'my map.yaml', '--hold', 'linear')
    args = build_parser(verb).parse_args(asked)
    first, more = first_of([*range(21)], 'gaps', ['bag'], args)
    assert first == [*range(20)]
    (line,) = more
    said, _, again = line.removesuffix('` has them').partition('`')
    assert said == 'and 1 more gaps, 21 in all: '
    assert sorted(shlex.split(again)) == sorted(
        [*shlex.split('actuator-glue info bag --split --json OUT'), *asked[-4:]]
    )
    assert first_of([*range(20)], 'gaps', ['bag'], args) == ([*range(20)], [])


def test_pictures_of_records(run, tmp_path: Path, short_bag: Path, problem_r: Path) -> None:
    """One picture per record; a bag without posteriors says how to get them."""
    done = run('plot', short_bag, problem_r / 'r_1.csv', '--out', tmp_path / 'pics')
    assert done.code == 0
    assert 'actuator-glue replay' in done.err
    names = sorted(p.name for p in (tmp_path / 'pics').iterdir())
    assert names == ['bag_1.png', 'r_1_2.png']
    assert (tmp_path / 'pics' / 'bag_1.png').read_bytes().startswith(b'\x89PNG')


BAD_FILES = {
    'nan': ('time_s,command_mm,measured_mm\n0,1,nan\n0.1,2,3\n', 'NaN'),
    'empty': ('', 'empty'),
    'one sample': ('time_s,command_mm,measured_mm\n0,1,2\n', 'at least two'),
    'time back': ('time_s,command_mm,measured_mm\n0,1,2\n0.2,1,2\n0.1,1,2\n', 'goes back'),
    'huge': ('time_s,command_m,measured_m\n0,1e6,2\n0.1,1,2\n', 'check the unit'),
    'wrong column': ('time_s,comand_mm,measured_mm\n0,1,2\n0.1,1,2\n', 'no column for command'),
    'no unit': ('time_s,command,measured_mm\n0,1,2\n0.1,1,2\n', 'no unit'),
}


@pytest.mark.parametrize('command', ['calibrate', 'info', 'convert', 'replay', 'plot'])
@pytest.mark.parametrize('case', BAD_FILES)
def test_bad_records_are_one_message(run, tmp_path: Path, command: str, case: str) -> None:
    """Every command that reads records refuses the same things in the same words, exit 2."""
    content, words = BAD_FILES[case]
    path = tmp_path / 'bad.csv'
    path.write_text(content)
    more = (tmp_path / 'out',) if command == 'convert' else ()
    done = run(command, path, *more, '--stiffness', 0)
    assert done.code == 2
    assert words in done.message
    assert str(path) in done.message


@pytest.mark.parametrize('command', ['calibrate', 'diagnose'])
@pytest.mark.parametrize(
    ('columns', 'words'),
    [
        (lambda u, x: (0 * u, x), 'command is constant'),
        (lambda u, x: (u, 0 * u), 'measured displacement is constant'),
        (lambda u, x: (u, u), 'the same, sample for sample'),
        (lambda u, x: (u, 1e3 * x), 'check the units'),
    ],
    ids=['still command', 'dead sensor', 'same column', 'metres as mm'],
)
def test_channels_that_identify_nothing_are_said(run, tmp_path, command, columns, words) -> None:
    """The records can be read, but no actuator is in them."""
    time = np.arange(2000) / 200.0
    u = np.sin(2.0 * np.pi * 0.7 * time)
    path = tmp_path / 'odd.csv'
    table = np.column_stack([time, *columns(u, np.roll(u, 3))])
    np.savetxt(path, table, delimiter=',', header='time_s,command_mm,measured_mm', comments='')
    done = run(command, path, '--stiffness', 0)
    assert done.code == 2
    assert words in done.message
    assert 'odd.csv' in done.message


def test_stiffness_and_options_that_cannot_be_used(run, tmp_path: Path, problem_r: Path) -> None:
    """Negative, unknown, too many, not a number; a map that is none; an unwritable output."""
    one, two = problem_r / 'r_1.csv', problem_r / 'r_2.csv'
    assert 'outside' in run('calibrate', one, '--stiffness', '-5').message
    assert 'one per path' in run('calibrate', one, '--stiffness', 1, 2, 3).message
    done = run('calibrate', one, two, '--stiffness', 'soft')
    assert done.code == 2
    assert "'soft' is not a number" in done.err
    unknown = tmp_path / 'unknown.csv'
    unknown.write_text('time_s,command_mm,measured_mm\n0,1,2\n0.1,1,2\n0.2,1,2\n')
    assert '--stiffness N/m' in run('calibrate', unknown).message
    assert '--stiffness N/m' in run('replay', unknown).message
    assert 'channel map' in run('info', one, '--channels', tmp_path / 'no.yaml').message
    assert 'is no folder' in run('info', one, '--json', one / 'x.json').message


def test_a_compressed_bag_has_its_size(run, tmp_path: Path, short_bag: Path) -> None:
    """`info` tells the bytes of `.mcap.zstd`, as rosbag2 names such files."""
    import shutil

    import zstandard

    folder = shutil.copytree(short_bag, tmp_path / 'copy')
    (plain,) = folder.glob('*.mcap')
    small = plain.with_name(f'{plain.name}.zstd')
    small.write_bytes(zstandard.compress(plain.read_bytes()))
    plain.unlink()
    listed = (folder / 'metadata.yaml').read_text().replace(plain.name, small.name)
    (folder / 'metadata.yaml').write_text(listed)
    assert f'{small.stat().st_size / 1e6:.2f} MB' in run('info', folder).out
    assert ', 0.00 MB' not in run('info', folder).out
