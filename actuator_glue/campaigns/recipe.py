"""The recipe of a campaign: how its files are read, grouped and analysed; a YAML file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal, get_args

from actuator_glue.errors import InputError
from actuator_glue.given import at_home
from actuator_glue.io.channel_map import parse_channel_map
from actuator_glue.io.partition import partition_file, read_partition
from actuator_glue.io.yaml_file import choice, mapping, number, read_file, texts
from actuator_glue.records import Hold, check_stiffness

Diagnose = Literal['structure', 'always', 'never']
# By what tests can be grouped; a name, a table or the file itself says each of them.
KEYS = ('actuator', 'day', 'specimen', 'group')
_OF_A_PRIOR = ('prior', 'drift', 'prior_age')
# What a name or a table may say of a file besides.
SAID = (*KEYS, 'started', 'stiffness', 'hold')


@dataclass(frozen=True, slots=True)
class FileRule:
    """How files of one pattern are read; of several rules that match, the last one that says it.

    Attributes:
        match: pattern of the file's path below the folder given, as `*_free.csv`.
        channels: channel map of these files: a YAML file, one of the package, or what it says.
        stiffness: specimen stiffness [N/m].
        hold: how their commands run between samples.
        resample: rate to which a jittered clock is made even [Hz].
        split: stretches between gaps of a bag are records of their own.
    """

    match: str
    channels: Mapping[str, Any] | str | None = None
    stiffness: float | None = None
    hold: Hold | None = None
    resample: float | None = None
    split: bool | None = None


@dataclass(frozen=True, slots=True)
class Recipe:
    """How a campaign reads, groups and analyses its records; every entry may be left out.

    Attributes:
        files: how files are read, by patterns.
        names: regular expression, searched in each file's path; its named groups are those of
            `SAID`: actuator, day, specimen, group, started, stiffness, hold.
        table: CSV file with a column `file` and columns of `SAID`, in place of or beside names.
        group: tests that are analysed together: those alike in all of these (of `KEYS`); without,
            every file by itself.
        holdout: pattern of files that decide nothing, as for `diagnose --holdout`.
        calibrate: options of `calibrate` by name; no prior, for rows are pooled as independent.
        diagnose: 'structure' where a calibration leaves more than noise, 'always' or 'never'.
        false_alarms: probability of an addition on a healthy machine.
        partition: hybrid test whose P(unstable) is told; a YAML file or one of the package.
        draws: keep the draws of every calibration, in `draws/`.
        reports: write the report of every diagnosis, in `reports/`.
        seconds: time that one group may take [s].
        memory_gb: memory that one group may take [GB].
    """

    files: tuple[FileRule, ...] = ()
    names: str | None = None
    table: str | None = None
    group: tuple[str, ...] = ()
    holdout: str | None = None
    calibrate: Mapping[str, Any] = field(default_factory=dict)
    diagnose: Diagnose = 'structure'
    false_alarms: float = 0.01
    partition: str | None = None
    draws: bool = False
    reports: bool = True
    seconds: float = 3600.0
    memory_gb: float = 4.0

    def analysis(self) -> dict[str, Any]:
        """Return what of the recipe decides a row's numbers, beside the files; JSON can hold it.

        Raises:
            InputError: a partition that cannot be read.
        """
        names = ('diagnose', 'false_alarms', 'draws', 'reports')
        out = {'calibrate': dict(self.calibrate), **{n: getattr(self, n) for n in names}}
        if self.partition is not None:
            path, content = partition_file(self.partition)
            out |= {'partition': content, 'partition_name': path.stem}
        return out


def read_recipe(path: Path | str) -> Recipe:
    """Return the recipe of a YAML file; paths in it count from its folder.

    Raises:
        InputError: it cannot be read, an unknown entry, or a value that cannot be used.
    """
    path, content = read_file(path, 'recipe', 'a recipe is a page of text', 'recipes')
    return parse_recipe(content, path.parent, f'{path}: recipe')


def parse_recipe(content: object, folder: Path, where: str = 'recipe') -> Recipe:
    """Return the recipe that a mapping describes.

    Args:
        content: as in YAML; None for one that says nothing.
        folder: from which its paths count.
        where: place, for messages.

    Raises:
        InputError: as `read_recipe`.
    """
    values = mapping({} if content is None else content, Recipe, where)
    values = {name: value for name, value in values.items() if value is not None}
    rules = values.get('files', [])
    if not isinstance(rules, list):
        raise InputError(f'{where}: files must be a list of rules, each with `match`')
    values['files'] = tuple(
        _rule(rule, folder, f'{where}: files: rule {i + 1}') for i, rule in enumerate(rules)
    )
    if 'names' in values:
        _check_names(values['names'], where)
    group = values.get('group', ())
    group = (group,) if isinstance(group, str) else group
    unknown = [key for key in group if key not in KEYS]
    if unknown:
        raise InputError(f'{where}: group by {", ".join(KEYS)}, not {unknown[0]!r}')
    values['group'] = tuple(group)
    choice(values, 'diagnose', get_args(Diagnose), where)
    number(values, 'false_alarms', where, 1e-9, 1.0 - 1e-9)
    number(values, 'seconds', where, 1.0, 1e7)
    number(values, 'memory_gb', where, 0.25, 1e4)
    for name in ('draws', 'reports'):
        if not isinstance(values.get(name, False), bool):
            raise InputError(f'{where}: {name} must be true or false, not {values[name]!r}')
    texts(values, ('names', 'table', 'holdout', 'partition'), where)
    values['calibrate'] = _options(values.get('calibrate', {}), where)
    if 'table' in values:
        values['table'] = str(folder / at_home(values['table']))
    if 'partition' in values:
        values['partition'] = _here(values['partition'], folder)
        read_partition(values['partition'])
    return Recipe(**values)


def _here(given: str, folder: Path) -> str:
    """Return a path that counts from a folder; a name that is no file there stays as it is."""
    here = folder / at_home(given)
    return str(here) if here.is_file() else given


def _rule(content: object, folder: Path, where: str) -> FileRule:
    values = mapping(content, FileRule, where)
    if not isinstance(values['match'], str):
        raise InputError(f'{where}: match must be a pattern as "*.csv", not {values["match"]!r}')
    channels = values.get('channels')
    if isinstance(channels, str):
        hint = 'a map is a page of text'
        path, channels = read_file(_here(channels, folder), 'channel map', hint, 'channels')
        parse_channel_map(channels, str(path))
    elif channels is not None:
        parse_channel_map(channels, where)
    values['channels'] = channels
    number(values, 'stiffness', where)
    if values.get('stiffness') is not None:
        values['stiffness'] = check_stiffness(values['stiffness'], where)
    number(values, 'resample', where, 0.1, 1e6)
    choice(values, 'hold', get_args(Hold), where)
    if not isinstance(values.get('split') or False, bool):
        raise InputError(f'{where}: split must be true or false, not {values["split"]!r}')
    return FileRule(**values)


def _check_names(pattern: object, where: str) -> None:
    try:
        named = set(re.compile(str(pattern)).groupindex)
    except re.error as error:
        raise InputError(
            f'{where}: names is no regular expression ({error}); as in '
            r"'(?P<actuator>\w+)_(?P<day>\d{4}-\d\d-\d\d)'"
        ) from error
    if not named or named - set(SAID):
        raise InputError(
            f'{where}: names needs named groups (?P<NAME>...) of {", ".join(SAID)}'
            + (f', not {", ".join(sorted(named - set(SAID)))}' if named else '')
        )


def _options(content: object, where: str) -> dict[str, Any]:
    """Return options of `calibrate` that JSON can hold, tried once.

    Raises:
        InputError: no such option, or a value that cannot be used.
    """
    if not isinstance(content, Mapping):
        raise InputError(f'{where}: calibrate must be options by name, not {content!r}')
    from actuator_glue.api.calibration import sampled_model
    from actuator_glue.api.calibration_options import CalibrationOptions

    known = [f.name for f in fields(CalibrationOptions) if f.name not in _OF_A_PRIOR]
    for name in content:
        if name not in known:
            raise InputError(
                f'{where}: calibrate has no option {name!r}; it has {", ".join(known)}'
            )
    options = {str(name): value for name, value in content.items()}
    bounds = options.get('bounds')
    if bounds is not None and not isinstance(bounds, Mapping):
        raise InputError(f'{where}: bounds must be [lower, upper] by parameter, not {bounds!r}')
    try:
        sampled_model(CalibrationOptions(**options))
    except TypeError as error:
        raise InputError(f'{where}: calibrate: {error}') from error
    return options
