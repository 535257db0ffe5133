"""Run the blocks of docs/tutorial.md in an empty folder, as a reader would type them.

Each command prints what it prints, and how long it took. The first one that ends with another exit
code than 0, or than `<!-- exit code N -->` above its block says, ends the run. With --write the
page gets below every block what it printed.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PAGE = Path(__file__).resolve().parent.parent / 'docs' / 'tutorial.md'
BLOCK = re.compile(
    r'(?P<above>^<!-- exit code (?P<code>\d+) -->\n\n)?'
    r'^```sh\n(?P<lines>.*?)^```\n(?:\n```\n.*?^```\n)?',
    re.MULTILINE | re.DOTALL,
)


def commands(block: str) -> list[str]:
    """Return the lines of a block that are to be run."""
    return [line for line in block.replace('\\\n', ' ').splitlines() if line.strip()]


def run(line: str, folder: Path, expected: int) -> str:
    """Run a line in a folder and return what it printed.

    Raises:
        SystemExit: it ended with another exit code.
    """
    begin = time.monotonic()
    print(f'$ {line}', flush=True)
    done = subprocess.run(
        line,
        shell=True,
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    print(f'{done.stdout}[{time.monotonic() - begin:.0f} s]', flush=True)
    if done.returncode != expected:
        raise SystemExit(f'{line}: exit code {done.returncode}, not {expected}')
    return '\n'.join(text.rstrip() for text in done.stdout.strip().splitlines())


def main() -> int:
    """Run every block in its order."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--page', type=Path, default=PAGE, help='the page (default the tutorial)')
    parser.add_argument('--write', action='store_true', help='write below each block what it says')
    args = parser.parse_args()
    text = args.page.read_text(encoding='utf-8')
    with tempfile.TemporaryDirectory() as folder:

        def printed(found: re.Match[str]) -> str:
            lines, code = found['lines'], int(found['code'] or 0)
            said = '\n'.join(filter(None, (run(c, Path(folder), code) for c in commands(lines))))
            return f'{found["above"] or ""}```sh\n{lines}```\n\n```\n{said}\n```\n'

        renewed = BLOCK.sub(printed, text)
    if args.write:
        args.page.write_text(renewed, encoding='utf-8')
    return 0


if __name__ == '__main__':
    sys.exit(main())
