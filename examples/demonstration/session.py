"""The demonstration from the first process to the last picture."""

from __future__ import annotations

import re
import shutil
import time
from pathlib import Path
from typing import Any

from rich.console import Console

from actuator_glue.api.diagnosis import diagnose as diagnose_records
from actuator_glue.errors import InputError
from actuator_glue.report import bag_content, estimate_figures
from examples.demonstration import pictures, pretests
from examples.demonstration.outcome import SessionOutcome, from_the_box, replay_bag
from examples.demonstration.processes import Node, Nodes
from examples.demonstration.progress import Display
from examples.demonstration.sources import Source
from examples.demonstration.watch import Watch

READY_SECONDS = 180.0  # the first start on a machine compiles the kernels
DRAIN_SECONDS = 15.0  # for the last window to be computed after the last sample
POLL_SECONDS = 0.25
# Of samples before the live diagnosis: so many tell the effect, and the drift is small in them.
DIAGNOSED_SECONDS = 16.0
STAGES = 8  # of a diagnosis, about
# What a run leaves in its folder; only these are removed by the next one.
LEAVINGS = ('bag', 'nodes', 'calibration.npz', 'summary.json', 'truth.json')


def prepare(folder: Path) -> None:
    """Make the folder and remove what an earlier run left in it.

    Raises:
        InputError: it cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in LEAVINGS:
            path = folder / name
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)
        for path in folder.glob('*.png'):
            path.unlink()
        (folder / 'nodes').mkdir()
    except OSError as error:
        raise InputError(f'{folder}: cannot be written ({error.strerror})') from error


def known(
    source: Source, calibration: Path | None, folder: Path, display: Display, seed: int
) -> Path | None:
    """Return the calibration that the estimator begins with; None where nothing is known.

    Raises:
        InputError: the records of the two short tests cannot be calibrated or saved.
    """
    if source.truth is None:
        return calibration
    stage = display.stage('two short tests, calibrated', total=1)
    path = pretests.calibrate(
        source.truth.start,
        float(source.parameters['specimen_stiffness']),
        float(source.parameters['rate']),
        seed,
        folder / 'calibration.npz',
        lambda share: display.advance(stage, share),
    )
    display.advance(stage, 1)
    return path


def stream(
    source: Source, settings: dict[str, Any], folder: Path, display: Display, *, diagnose: bool
) -> None:
    """Run the nodes as processes until the last window is in the bag.

    Args:
        source: publishes the samples.
        settings: parameters of the estimator.
        folder: gets the bag, parameter files and logs.
        display: shows the progress.
        diagnose: whether the diagnoser watches and swaps the model, live.

    Raises:
        InputError: a node dies or does not get ready.
    """
    logs = folder / 'nodes'
    watch = Watch(folder / 'bag')
    with Nodes() as nodes:
        nodes.start('recorder', {'bag': str((folder / 'bag').resolve())}, logs)
        nodes.start('estimator', settings, logs)
        if diagnose:
            asked = {'apply': True, 'seed': settings['seed'], 'minimum': DIAGNOSED_SECONDS}
            nodes.start('diagnoser', asked, logs)
        _wait_until_ready(nodes, watch, display)
        listeners = {'wait_for': 3 if diagnose else 2}
        sender = nodes.start(source.node, source.parameters | listeners, logs)
        _wait_until_sent(nodes, sender, source, watch, display)
        _wait_until_drained(nodes, watch)


def _wait_until_ready(nodes: Nodes, watch: Watch, display: Display) -> None:
    stage = display.stage('starting (the first time: compiling)', total=READY_SECONDS)
    start = time.monotonic()
    while not watch.ready:
        elapsed = time.monotonic() - start
        if elapsed > READY_SECONDS:
            raise InputError(f'the estimator is not ready after {READY_SECONDS:g} s; see its log')
        nodes.check()
        watch.update()
        display.advance(stage, elapsed)
        time.sleep(POLL_SECONDS)
    display.advance(stage, READY_SECONDS)


def _wait_until_sent(
    nodes: Nodes, sender: Node, source: Source, watch: Watch, display: Display
) -> None:
    stage = display.stage(source.title, total=source.samples)
    start = time.monotonic()
    while sender.running:
        nodes.check()
        watch.update()
        display.advance(stage, watch.samples)
        display.show(watch, time.monotonic() - start)
        time.sleep(POLL_SECONDS)
    nodes.check()
    display.advance(stage, source.samples)


def _wait_until_drained(nodes: Nodes, watch: Watch) -> None:
    """Wait until the estimator has reported once more and no window is being computed."""
    end = time.monotonic() + DRAIN_SECONDS
    seen, since = -1, time.monotonic()
    while time.monotonic() < end:
        nodes.check()
        watch.update()
        if watch.windows != seen:
            seen, since = watch.windows, time.monotonic()
        # Two reports of /diagnostics without another window: it is done.
        elif time.monotonic() - since > 2.5:
            return
        time.sleep(POLL_SECONDS)


def finish(
    source: Source, folder: Path, display: Display, seed: int, *, diagnose: bool
) -> SessionOutcome:
    """Read the bag, replay it, draw the pictures, diagnose what was recorded.

    Args:
        source: what was streamed.
        folder: holds the bag and gets the pictures.
        display: shows the progress.
        seed: seed of the diagnosis.
        diagnose: whether to.

    Raises:
        InputError: the bag is damaged or holds no window.
    """
    stage = display.stage('replaying the bag', total=1)
    content = bag_content.read(folder / 'bag')
    comparison = replay_bag(folder / 'bag')
    display.advance(stage, 1)
    stage = display.stage('drawing', total=4)
    estimate_figures.bands(content, folder / 'bands.png')
    display.advance(stage, 1)
    truth = None if source.truth is None else source.truth.over(content.posteriors)
    estimate_figures.parameters(content, folder / 'parameters.png', truth)
    display.advance(stage, 2)
    pictures.live(content, folder / 'live.png')
    pictures.explanations(content, folder / 'explanations.png', source.hidden)
    display.advance(stage, 3)
    if (folder / 'calibration.npz').exists():
        pictures.carried(content, from_the_box(content), folder / 'prior.png', truth)
    display.advance(stage, 4)
    outcome = SessionOutcome(source.title, _sent(source, folder), content, comparison, truth)
    if diagnose:
        outcome.hidden = source.hidden if source.promises else ()
        _diagnose(outcome, folder, display, seed)
    return outcome


def _diagnose(outcome: SessionOutcome, folder: Path, display: Display, seed: int) -> None:
    stage = display.stage('diagnosing', total=STAGES)
    seen: list[str] = []

    def tell(name: str, share: float) -> None:
        if name not in seen:
            seen.append(name)
        # The number of stages depends on what is found; the bar never runs full before the end.
        display.advance(stage, min(len(seen) - 1 + share, STAGES - 0.1))

    known = folder / 'calibration.npz'
    outcome.diagnosis = diagnose_records(
        [outcome.content.record],
        seed=seed,
        prior=known if known.exists() else None,
        progress=tell,
    )
    pictures.residual(outcome.diagnosis, folder / 'diagnosis.png')
    display.advance(stage, STAGES)


def _sent(source: Source, folder: Path) -> int:
    """Return how many samples the source says it has published, in the last line of its log."""
    log = (folder / 'nodes' / f'{source.node}.log').read_text(encoding='utf-8', errors='replace')
    found = re.findall(r'stream ended after (\d+) samples', log)
    return int(found[-1]) if found else 0


def terminal() -> Console:
    """Return where progress and results are shown."""
    console = Console(highlight=False)
    # A pipe has no width of its own: do not fold tables there.
    return console if console.is_terminal else Console(highlight=False, width=120)
