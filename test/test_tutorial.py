"""The tutorial is run as it stands, and what is shown below its blocks is what they printed."""

import importlib.util
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SCRIPT = importlib.util.spec_from_file_location(
    'run_tutorial', ROOT / 'scripts' / 'run_tutorial.py'
)
assert SCRIPT is not None and SCRIPT.loader is not None
run_tutorial = importlib.util.module_from_spec(SCRIPT)
SCRIPT.loader.exec_module(run_tutorial)

PAGE = """# A page

```sh
echo one
echo two
```

between

<!-- exit code 1 -->

```sh
false
```

```
what it printed last year
```
"""


def test_what_blocks_print_is_written_below_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In their order, once, however often; another exit code than the page says ends the run."""
    page = tmp_path / 'page.md'
    page.write_text(PAGE)
    monkeypatch.setattr(sys, 'argv', ['run_tutorial', '--page', str(page), '--write'])
    for _ in range(2):
        assert run_tutorial.main() == 0
        text = page.read_text()
        assert text.count('```sh') == 2
        assert '```\n\n```\none\ntwo\n```\n\nbetween' in text
        assert 'last year' not in text
        assert text.count('<!-- exit code 1 -->') == 1
    assert '$ echo two' in capsys.readouterr().out
    for block, said in (
        ('```sh\nexit 3\n```\n', 'exit 3: exit code 3, not 0'),
        ('<!-- exit code 1 -->\n\n```sh\ntrue\n```\n', 'true: exit code 0, not 1'),
    ):
        page.write_text(block)
        with pytest.raises(SystemExit, match=said):
            run_tutorial.main()
        assert page.read_text() == block


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_the_tutorial_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every block, in an empty folder; it finds what it hid."""
    folder = str(Path(sys.executable).parent)
    monkeypatch.setenv('PATH', folder, prepend=':')
    monkeypatch.setattr(sys, 'argv', ['run_tutorial'])
    assert run_tutorial.main() == 0
    said = capsys.readouterr().out
    assert 'missing: backlash' in said
    assert said.count('$ actuator-glue calibrate') == 2
