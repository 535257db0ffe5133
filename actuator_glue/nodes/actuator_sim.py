"""A simulated actuator in real time, with effects that nobody is told of."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.api.simulation import EFFECTS_FORM, SHAPES, Command, named_effects, sizes
from actuator_glue.errors import InputError
from actuator_glue.model import commands
from actuator_glue.model.benchmark_plant import benchmark_plant
from actuator_glue.model.parameters import BASE
from actuator_glue.model.plant import MeasuredPlant, Plant
from actuator_glue.model.sensor import SensorSpec
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure
from actuator_glue.nodes import folders, hidden_effects, own_effects, spin, streamer
from actuator_glue.nodes.beside import Beside
from actuator_glue.nodes.blocks import BlockPublisher
from actuator_glue.nodes.pacer import Step
from actuator_glue.nodes.parameters import Parameters, Spec
from actuator_glue.records import Array

# Parameters of the simulated actuator: near the paper's, not equal to any table's.
_TRUE = {'beta_1': 134.0, 'alpha_1_beta_0': 1.1e9, 'alpha_2': 2.5e5, 'alpha_3': 0.5}
COMMANDS = (*SHAPES, 'file')

SPECS = (
    Spec('actuator', 'actuator', 'name of the actuator', read_only=True),
    Spec('plant', 'paper', 'simulated plant', read_only=True, choices=('paper', 'benchmark')),
    Spec('rate', 1000.0, 'sample rate', 'Hz', 1.0, 20_000.0, True),
    Spec('block', 10, 'samples per message', '1', 1, 100_000, True),
    Spec('specimen_stiffness', 250e3, 'specimen stiffness k', 'N/m', 0.0, 1e9),
    *(Spec(p.name, _TRUE[p.name], p.meaning, p.unit, p.lower, p.upper, True) for p in BASE),
    Spec('command', 'sweep', 'commanded displacement', read_only=True, choices=COMMANDS),
    Spec('command_file', '', 'bag or laboratory file whose command is used', read_only=True),
    Spec('channels', '', 'channel map of command_file', read_only=True),
    Spec('duration', 60.0, 'length of the command', 's', 0.1, 86_400.0, True),
    Spec('amplitude', 2e-3, 'peak of the command', 'm', 0.0, 1.0, True),
    Spec('frequency_start', 0.0, 'lowest frequency (sweep, noise)', 'Hz', 0.0, 1000.0, True),
    Spec('frequency_end', 10.0, 'highest frequency, of a sine its own', 'Hz', 0.0, 1000.0, True),
    Spec('rest', 1.0, 'rest before the command', 's', 0.0, 3600.0, True),
    Spec('repeat', False, 'begin the command again at its end', read_only=True),
    Spec('hold', 'zoh', 'how the command runs between its samples', choices=('zoh', 'linear')),
    Spec('noise', 1e-5, 'noise of the displacement sensor, standard deviation', 'm', 0.0, 1.0),
    Spec('force_noise', 2.0, 'noise of the load cell, standard deviation', 'N', 0.0, 1e6),
    Spec('bits', 18, 'resolution of the displacement sensor, 0 for none', '1', 0, 52),
    Spec('stroke', 0.1, 'half range of the displacement sensor', 'm', 1e-6, 10.0),
    Spec('seed', 1, 'seed of noise and random commands', '1', 0, 2**53, True),
    Spec('preview', 0.0, 'how far ahead commands are published, 0 for not', 's', 0.0, 60.0, True),
    *streamer.specs(exit_at_end=False),
    Spec(
        'undeclared_effect',
        '',
        f'effects of the plant, told to nobody; {EFFECTS_FORM}',
        secret=True,
    ),
    own_effects.SPEC,
    Spec(
        'sealed_file',
        '',
        'file that gets the truth about undeclared_effect, empty for '
        '~/.ros/actuator_glue/truth_DATE-TIME.json',
        read_only=True,
    ),
)


class SimulatorNode(streamer.Streamer):
    """Steps a plant block by block and publishes what its sensors show."""

    def __init__(self) -> None:
        self._renewed = self._clock_changed = False
        self._sealed: Path | None = None
        super().__init__('actuator_sim', SPECS)

    def check(self, values: Mapping[str, Any]) -> None:
        """Refuse combinations that cannot be simulated."""
        own_effects.load(values)
        if values['undeclared_effect'] != Parameters.HIDDEN:
            given = named_effects(values['undeclared_effect'])
            if given and values['plant'] != 'paper':
                raise InputError("undeclared effects need plant 'paper'")
        if values['command'] == 'file' and not values['command_file']:
            raise InputError("command 'file' needs command_file")
        if values['command'] != 'file':
            _command({**values, 'duration': min(values['duration'], 1.0)})

    def do_configure(self) -> None:
        """Make the command and the publishers."""
        self._values = self.parameters.values()
        self.command = _command(self._values)
        self.out = BlockPublisher(self.publisher)
        # Compiled now: a stream that has begun must not wait for a compiler.
        plant, block = self._plant(), self.command[: self._values['block']]
        self._compiling = Beside(self, lambda: plant.step(block))
        self.get_logger().info('compiling the plant; samples follow when that is done')

    def ready(self) -> bool:
        """Whether the plant is compiled, too."""
        return self._compiling.done and super().ready()

    def do_report(self) -> None:
        """What every stream reports, and whether the plant is compiled."""
        super().do_report()
        if not hasattr(self, '_compiling'):
            return
        self.health.values['plant'] = 'ready' if self._compiling.done else 'compiling'
        if self.active and not self._compiling.done:
            text = 'still compiling: samples follow when that is done'
            self.health.fault('plant', text, time.monotonic())

    def changed(self, names: set[str]) -> None:
        """A new specimen, sensor or effect: the plant goes on from rest with the next block."""
        self._renewed = True

    def clock_jumped(self) -> None:
        """Stamps go on from the new time."""
        self._clock_changed = True

    def _announce(self) -> None:
        values = self._values
        source = f'simulated {values["plant"]} plant, {values["command"]}'
        stiffness = None if values['plant'] == 'benchmark' else values['specimen_stiffness']
        self.out.setup(stiffness, values['hold'], self._index, source)

    def _plant(self) -> Plant:
        values = self._values
        if values['plant'] == 'benchmark':
            return benchmark_plant(period=1.0 / values['rate'], seed=values['seed'])
        structure, theta = sizes(
            named_effects(values['undeclared_effect']), [values[p.name] for p in BASE]
        )
        if structure.effects or values['sealed_file']:
            self._seal(structure, theta)
        moving = Stream(
            structure,
            theta,
            stiffness=values['specimen_stiffness'],
            period=1.0 / values['rate'],
            hold=values['hold'],
            rng=np.random.default_rng((values['seed'], 1)),
        )
        return MeasuredPlant(
            moving,
            SensorSpec(values['noise'], values['bits'] or None, values['stroke']),
            SensorSpec(values['force_noise']),
            seed=values['seed'],
        )

    def _seal(self, structure: Structure, theta: Array) -> None:
        if self._sealed is None:
            given = self._values['sealed_file']
            self._sealed = Path(given) if given else folders.unnamed('truth', '.json')
            self.get_logger().info(f'the truth is sealed in {self._sealed}')
        hidden_effects.seal(self._sealed, structure, theta)

    # Below runs in the pacer's thread.

    def stream(self) -> Iterator[Step]:
        """Yield the blocks of the command, from rest at sample 0."""
        self._renew()
        self._index = self._previewed = 0
        self._start_clock()
        self._announce()
        self.introduce()
        self._start_clock()
        rate, size = self._values['rate'], self._values['block']
        while self._index < len(self.command) or self._values['repeat']:
            start = self._index % len(self.command)
            block = self.command[start : start + size]
            # A block can be published when its last sample has been taken.
            yield Step((self._index + len(block)) / rate, partial(self._publish, block))

    def _start_clock(self, taken: int = 0) -> None:
        """Have the next samples stamped by the clock as it is now: so many have been taken."""
        self._clock_changed = False
        period = 1.0 / self._values['rate']
        start = self.get_clock().now().nanoseconds - round(1e9 * taken * period)
        self.out.begin(self._values['actuator'], period, start, self._index)

    def _renew(self) -> None:
        self._renewed = False
        self._values = self.parameters.values()
        self.plant = self._plant()

    def _publish(self, command: Array) -> None:
        if self._clock_changed:
            self._start_clock(len(command))
        if self._renewed:
            self._renew()
            self._announce()
        self._publish_preview()
        measured, force = self.plant.step(command)
        self.out.samples(self._index, command, measured, force)
        self._index += len(command)
        self.samples.add(len(command))

    def _publish_preview(self) -> None:
        ahead = round(self._values['preview'] * self._values['rate'])
        first, stop = max(self._index, self._previewed), self._index + ahead
        if not self._values['repeat']:
            stop = min(stop, len(self.command))
        if ahead and stop > first:
            self.out.preview(first, self.command[np.arange(first, stop) % len(self.command)])
            self._previewed = stop


def _command(values: Mapping[str, Any]) -> Array:
    rate, kind = values['rate'], values['command']
    if kind == 'file':
        from actuator_glue.io.load import load_records

        record = load_records(values['command_file'], channels=values['channels'] or None)[0]
        command = commands.recorded(record, rate)
    else:
        command = Command(
            kind,
            rate,
            values['duration'],
            values['amplitude'],
            values['frequency_start'],
            values['frequency_end'],
            values['seed'],
        ).samples()
    rest = np.full(round(values['rest'] * rate), command[0])
    return np.concatenate([rest, command])


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return spin.main(SimulatorNode, args)


if __name__ == '__main__':
    sys.exit(main())
