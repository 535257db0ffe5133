"""Fixtures of every test."""

import gc
import os
import subprocess
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

# As nodes and the command line have it: results are compared bit by bit.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

import numpy as np
from hypothesis import HealthCheck, settings

# How long an example takes says how busy a computer is, and which kernels it compiles. The same
# examples every time: `--hypothesis-profile default` looks for new ones.
settings.register_profile(
    'same',
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile('same')


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What is imported and collected stays to the end: no garbage is looked for among it."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


# A folder to write to, then a command: everything else is read-only, and nobody has a home.
READ_ONLY = r"""
out=$1; shift
mount --bind "$out" "$out" || exit 77
for point in $(cut -d' ' -f2 /proc/self/mounts | sort -u); do
    case $point in
        /proc* | /sys* | /dev* | "$out") ;;
        *) mount -o remount,bind,ro "$point" 2>/dev/null ;;
    esac
done
cd "$out"
touch "$(dirname "$out")/trial" 2>/dev/null && exit 77
unset HOME XDG_CACHE_HOME XDG_CONFIG_HOME MPLCONFIGDIR ROS_HOME ROS_LOG_DIR NUMBA_CACHE_DIR TMPDIR
test -z "$HOME_THERE" || export HOME="$HOME_THERE"
exec "$@"
"""


@pytest.fixture
def read_only(tmp_path: Path) -> Callable[..., list[str]]:
    """Return a function: the command line that runs a command where one folder can be written.

    As in a container with a read-only root, or a unit of systemd with ProtectSystem=strict.
    """
    (tmp_path / 'out').mkdir()
    (tmp_path / 'read_only.sh').write_text(READ_ONLY)

    def command(*args: object) -> list[str]:
        script = [tmp_path / 'read_only.sh', tmp_path / 'out', *args]
        return ['unshare', '--map-root-user', '--mount', 'sh', *map(str, script)]

    try:
        done = subprocess.run(command('true'), capture_output=True, text=True, check=False)
    except OSError as error:
        pytest.skip(f'no mount namespaces here ({error})')
    if done.returncode:
        pytest.skip(f'no mount namespaces here ({done.stderr.strip()})')
    return command


@pytest.fixture
def rng_seed(request: pytest.FixtureRequest) -> int:
    """A seed that differs between runs; ACTUATOR_GLUE_TEST_SEED=N repeats a failed run.

    Tests that use it state how often they fail by chance, where they can.
    """
    given = os.environ.get('ACTUATOR_GLUE_TEST_SEED')
    seed = int(given) if given else int(np.random.SeedSequence().generate_state(1)[0])
    print(f'ACTUATOR_GLUE_TEST_SEED={seed}  # repeats {request.node.nodeid}')
    return seed


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of reports are made and not drawn, which takes most of a report's time.

    For tests that read what a report says; that it can be drawn, test/report and test/view ask.
    """
    monkeypatch.setattr('actuator_glue.report.style.png', lambda figure: b'a picture')


@pytest.fixture
def overlapping_texts() -> Callable[..., list[tuple[str, str]]]:
    """Return a function: pairs of texts printed over each other, and texts cut off."""
    import matplotlib as mpl
    from matplotlib.text import Text

    from actuator_glue.report import style

    def unseen(axis) -> set[int]:
        # Tick labels outside the view exist but are not drawn.
        low, high = sorted(axis.get_view_interval())
        ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
        slack = 1e-9 * (high - low)
        outside = [t for t in ticks if not low - slack <= t.get_loc() <= high + slack]
        return {id(label) for t in outside for label in (t.label1, t.label2)}

    def overlapping(figure) -> list[tuple[str, str]]:
        with mpl.style.context(str(style.STYLE_FILE)):
            figure.draw_without_rendering()
            hidden = {
                i
                for axes in figure.axes
                for axis in (axes.xaxis, axes.yaxis)
                for i in unseen(axis)
            }
            boxes = [
                (t.get_text(), t.get_window_extent())
                for t in figure.findobj(Text)
                if t.get_visible() and t.get_text().strip() and id(t) not in hidden
            ]
        # A text box has slack around its letters; a tenth of its height is no collision.
        boxes = [(s, b.padded(-0.1 * b.height)) for s, b in boxes]
        page = figure.bbox
        cut = [
            (s, 'beyond the page')
            for s, b in boxes
            if b.x0 < page.x0 or b.x1 > page.x1 or b.y0 < page.y0 or b.y1 > page.y1
        ]
        return cut + [
            (one, other)
            for i, (one, a) in enumerate(boxes)
            for other, b in boxes[i + 1 :]
            if a.overlaps(b)
        ]

    return overlapping


@pytest.fixture
def least_p() -> Callable[..., float]:
    """Return a function: the least p-value of ranks that ought to be uniform, of all parameters.

    Two tests each, chi-square of the counts and Kolmogorov-Smirnov (Talts et al. 2018), printed.
    """
    from scipy.stats import chisquare, kstest

    def judge(name: str, ranks: np.ndarray, draws: int, bins: int, seed: int) -> float:
        rng, least = np.random.default_rng(seed), 1.0
        for column in ranks.T:
            counts = np.bincount(column * bins // (draws + 1), minlength=bins)
            smooth = (column + rng.random(len(column))) / (draws + 1)
            p = float(chisquare(counts).pvalue), float(kstest(smooth, 'uniform').pvalue)
            print(f'{name}: chi-square p {p[0]:.3f}, ECDF p {p[1]:.3f}, counts {counts.tolist()}')
            least = min(least, *p)
        return least

    return judge
