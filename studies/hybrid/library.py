"""What the study takes from inside the package: the benchmark, virtual tests, the style."""

from actuator_glue.api.simulation import Sensors
from actuator_glue.hybrid.compensator import Compensator
from actuator_glue.hybrid.design import Loop
from actuator_glue.hybrid.ground_motion import artificial
from actuator_glue.hybrid.partition import modal_damping
from actuator_glue.hybrid.sampled import growth
from actuator_glue.hybrid.stability import share
from actuator_glue.hybrid.virtual import VirtualTest
from actuator_glue.io.json_file import write_json
from actuator_glue.io.partition import read_partition
from actuator_glue.model.benchmark_plant import BenchmarkParameters
from actuator_glue.model.structure import Structure

__all__ = [
    'BenchmarkParameters',
    'Compensator',
    'Loop',
    'Sensors',
    'Structure',
    'VirtualTest',
    'artificial',
    'growth',
    'modal_damping',
    'read_partition',
    'share',
    'write_json',
]
