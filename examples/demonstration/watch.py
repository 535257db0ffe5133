"""What the recorder has written so far: the demonstration watches the bag, not the nodes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from actuator_glue.io.mcap_scan import Scan
from actuator_glue.io.messages import deserialize, full_name

SAMPLES = full_name('SampleBlock')
POSTERIOR = full_name('PosteriorMoments')
BAND = full_name('PredictionBand')
HEALTH = 'diagnostic_msgs/msg/DiagnosticArray'


@dataclass(slots=True)
class Watch:
    """Counts that grow while a bag is written.

    Attributes:
        bag: folder of the bag, which need not exist yet.
        samples: samples recorded.
        windows: posteriors recorded.
        stopped_early: how many of them the time budget ended.
        posterior: the last PosteriorMoments, None before the first.
        forecast: the last PredictionBand that was made before its data and is scored, or None.
        ready: the estimator's worker has compiled and waits for samples.
        coverages: coverage of the widest level, one per scored forecast.
    """

    bag: Path
    samples: int = 0
    windows: int = 0
    stopped_early: int = 0
    posterior: Any = None
    forecast: Any = None
    ready: bool = False
    coverages: list[float] = field(default_factory=list)
    _scans: dict[Path, Scan] = field(default_factory=dict)

    def update(self) -> None:
        """Take in what has been flushed since the last call.

        Raises:
            InputError: a file of the bag is damaged.
        """
        for name, content in self._new():
            if name == SAMPLES:
                self.samples += len(content.command)
            elif name == POSTERIOR:
                self.posterior = content
                self.windows += 1
                self.stopped_early += bool(content.stopped_early)
            elif name == HEALTH:
                said = {
                    v.key: v.value
                    for status in content.status
                    for v in status.values
                    if status.name.endswith('/estimator')
                }
                self.ready = self.ready or said.get('worker') == 'ready'
            elif content.forecast and content.scored and content.kind == 'total':
                self.forecast = content
                self.coverages.append(float(content.widest_coverage))

    def _new(self) -> Iterator[tuple[str, Any]]:
        for path in sorted(self.bag.glob('*.mcap')):
            scan = self._scans.setdefault(path, Scan(path, lambda _: None))
            for schema, _, message in scan.messages(follow=True):
                if schema.name in (SAMPLES, POSTERIOR, BAND, HEALTH):
                    yield schema.name, deserialize(schema.name, message.data)
