"""What the study takes from inside the package, and streams of random numbers that never meet."""

import zlib

from actuator_glue.api.calibration_parts import CalibratedRecord, FitError, Marginal
from actuator_glue.api.simulation import Sensors
from actuator_glue.hybrid.compensator import Compensator
from actuator_glue.hybrid.design import Loop
from actuator_glue.hybrid.ground_motion import GroundMotion, artificial
from actuator_glue.hybrid.partition import modal_damping
from actuator_glue.hybrid.sampled import growth
from actuator_glue.hybrid.stability import share
from actuator_glue.hybrid.virtual import Responses, VirtualTest
from actuator_glue.io.json_file import write_json
from actuator_glue.io.partition import read_partition
from actuator_glue.model.benchmark_plant import BenchmarkParameters
from actuator_glue.model.structure import Structure
from actuator_glue.report import style

__all__ = [
    'BenchmarkParameters',
    'CalibratedRecord',
    'Compensator',
    'FitError',
    'GroundMotion',
    'Loop',
    'Marginal',
    'Responses',
    'Sensors',
    'Structure',
    'VirtualTest',
    'artificial',
    'growth',
    'modal_damping',
    'read_partition',
    'share',
    'stream',
    'style',
    'write_json',
]


def stream(seed: int, use: str) -> int:
    """Return the seed of one use of random numbers for one actuator.

    A sequence (seed, 0) would give the numbers of `seed` itself: the prediction's noise would be
    that of the test it predicts.
    """
    return seed * 2**32 + zlib.crc32(use.encode())
