"""The report: prose from templates, with tables and figures where it calls for them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from actuator_glue.report import html
from studies.chen import (
    findings,
    identify,
    library,
    published,
    responses,
    shaping,
    table_spread,
    words,
)
from studies.chen.experiment import stiffness_name
from studies.chen.figures import FIGURES
from studies.chen.study import NOISE_FREE, NOISY, Results
from studies.chen.tables import TABLES

TITLE = 'Uncertainty of servo-hydraulic dynamics: the paper beside our numbers'
TEMPLATES = Path(__file__).with_name('templates')
CALL = re.compile(r'(?P<figure>!?)\[(?P<caption>.*)\]\((?P<name>\w+)\)', re.DOTALL)


def prose(results: Results) -> str:
    """Return the report's text: Markdown with `![caption](figure)` and `[caption](table)`.

    A template names numbers by `results` and judgements by `findings`; what neither has is an
    error, so that nothing is left out in silence.
    """
    environment = Environment(loader=FileSystemLoader(TEMPLATES), undefined=StrictUndefined)
    environment.filters |= {
        'num': words.num,
        'percent': words.percent,
        'power': words.power_of_two,
        'listed': words.listed,
        'reached': findings.reached,
        'stiffness': stiffness_name,
        'um': lambda rms, digits=3: words.num(rms, digits, 1e6) + ' µm',
        'mm': lambda rms: f'{1e3 * rms:.2f} mm',
        'signed': lambda share, digits=0: words.percent(float(share), digits, sign=True),
    }
    names: dict[str, Any] = {
        m.__name__.rpartition('.')[2]: m
        for m in (findings, identify, library, published, responses, shaping, table_spread)
    }
    names |= {
        'KINDS': words.KINDS,
        'NOISE_FREE': NOISE_FREE,
        'NOISY': NOISY,
        'SYMBOLS': words.SYMBOLS,
    }
    return environment.get_template('report.md.j2').render(
        results=results, np=np, zip=zip, abs=abs, **names
    )


def sections(results: Results) -> tuple[str, list[html.Section]]:
    """Return the lead and the sections of the report with their figures rendered."""
    lead, *parts = re.split(r'^# ', prose(results), flags=re.MULTILINE)
    found = []
    for part in parts:
        title, _, body = part.partition('\n')
        blocks = [block(b, results) for b in re.split(r'\n\s*\n', body.strip())]
        found.append(html.Section(title.strip(), blocks))
    return _joined(lead), found


def block(text: str, results: Results) -> html.Block:
    """Return one block of the report from a paragraph of the text."""
    if text.startswith('|'):
        *rows, caption = (line.strip() for line in text.splitlines() if line.strip())
        header, *cells = ([c.strip() for c in row.strip('|').split('|')] for row in rows)
        return html.Table(header, cells, caption, prose=True)
    call = CALL.fullmatch(text.strip())
    if call is None:
        return html.Note(_joined(text[1:])) if text.startswith('>') else html.Text(_joined(text))
    caption = _joined(call['caption'])
    if call['figure']:
        return html.Picture.of(FIGURES[call['name']](results), caption)
    return TABLES[call['name']](results).page(caption)


def _joined(text: str) -> str:
    # Not split(): that would take the narrow spaces between number and unit for line breaks.
    return re.sub(r'[ \n]+', ' ', text).strip(' \n')


def write(results: Results, path: Path, *, made: str = '') -> Path:
    """Write the report as one HTML file and return its path.

    Args:
        results: from `study.study`.
        path: file to write.
        made: how it was made (the command).
    """
    lead, found = sections(results)
    return html.write(path, html.Page(TITLE, lead, found, made))
