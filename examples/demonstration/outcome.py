"""What a run came to: numbers for `summary.json` and the table that people see."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from actuator_glue.diagnosis.telling.result import DiagnosisData
from actuator_glue.inference.choice import choose_model
from actuator_glue.io.bag_reader import decoded
from actuator_glue.model.parameters import NAMES
from actuator_glue.online import conversion
from actuator_glue.online.job import WindowResult
from actuator_glue.online.playback import items, replay, stream
from actuator_glue.online.replay_comparison import ReplayComparison, compare, published
from actuator_glue.online.runs import shares
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import structure_name
from actuator_glue.records import Array
from actuator_glue.report.bag_content import Content
from actuator_glue.workers.reports import Reports

SCHEMA = 'examples.demonstration/1'
BANDS = {
    'total': 'total (parameters and residual)',
    'parameter': 'parameters only (GLUE)',
    'noise': 'parameters and sensor noise',
}
LOOK: dict[str, Any] = {
    'box': box.SIMPLE_HEAD,
    'title_justify': 'left',
    'caption_justify': 'left',
    'pad_edge': False,
}
# Share of windows in which a parameter has to be inside its 95 % interval.
PROMISED = 0.9
# Of all windows, at least: on two cores a diagnosis and what was added take time from others.
ANSWERED = 0.5
INPUTS = ('SampleBlock', 'TestSetup')
RESULTS = ('EstimatorSetup', 'PosteriorMoments', 'PredictionBand')


def replay_bag(bag: Path) -> ReplayComparison:
    """Run a bag through the estimator and hold every number against the published one.

    Raises:
        InputError: the bag is damaged.
    """
    runs = published(decoded(bag, RESULTS, counted=('SampleBlock',)))
    if not all(run.repeatable for run in runs):
        return ReplayComparison(differing=['no estimator published its settings into this bag'])
    comparison = ReplayComparison()
    with Reports() as reports:
        for live, share in shares(items(decoded(bag, INPUTS)), runs):
            assert live.settings is not None
            model, schedule = live.models[0][1], live.schedule()
            results = replay(share, live.settings, model, schedule, reports, live.carried)
            found = compare((r for r in results if isinstance(r, WindowResult)), live)
            comparison.add(found)
    return comparison


def from_the_box(content: Content) -> list[WindowResult]:
    """Estimate some windows of a recording as if nothing were known before them.

    With the model of the last window, ten or so of them.
    """
    last = content.posteriors[-1]
    length = int(last.samples) * float(last.period)
    record = content.record
    hop = max(1.0, (len(record) * record.period - length) / 10.0)
    settings = EstimatorSettings(
        window=max(length, hop), hop=hop, settle=min(0.5, 0.1 * length), time_budget=min(0.5, hop)
    )
    found = replay(stream(record), settings, choose_model(list(last.effects)))
    return [r for r in found if isinstance(r, WindowResult)]


@dataclass(slots=True)
class SessionOutcome:
    """A finished run.

    Attributes:
        source: what was streamed, for people.
        sent: samples published by the source.
        content: the bag.
        comparison: the replay held against the live run.
        truth: true parameters of Eq. (2) in each window where they are known, shape (windows, 4).
        diagnosis: what the model lacks, None where nobody asked.
        hidden: effects that the live chain had to find; empty where nothing is promised.
        seconds: time from the first process to the last picture [s].
    """

    source: str
    sent: int
    content: Content
    comparison: ReplayComparison
    truth: Array | None = None
    diagnosis: DiagnosisData | None = None
    hidden: tuple[str, ...] = ()
    seconds: float = float('nan')

    def count(self, key: str) -> int:
        """Return one of the estimator's counters on /diagnostics."""
        return int(self.content.health.get('estimator', {}).get(key, '0'))

    def moments(self) -> dict[str, dict[str, float | bool]]:
        """Return the moments of the last window by parameter."""
        if not self.content.posteriors:
            return {}
        last = self.content.posteriors[-1]
        return {
            name: {
                'mean': float(last.mean[i]),
                'stddev': float(last.stddev[i]),
                'skewness': float(last.skewness[i]),
                'cov': float(last.cov[i]),
                'rhat': float(last.rhat[i]),
                'ess': float(last.ess[i]),
                'prior_dominated': bool(last.prior_dominated[i]),
            }
            for i, name in enumerate(last.parameter_names)
        }

    @property
    def answered(self) -> float:
        """Share of the windows that have a posterior; others came too late or had no time."""
        none = sum(map(self.count, ('windows dropped', 'windows failed')))
        return len(self.content.posteriors) / max(1, len(self.content.posteriors) + none)

    def truth_inside(self) -> dict[str, float] | None:
        """Return in which share of windows the truth is within 1.96 sd.

        Of all windows from the first addition on; where nothing was added, of all.
        """
        posteriors = self.content.posteriors
        if self.truth is None or not posteriors:
            return None
        first = next((i for i, p in enumerate(posteriors) if list(p.effects)), 0)
        mean, sd = (np.array([getattr(p, c)[:4] for p in posteriors]) for c in ('mean', 'stddev'))
        inside = np.abs(mean - self.truth) <= 1.96 * sd
        return dict(zip(NAMES, inside[first:].mean(axis=0).tolist(), strict=True))

    def broken_promises(self) -> list[str]:
        """Return what the live chain should have shown and did not; nothing is a good run.

        At the end what is hidden has the largest weight, each parameter is inside its 95 %
        interval in nine of ten windows after the first addition, and most windows are answered.
        """
        posteriors, inside = self.content.posteriors, self.truth_inside()
        if not self.hidden or not posteriors or inside is None:
            return []
        found = [
            f'{name} was inside its 95 % interval in {share:.0%} of the windows after the first '
            f'addition, not in {PROMISED:.0%}'
            for name, share in inside.items()
            if share < PROMISED
        ]
        if self.answered < ANSWERED:
            found.append(
                f'{self.answered:.0%} of the windows have a posterior, not {ANSWERED:.0%}'
            )
        last = list(posteriors[-1].effects)
        if set(last) != set(self.hidden):
            found.append(
                f'at the end {structure_name(last)} had the largest weight, not '
                f'{structure_name(self.hidden)}'
            )
        return found

    def drift(self) -> dict[str, dict[str, float]] | None:
        """Return how parameters that drift were followed, from the last model's first window on.

        Of each: change of its true value from that window to the last, and of the posterior mean,
        with the standard deviation of the last.
        """
        posteriors = self.content.posteriors
        if self.truth is None or not posteriors:
            return None
        # While others that are on their way out have a share in it, a mean says nothing of drift.
        carried = [[name for name, _ in conversion.weights(p)] for p in posteriors]
        first = next(i for i, names in enumerate(carried) if names == carried[-1])
        start, end = posteriors[first], posteriors[-1]
        true = self.truth[-1] - self.truth[first]
        return {
            name: {
                'true': float(true[j]),
                'followed': float(end.mean[j] - start.mean[j]),
                'stddev': float(end.stddev[j]),
            }
            for j, name in enumerate(NAMES)
            if true[j] != 0.0
        }

    def explanations(self) -> list[tuple[float, str]]:
        """Return by what the windows were explained, and from when on [s]; told on each change."""
        found: list[tuple[float, str]] = []
        before: list[str] | None = None
        for p in self.content.posteriors:
            weights = conversion.weights(p)
            names = [structure_name(sorted(name)) for name, _ in weights]
            if names != before:
                end = (int(p.index) + int(p.samples) - self.content.record.first_index) * p.period
                found.append((float(end), conversion.weighed(weights)))
            before = names
        return found

    @property
    def lossless(self) -> bool:
        """Every sample sent arrived at the estimator and is in the bag."""
        return self.sent == self.count('samples') == self.content.samples

    def to_json(self) -> dict[str, Any]:
        """Return the object of `summary.json`."""
        posteriors = self.content.posteriors
        return {
            'schema': SCHEMA,
            'source': self.source,
            'samples': {
                'sent': self.sent,
                'received': self.count('samples'),
                'recorded': self.content.samples,
            },
            'windows': len(posteriors),
            'windows_dropped': self.count('windows dropped'),
            'windows_failed': self.count('windows failed'),
            'windows_stopped_early': sum(bool(p.stopped_early) for p in posteriors),
            'deadlines_missed': self.count('deadlines missed'),
            'coverage': {kind: self.content.coverage(kind) for kind in ('total', 'parameter')},
            'width_m': {
                kind: {
                    level: self.content.mean_width(kind, float(level))
                    for level in self.content.coverage(kind)
                }
                for kind in ('total', 'parameter')
            },
            'moments': self.moments(),
            'truth_inside_95': self.truth_inside(),
            'explanations': self.explanations(),
            'broken_promises': self.broken_promises(),
            'drift': self.drift(),
            'replay_identical': self.comparison.identical,
            'replay': {
                'windows': self.comparison.windows,
                'bands': self.comparison.bands,
                'differing': self.comparison.differing[:20],
            },
            'diagnosis': None if self.diagnosis is None else self.diagnosis.to_json(),
            'seconds': self.seconds,
        }

    def show(self, console: Console) -> None:
        """Print what people want to know."""
        if self.content.posteriors:
            console.print(self._table_of_moments())
        console.print(self._table_of_coverage())
        sent, received, recorded = self.sent, self.count('samples'), self.content.samples
        console.print(f'samples   {sent} sent, {received} received, {recorded} recorded')
        console.print(
            f'windows   {len(self.content.posteriors)} with a posterior ({self.answered:.0%}), '
            'deadlines missed '
            f'{self.count("deadlines missed")}'
        )
        if (found := self.content.response) is not None:
            console.print(
                f'actuator  {1e3 * found.headline_delay:.2f} ms delay, amplitude '
                f'{found.headline_amplitude:.3f} at {found.headline_frequency:g} Hz'
            )
        if (inside := self.truth_inside()) is not None:
            shares = ', '.join(f'{name} {share:.0%}' for name, share in inside.items())
            console.print(
                f'truth     inside the 95 % interval, windows from the first addition on: {shares}'
            )
        for at, said in self.explanations():
            console.print(f'explained from {at:.0f} s on by {said}')
        for line in self.broken_promises():
            console.print(f'BROKEN    {line}')
        for name, moved in (self.drift() or {}).items():
            console.print(
                f'drift     {name} by {moved["true"]:.3g} under the last model, estimated as '
                f'{moved["followed"]:.3g} +- {moved["stddev"]:.2g}'
            )
        found = self.comparison
        answer = 'identical, bit for bit' if found.identical else 'NOT identical'
        console.print(f'replay    {answer} ({found.windows} posteriors, {found.bands} bands)')
        for line in found.differing[:5]:
            console.print(f'          {line}')
        for line in [] if self.diagnosis is None else verdict(self.diagnosis):
            console.print(line)

    def _table_of_moments(self) -> Table:
        last = self.content.posteriors[-1]
        table = Table(title=f'Posterior of the last window ({last.window})', **LOOK)
        for name in ('parameter', 'unit', 'mean', 'sd', 'skewness', 'COV', 'R-hat', 'ESS'):
            table.add_column(name, justify='left' if name in ('parameter', 'unit') else 'right')
        for i, (name, values) in enumerate(self.moments().items()):
            table.add_row(
                name + ('*' if values['prior_dominated'] else ''),
                str(last.units[i]),
                f'{values["mean"]:.4g}',
                f'{values["stddev"]:.2g}',
                f'{values["skewness"]:.2f}',
                f'{values["cov"]:.3f}',
                f'{values["rhat"]:.3f}',
                f'{values["ess"]:.0f}',
            )
        if any(last.prior_dominated):
            table.caption = '* the window says little more than the prior'
        return table

    def _table_of_coverage(self) -> Table:
        table = Table(title='Forecast bands against what was then measured', **LOOK)
        for name in ('band', 'level', 'coverage', 'mean width'):
            table.add_column(name, justify='left' if name == 'band' else 'right')
        for kind, title in BANDS.items():
            for level, share in self.content.coverage(kind).items():
                width = self.content.mean_width(kind, float(level))
                table.add_row(
                    title, f'{float(level):.0%}', f'{share:.1%}', f'{1e3 * width:.4f} mm'
                )
        return table


def verdict(diagnosis: DiagnosisData) -> list[str]:
    """Return what people want to know, line by line."""
    error = diagnosis.error
    lines = [f'diagnosis {diagnosis.summary()}']
    for effect in diagnosis.effects:
        sizes = ', '.join(
            f'{name} {p.mean:.4g} +- {p.stddev:.2g} {p.unit}'
            for name, p in effect.parameters.items()
        )
        lines.append(f'          {effect.name} ({effect.place}): {sizes}')
    if diagnosis.effects:
        base = [
            f'{name} {p.mean:.4g} +- {p.stddev:.2g} {p.unit}' for name, p in diagnosis.base.items()
        ]
        lines.append(f'          with it {", ".join(base)}')
    before, after, low, high, noise = (
        f'{1e6 * v:.2f}' for v in (error.before, error.after, *error.after_ci, error.noise_floor)
    )
    lines.append(
        f'error     {before} um before, {after} um after [{low}, {high}], noise {noise} um, '
        'held-out data'
    )
    return lines
