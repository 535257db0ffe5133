"""Online Bayesian calibration and diagnosis of servo-hydraulic actuators.

    import actuator_glue as ag

    record = ag.load('test.csv', stiffness=250e3)
    posterior = ag.calibrate([record])
    found = ag.diagnose([record])

Names are imported when they are first used: importing the package costs nothing, changes nothing
in the process and needs no ROS.
"""

from importlib import import_module as _import_module
from os.path import realpath as _realpath
from typing import TYPE_CHECKING, Any

__version__ = '0.1.0'

# A workspace reaches the sources through links, a virtual environment does not: compiled code is
# kept by path, and both shall find it in one place.
__path__ = [_realpath(folder) for folder in __path__]

if TYPE_CHECKING:
    from actuator_glue import effects as effects
    from actuator_glue.api.calibration import calibrate as calibrate
    from actuator_glue.api.calibration_result import Calibration as Calibration
    from actuator_glue.api.combinations import combinations as combinations
    from actuator_glue.api.compensation import compare_compensators as compare_compensators
    from actuator_glue.api.diagnosis import Diagnosis as Diagnosis
    from actuator_glue.api.diagnosis import diagnose as diagnose
    from actuator_glue.api.record_plot import plot as plot
    from actuator_glue.api.replay_result import Replay as Replay
    from actuator_glue.api.replaying import replay as replay
    from actuator_glue.api.rths import rths as rths
    from actuator_glue.api.simulation import Command as Command
    from actuator_glue.api.simulation import simulate as simulate
    from actuator_glue.api.stability import StabilityResult as StabilityResult
    from actuator_glue.campaigns.actuator_history import ActuatorHistory as ActuatorHistory
    from actuator_glue.campaigns.actuator_history import history as history
    from actuator_glue.campaigns.campaign import CampaignResult as CampaignResult
    from actuator_glue.campaigns.campaign import campaign as campaign
    from actuator_glue.campaigns.comparison import DaysCompared as DaysCompared
    from actuator_glue.campaigns.comparison import compare as compare
    from actuator_glue.errors import InputError as InputError
    from actuator_glue.hybrid.ground_motion import GroundMotion as GroundMotion
    from actuator_glue.hybrid.partition import Partition as Partition
    from actuator_glue.hybrid.partition import Specimen as Specimen
    from actuator_glue.io.join import join as join
    from actuator_glue.io.load import load as load
    from actuator_glue.io.load import load_records as load_records
    from actuator_glue.records import Record as Record

# Public name: the module that holds it, and its name there ('' for the module itself).
_PUBLIC = {
    'ActuatorHistory': ('campaigns.actuator_history', 'ActuatorHistory'),
    'Calibration': ('api.calibration_result', 'Calibration'),
    'CampaignResult': ('campaigns.campaign', 'CampaignResult'),
    'Command': ('api.simulation', 'Command'),
    'DaysCompared': ('campaigns.comparison', 'DaysCompared'),
    'Diagnosis': ('api.diagnosis', 'Diagnosis'),
    'GroundMotion': ('hybrid.ground_motion', 'GroundMotion'),
    'InputError': ('errors', 'InputError'),
    'Partition': ('hybrid.partition', 'Partition'),
    'Record': ('records', 'Record'),
    'Replay': ('api.replay_result', 'Replay'),
    'Specimen': ('hybrid.partition', 'Specimen'),
    'StabilityResult': ('api.stability', 'StabilityResult'),
    'calibrate': ('api.calibration', 'calibrate'),
    'campaign': ('campaigns.campaign', 'campaign'),
    'combinations': ('api.combinations', 'combinations'),
    'compare': ('campaigns.comparison', 'compare'),
    'compare_compensators': ('api.compensation', 'compare_compensators'),
    'diagnose': ('api.diagnosis', 'diagnose'),
    'effects': ('effects', ''),
    'history': ('campaigns.actuator_history', 'history'),
    'join': ('io.join', 'join'),
    'load': ('io.load', 'load'),
    'load_records': ('io.load', 'load_records'),
    'plot': ('api.record_plot', 'plot'),
    'replay': ('api.replaying', 'replay'),
    'rths': ('api.rths', 'rths'),
    'simulate': ('api.simulation', 'simulate'),
}
__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    """Import a public name at its first use."""
    if name not in _PUBLIC:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    module, attribute = _PUBLIC[name]
    found = _import_module(f'{__name__}.{module}')
    value = getattr(found, attribute) if attribute else found
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names."""
    return [*__all__, '__version__']
