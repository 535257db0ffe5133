"""The catalogue's names of the effects of a blind case, and the parameters that they then have."""

from __future__ import annotations

from sizing import Array

# Machines whose parameters the catalogue counts in another way than the generators: (T s + 1) (s +
# beta_1) of a valve is T s^2 + s + beta_1 there, and a heavy payload comes with leakage.
OTHERWISE = {'valve-lag', 'payload-inertia'}
# Kinds that were outside of the catalogue when the generators were written.
SAME = {'sensor-cubic': 'sensor-curve', 'sensor-quadratic': 'sensor-curve'} | {
    'command-lag': 'sensor-lag',
}
# name -> parameter, where the size is its value.
_PLAIN = {
    'delay': 'delay',
    'backlash': 'backlash',
    'specimen-gap': 'gap',
    'integral-action': 'integral_rate',
    'valve-hysteresis': 'valve_play',
    'command-lag': 'sensor_lag',
}
_SIGNED = {'valve-null': 'null_offset', 'bias': 'bias', 'flow-asymmetry': 'asymmetry'}
_MINUTE = 60.0  # s in which what drifts does so by its size


def catalogued(name: str) -> str:
    """Return the catalogue's name of an effect."""
    return SAME.get(name, name)


def values(
    sizes: dict[str, float],
    theta: Array,
    stroke: float,
    sign: float = 1.0,
    form: int = 0,
    frame: tuple[float, float] = (0.0, 0.0),
    dry: bool = True,
) -> dict[str, float]:
    """Return the true parameters of effects whose equation is the catalogue's, by name [SI].

    Args:
        sizes: size of each effect as the generator has it.
        theta: the machine (4,).
        stroke: largest command of the first record [m].
        sign: of effects that have two.
        form: which way an effect with several is written.
        frame: natural frequency [Hz] and damping ratio of the reaction frame.
        dry: whether friction is Coulomb's; where it rises over a velocity its size is another.
    """
    out: dict[str, float] = {}
    for name, size in sizes.items():
        match name:
            case 'gain':
                out['gain'] = 1.0 + sign * size
            case 'valve-deadband' if form == 0:
                out['deadband'] = size
            case 'sensor-lag' if form != 2:
                out['sensor_lag'] = size
            case 'coulomb-friction' if dry:
                out['coulomb_force'] = size * float(theta[2])
            case 'viscous-damping':
                out['damping'] = size * float(theta[2]) / 50.0
            case 'clock-skew':
                out['clock_skew'] = -sign * size
            case 'drift':
                out['drift'] = sign * size / _MINUTE
            case 'specimen-hardening':
                # Beside what yields the spring that is left hardens.
                spring = 1.0 - sizes.get('specimen-yield', 0.0)
                out['hardening'] = spring * (sign * 0.2 if sign < 0 else 1.0) * size / stroke**2
            case 'pressure-flow':
                out['inverse_stall_force'] = size / (250e3 * stroke)
            case 'sensor-quadratic':
                out['sensor_even'] = sign * size / stroke**2
            case 'sensor-cubic':
                out['sensor_odd'] = sign * size / stroke**3
            case 'frame-mode':
                out['frame_compliance'], out['frame_seen'] = size / 250e3, 0.5 * form
                out['frame_frequency'], out['frame_damping'] = frame
            case _ if name in _PLAIN:
                out[_PLAIN[name]] = size
            case _ if name in _SIGNED:
                out[_SIGNED[name]] = sign * size
    return out
