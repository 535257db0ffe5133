"""Screenshots of a report and of the live page: phone, tablet and desk (`make screenshots`).

With --rev the same of another commit beside them, and one picture of both: before_after.png. The
report is that of a diagnosis of two simulated tests with play, the same files for both commits;
the page shows a bag that each commit carries, and a stream as its own tests make it, so that it
shows whatever it can. Needs Chromium.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw, ImageFont

HERE = Path(__file__).resolve().parent.parent
SCREENS = {390: 844, 768: 1024, 1440: 900}  # width: height [px]
LONGEST = 12  # screens of one picture
HIGH, GAP, TITLE = 440, 14, 28  # of the picture of both [px]


def commit(tree: Path) -> str:
    """Return the commit of a working tree, with a mark where it has changes."""
    said = ['git', '-C', str(tree), 'describe', '--always', '--exclude=*', '--abbrev=7', '--dirty']
    return subprocess.run(said, check=True, capture_output=True, text=True).stdout.strip()


def report(tree: Path, folder: Path) -> Path:
    """Return the report that a commit writes of two tests with play; the tests are made once."""
    page = folder / f'report_{tree.name}.html'
    ours = [sys.executable, '-m', 'actuator_glue.cli.main']
    where: dict[str, Any] = {'cwd': folder, 'stdout': subprocess.DEVNULL}
    tests = {'free.csv': '0', 'clamped.csv': '250e3'}
    for seed, (name, stiffness) in enumerate(tests.items(), start=1):
        if not (folder / name).exists():
            asked = f'simulate {name} --duration 20 --rate 500 --effect backlash --seed {seed}'
            asked += f' --stiffness {stiffness}'
            environment = os.environ | {'PYTHONPATH': str(HERE)}
            subprocess.run([*ours, *asked.split()], check=True, env=environment, **where)
    asked = ['diagnose', *tests, '--report', page.name]
    environment = os.environ | {'PYTHONPATH': str(tree)}
    subprocess.run([*ours, *asked], check=True, env=environment, **where)
    return page


async def photograph(address: str, file: Path, ready: str) -> None:
    """Write what is seen of a page from its first line to its last, at every width."""
    from browser import Browser

    for width, height in SCREENS.items():
        async with Browser() as browser:
            await browser.screen(width, height, mobile=width < 1000)
            await browser.open(address)
            await browser.until(ready)
            await asyncio.sleep(1.0)
            size = 'document.documentElement.scroll'
            wide = await browser.value(size + 'Width')
            high = await browser.value(size + 'Height')
            picture = await browser.picture(min(high, LONGEST * height))
            picture.save(file.with_name(f'{file.name}_{width}.png'))
            cut = f', {wide} px wide' if wide > width else ''
            print(f'{file.name} at {width} px: {high} px long{cut}', flush=True)


def of_tree(tree: Path, out: Path, tests: Path) -> None:
    """Write all screenshots of the commit in a folder, whose code is the one imported here."""
    page = report(tree, tests)
    asyncio.run(photograph(page.as_uri(), out / 'report', 'document.readyState === "complete"'))
    sys.path.insert(0, str(tree / 'test' / 'view'))
    from stream import intake  # as the tests of that commit feed it

    from actuator_glue.view.intake import read_bag
    from actuator_glue.view.server import PageServer

    for name, made in (('live', intake(80.0)), ('bag', read_bag(tree / 'bags' / 'session'))):
        server = PageServer(made, 0)
        shown = 'document.body.dataset.frames > 0'
        try:
            asyncio.run(photograph(server.url, out / name, shown))
        finally:
            server.close()


def both(folders: dict[str, Path], file: Path) -> None:
    """Write one picture: of each commit the first screen of report and page, phone and desk."""
    font = ImageFont.load_default(18)
    rows = []
    for title, folder in folders.items():
        shown = []
        for name in ('report', 'live'):
            for width in (390, 1440):
                picture = Image.open(folder / f'{name}_{width}.png').convert('RGB')
                picture = picture.crop((0, 0, width, SCREENS[width]))
                scaled = round(width * HIGH / SCREENS[width])
                shown.append(picture.resize((scaled, HIGH), Image.Resampling.LANCZOS))
        row = Image.new('RGB', (sum(p.width + GAP for p in shown) - GAP, TITLE + HIGH), 'white')
        ImageDraw.Draw(row).text((0, 2), title, 'black', font)
        at = 0
        for picture in shown:
            row.paste(picture, (at, TITLE))
            frame = (at, TITLE, at + picture.width - 1, TITLE + HIGH - 1)
            ImageDraw.Draw(row).rectangle(frame, outline='#999999')
            at += picture.width + GAP
        rows.append(row)
    whole = Image.new('RGB', (rows[0].width, sum(r.height + GAP for r in rows) - GAP), 'white')
    for i, row in enumerate(rows):
        whole.paste(row, (0, i * (row.height + GAP)))
    whole.quantize(128, Image.Quantize.MAXCOVERAGE).save(file, optimize=True)


def run(tree: Path, out: Path, tests: Path) -> Path:
    """Have a process of its own photograph a commit, with the code of that commit."""
    folder = out / commit(tree)
    folder.mkdir(parents=True, exist_ok=True)
    paths = os.pathsep.join((str(tree), str(HERE / 'test' / 'view')))
    asked = [__file__, '--tree', str(tree), '--tests', str(tests), '--out', str(folder)]
    environment = os.environ | {'PYTHONPATH': paths}
    subprocess.run([sys.executable, *asked], check=True, env=environment)
    return folder


def main() -> None:
    """Photograph this checkout and, where asked for, another commit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--out', type=Path, default=HERE / 'out' / 'screenshots')
    parser.add_argument('--rev', help='another commit, photographed first')
    parser.add_argument('--tree', type=Path, help=argparse.SUPPRESS)
    parser.add_argument('--tests', type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.tree:
        of_tree(args.tree, args.out, args.tests)
        return
    with tempfile.TemporaryDirectory() as folder:
        tests, tree = Path(folder, 'tests'), Path(folder, 'tree')
        tests.mkdir()
        shown = {}
        if args.rev:
            git = ['git', '-C', str(HERE), 'worktree']
            subprocess.run([*git, 'add', '--quiet', '--detach', str(tree), args.rev], check=True)
            try:
                before = run(tree, args.out, tests)
            finally:
                subprocess.run([*git, 'remove', '--force', str(tree)], check=True)
            shown[f'before: {before.name}'] = before
        after = run(HERE, args.out, tests)
        if shown:
            shown[f'after: {after.name}'] = after
            both(shown, args.out / 'before_after.png')
    print(args.out)


if __name__ == '__main__':
    main()
