"""A controller that sends a simulated actuator by UDP, and all that can be wrong with that."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable

import numpy as np

from actuator_glue.model import commands
from actuator_glue.model.plant import MeasuredPlant
from actuator_glue.model.sensor import SensorSpec
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array
from actuator_glue.streams.layout import PLAIN
from actuator_glue.streams.packed import Packed

RATE = 1000.0
STIFFNESS = 250e3  # N/m
TRUE = np.array([134.0, 1.1e9, 2.5e5, 0.5])
BLOCK = 10
_LENGTH = 600  # s of command, repeated


class Wire:
    """Sends a datagram per sample from a thread of its own.

    Args:
        port: of 127.0.0.1.
        seed: of command, noise and faults.
    """

    def __init__(self, port: int, seed: int) -> None:
        self._rng = np.random.default_rng((seed, 7))
        structure = Structure({})
        moving = Stream(structure, TRUE, stiffness=STIFFNESS, period=1 / RATE)
        sensor, cell = SensorSpec(1e-5, 18, 0.1), SensorSpec(2.0)
        self._plant = MeasuredPlant(moving, sensor, cell, seed=seed)
        self._command = commands.noise(RATE, _LENGTH, 0.2, 8.0, seed=seed)
        self._packed = Packed(PLAIN, RATE)
        self._to = ('127.0.0.1', port)
        self._socket = socket.socket(type=socket.SOCK_DGRAM)
        self._ended = threading.Event()
        self._lock = threading.Lock()
        self._counter, self._time = 0, 0.0
        self._spoil: Callable[[list[bytes]], list[bytes]] | None = None
        self._alter: Callable[[Array], Array] | None = None
        self._silent = 0
        self.sent = 0
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Begin to send."""
        self._thread.start()

    def stop(self) -> None:
        """End."""
        self._ended.set()
        self._thread.join()
        self._socket.close()

    def _run(self) -> None:
        start, block = time.monotonic(), 0
        while not self._ended.is_set():
            at = block * BLOCK % len(self._command)
            command = self._command[at : at + BLOCK]
            measured, force = self._plant.step(command)
            block += 1
            self._ended.wait(max(0.0, start + block * BLOCK / RATE - time.monotonic()))
            with self._lock:
                self._put(command, measured, np.zeros(BLOCK) if force is None else force)

    def _put(self, command: Array, measured: Array, force: Array) -> None:
        index = self._counter + np.arange(BLOCK, dtype=np.float64)
        if self._alter is not None:
            measured, self._alter = self._alter(measured), None
        packets = self._packed.encoded(
            {
                'counter': index,
                'time': self._time + index / RATE,
                'command': command,
                'measured': measured,
                'force': force,
            }
        )
        self._counter += BLOCK
        if self._silent > 0:
            self._silent -= BLOCK
            return
        if self._spoil is not None:
            packets, self._spoil = self._spoil(packets), None
        for packet in packets:
            self._socket.sendto(packet, self._to)
        self.sent += len(packets)

    # Faults; each returns how long it lasts [s].

    def drop_out(self) -> float:
        """Send nothing for up to two seconds."""
        seconds = float(self._rng.uniform(0.05, 2.0))
        self._silent = round(seconds * RATE)
        return seconds

    def nan_burst(self) -> float:
        """Measure nothing but NaN in a block."""
        self._alter = lambda measured: np.full_like(measured, np.nan)
        return BLOCK / RATE

    def spike(self) -> float:
        """Measure 20 mm too much for three samples."""

        def alter(measured: Array) -> Array:
            spoiled = measured.copy()
            spoiled[3:6] += 0.02
            return spoiled

        self._alter = alter
        return BLOCK / RATE

    def clock_jump(self) -> float:
        """Set the sender's clock half a second ahead or back."""
        with self._lock:
            self._time += float(self._rng.choice([-0.5, 0.5]))
        return 0.0

    def restart(self) -> float:
        """Begin to count anew."""
        with self._lock:
            self._counter, self._time = 0, 0.0
        return 0.0

    def disorder(self) -> float:
        """Exchange two datagrams and send a third twice."""
        self._spoil = lambda packets: [packets[1], packets[0], packets[2], *packets[2:]]
        return BLOCK / RATE

    def garbage(self) -> float:
        """Send datagrams of random bytes and sizes between the right ones."""
        self._spoil = lambda packets: [
            part
            for packet in packets
            for part in (self._rng.bytes(int(self._rng.integers(0, 35))), packet)
        ]
        return BLOCK / RATE
