"""A few blind machines, always the same: no score falls below the band of the published one."""

import re
import sys
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from scipy.stats import binom

ROOT = Path(__file__).parents[2]
BLIND = ROOT / 'benchmarks' / 'blind'
# Nine machines before the first of these tests.
pytestmark = pytest.mark.timeout(1200)
# From the seeds for calibration: of every generator a healthy machine, and one with a clear effect
# (of `far` two), those that are quickly diagnosed.
MACHINES = (
    ('mixed', 917),  # valve-deadband
    ('far', 907),  # valve-deadband
    ('cases', 915),  # gain
    ('far', 914),  # bias
    ('variant', 915),  # specimen-gap
    ('far', 912),
    ('variant', 901),
    ('mixed', 901),
    ('cases', 923),
)
_CHANCE = 0.05


@pytest.fixture(scope='module')
def score() -> Any:
    """Return the script that scores, which imports its neighbours."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BLIND))
        yield import_module('score')


def diagnosed(generator: str, seed: int, folder: Path) -> dict[str, Any]:
    """Diagnose a machine as a campaign does, in a process of its own."""
    sys.path.insert(0, str(BLIND))
    found: dict[str, Any] = import_module('campaign').one(seed, folder / generator, generator, {})
    return found


@pytest.fixture(scope='module')
def answers(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """Diagnose the machines, two at a time: they are the longest of all tests."""
    folder = tmp_path_factory.mktemp('machines')
    with ProcessPoolExecutor(2, get_context('spawn')) as pool:
        return list(pool.map(diagnosed, *zip(*MACHINES, strict=True), [folder] * len(MACHINES)))


def band(text: str, count: int) -> tuple[int, int]:
    """Return how many of `count` are yes, by the published scores and but for chance.

    Args:
        text: the question.
        count: machines that it is asked of.
    """
    row = next(r for r in (ROOT / 'docs' / 'scores.md').read_text().splitlines() if text in r)
    low, high = re.findall(r'\d+ of \d+ \((\d+) to (\d+) %\)', row)[0]
    ends = (_CHANCE, float(low)), (1.0 - _CHANCE, float(high))
    least, most = (int(binom.ppf(chance, count, limit / 100.0)) for chance, limit in ends)
    return least, most


@pytest.mark.parametrize(
    'key', ['false_alarms', 'clear_exact', 'clear_in_set', 'clear_wrong_confident']
)
def test_no_score_falls_below_its_band(
    key: str, score: ModuleType, answers: list[dict[str, Any]]
) -> None:
    question = score.QUESTIONS[key]
    asked = [r for r in answers if question.of(r)]
    assert len(asked) >= 3
    yes = sum(map(question.yes, asked))
    told = [(r['generator'], r['seed'], r['effects'], r['diagnosis']['summary']) for r in asked]
    least, most = band(question.text, len(asked))
    assert yes >= least if question.wanted else yes <= most, told


def test_what_is_named_is_removed(answers: list[dict[str, Any]]) -> None:
    """The held-out error of every machine is that of the true structure, to within a fifth."""
    for answer in answers:
        aim = max(answer['true_structure_error'], answer['clean_floor'])
        assert answer['diagnosis']['error']['after'] < 1.2 * aim, (
            answer['generator'],
            answer['seed'],
        )
