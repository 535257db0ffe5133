"""Reports on a phone: nothing of them is wider than it, and no number is broken."""

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from browser import PROGRAM, Browser

import actuator_glue as ag

WIDTH = 390
# First picture; page; boxes whose tables scroll; numbers of tables that stand on more than a line.
MEASURE = """(() => {
  const lines = (cell) => {
    const all = document.createRange();
    all.selectNodeContents(cell);
    return new Set([...all.getClientRects()].map((r) => Math.round(r.top))).size;
  };
  const number = (cell) => /^-?[0-9.e+-]+$/.test(cell.textContent.trim());
  const shown = [...document.querySelectorAll('figure img')]
    .filter((picture) => picture.getBoundingClientRect().width > 0);
  return {
    first: shown[0].className,
    fits: Math.max(...shown.map((picture) => picture.getBoundingClientRect().right)),
    small: shown.filter((picture) => picture.className != 'narrow').map((picture) => picture.alt),
    page: document.documentElement.scrollWidth,
    boxes: [...document.querySelectorAll('.scroll')]
      .filter((box) => box.scrollWidth > box.clientWidth).map((box) => box.textContent),
    tables: document.querySelectorAll('.scroll').length,
    broken: [...document.querySelectorAll('td')]
      .filter((cell) => number(cell) && lines(cell) > 1).map((cell) => cell.textContent),
  };
})()"""


def made(k: float, *effects: str) -> ag.Record:
    """Return a test whose name is as long as those of a laboratory."""
    command = ag.Command(rate=200.0, duration=10.0)
    record = ag.simulate(command, stiffness=k, effects=effects, seed=3)
    return replace(record, source=f'2026-03-01_actuator_north_k_{k:.0f}_monday_morning.csv')


async def measured(page: Path) -> dict[str, Any]:
    """Return what a browser makes of a page on a phone."""
    async with Browser() as browser:
        await browser.screen(WIDTH, 844, mobile=True)
        await browser.open(page.as_uri())
        await browser.until('document.readyState === "complete"')
        found: dict[str, Any] = await browser.value(MEASURE)
        return found


@pytest.mark.skipif(PROGRAM is None, reason='no Chromium on this computer')
@pytest.mark.parametrize(
    'which', ['calibration', pytest.param('diagnosis', marks=pytest.mark.slow)]
)
def test_a_report_fits_a_phone(which: str, tmp_path: Path) -> None:
    """Rows of many columns are stacked; what is left scrolls nowhere."""
    if which == 'calibration':
        result: Any = ag.calibrate(made(250e3), evaluations=12_000)
    else:
        result = ag.diagnose([made(0.0, 'delay'), made(250e3, 'delay')], effort=0.05, jobs=1)
    found = asyncio.run(measured(result.report(tmp_path / 'report.html')))
    assert found['tables'] >= 4
    assert found['page'] <= WIDTH
    # Pictures are made for it, but for one of every pair of parameters.
    assert found['fits'] <= WIDTH
    assert found['first'] == 'narrow'
    pairs = 'Distribution of each parameter, and of each pair.'
    assert found['small'] == ([pairs] if which == 'calibration' else [])
    assert found['boxes'] == []
    assert found['broken'] == []
