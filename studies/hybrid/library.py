"""What the study takes from inside the package: the benchmark's plant, virtual tests, the style."""

from actuator_glue.hybrid.compensator import Compensator
from actuator_glue.hybrid.design import Loop
from actuator_glue.hybrid.ground_motion import artificial
from actuator_glue.hybrid.partition import modal_damping
from actuator_glue.hybrid.sampled import growth
from actuator_glue.hybrid.virtual import VirtualTest
from actuator_glue.io.json_file import write_json
from actuator_glue.io.partition import read_partition
from actuator_glue.model.benchmark_plant import BenchmarkParameters
from actuator_glue.model.structure import Structure
from actuator_glue.report import style

__all__ = [
    'BenchmarkParameters',
    'Compensator',
    'Loop',
    'Structure',
    'VirtualTest',
    'artificial',
    'growth',
    'modal_damping',
    'read_partition',
    'style',
    'write_json',
]
