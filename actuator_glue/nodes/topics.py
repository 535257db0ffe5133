"""Topics of the suite: relative names, types, and the quality of service of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import actuator_glue_msgs.msg
from actuator_glue_msgs.msg import (
    CommandPreview,
    Diagnosis,
    EstimatorSetup,
    FrequencyResponseBand,
    PosteriorDraws,
    PosteriorMoments,
    PredictionBand,
    SampleBlock,
    StabilityMargin,
    TestSetup,
)
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy


def _reliable(depth: int, *, latched: bool = False) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Topic:
    """One topic.

    Attributes:
        name: relative name, to be remapped and put into namespaces.
        type: message class.
        qos: default profile of publishers and subscribers; parameters override it.
        shared: several may publish it; else its messages count on from one another.
    """

    name: str
    type: Any
    qos: QoSProfile
    shared: bool = False

    @property
    def latched(self) -> bool:
        """Whether late subscribers get the last messages."""
        return bool(self.qos.durability == DurabilityPolicy.TRANSIENT_LOCAL)


# Samples: reliable and deep, so that a computer that stalls for a second loses nothing.
SAMPLES = Topic('samples', SampleBlock, _reliable(2000))
PREVIEW = Topic('command_preview', CommandPreview, _reliable(200))
# Whoever joins late must know what is being tested and estimated.
TEST_SETUP = Topic('test_setup', TestSetup, _reliable(10, latched=True), shared=True)
ESTIMATOR_SETUP = Topic('estimator_setup', EstimatorSetup, _reliable(10, latched=True))
DIAGNOSIS = Topic('diagnosis', Diagnosis, _reliable(1, latched=True))
POSTERIOR = Topic('posterior', PosteriorMoments, _reliable(50))
DRAWS = Topic('posterior_draws', PosteriorDraws, _reliable(50))
MARGIN = Topic('stability_margin', StabilityMargin, _reliable(50))
BAND = Topic('prediction_band', PredictionBand, _reliable(200))
RESPONSE = Topic('frequency_response', FrequencyResponseBand, _reliable(50))
# None where the interface package was built before this message: the suite goes on without.
TRACKING = Topic(
    'tracking', getattr(actuator_glue_msgs.msg, 'TrackingIndicators', None), _reliable(50)
)
_TRACKING = () if TRACKING.type is None else (TRACKING,)
DIAGNOSTICS = Topic('/diagnostics', DiagnosticArray, _reliable(50), shared=True)

# What the estimator says.
ESTIMATED = (POSTERIOR, DRAWS, BAND, RESPONSE, *_TRACKING, ESTIMATOR_SETUP)
# What waits on several topics is taken in this order: a set-up before the samples that it is for.
RECORDED = (
    TEST_SETUP,
    ESTIMATOR_SETUP,
    PREVIEW,
    SAMPLES,
    POSTERIOR,
    DRAWS,
    BAND,
    RESPONSE,
    *_TRACKING,
    MARGIN,
    DIAGNOSIS,
    DIAGNOSTICS,
)
