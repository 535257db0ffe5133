"""Lab Streaming Layer: a stream found by its name, with the time stamps of its sender."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.records import Array
from actuator_glue.streams.address import Address
from actuator_glue.streams.layout import Rows
from actuator_glue.streams.lines import label, places, sent_columns, sent_values
from actuator_glue.streams.transports import AT_ONCE, Terms, Transport, no_seal, samples

# How long `send` waits for somebody to listen [s]: discovery takes a second or two.
PATIENCE = 30.0
# The library sends in a thread of its own and doesn't tell when it is done [s].
FAREWELL = 0.5
# Kept by the library while nobody reads [s].
BUFFER = 10


@cache
def library(hosts: tuple[str, ...]) -> Any:
    """Return pylsl, told to keep to this machine unless hosts are allowed.

    Raises:
        InputError: it is not installed, or finds no library for this machine.
    """
    try:
        import pylsl
    except (ImportError, RuntimeError, OSError) as error:
        raise InputError(
            f'Lab Streaming Layer needs pylsl: pip install "actuator_glue[lab]" ({error})'
        ) from error
    scope = f'[lab]\nKnownPeers = {{{", ".join(hosts)}}}\n' if hosts else ''
    reach = 'site' if hosts else 'machine'
    pylsl.set_config_content(f'{scope}[multicast]\nResolveScope = {reach}\n[log]\nlevel = -2\n')
    return pylsl


class LslListener:
    """Receives the first stream of a name; the library finds it again when it comes back."""

    def __init__(self, address: Address, terms: Terms) -> None:
        no_seal(address, terms)
        self._lsl = library(terms.allowed.entries)
        self._name, self._terms = address.name, terms
        self.counts: Counter[str] = Counter()
        self.hint = 'another number or other names of channels'
        self._inlet: Any = None
        self._places: dict[str, int] = {}
        self._kind: type[np.floating[Any]] = np.float64

    def receive(self, timeout: float) -> list[Rows]:
        """Return the samples that have arrived; look for the stream while there is none."""
        if self._inlet is None and not self._found(timeout):
            return []
        try:
            table, stamps = self._inlet.pull_chunk(timeout=0.0, max_samples=AT_ONCE)
            if not stamps:
                table, stamps = self._inlet.pull_chunk(timeout=timeout, max_samples=1)
        except Exception:  # the library's own LostError, TimeoutError, InternalError
            self._let_go()
            return []
        if not stamps:
            return []
        columns = np.asarray(table, dtype=self._kind)
        self.counts['messages'] += len(stamps)
        values = {name: columns[:, at] for name, at in self._places.items()}
        rows = samples(self, self._terms, values)
        if rows.time is None and len(rows.command) == len(stamps):
            rows = rows._replace(time=np.asarray(stamps, dtype=np.float64))
        return [rows] if len(rows.command) else []

    def _found(self, timeout: float) -> bool:
        found = self._lsl.resolve_byprop('name', self._name, 1, max(timeout, 0.01))
        if not found:
            return False
        info = found[0]
        if info.channel_format() == self._lsl.cf_string or info.channel_count() > AT_ONCE:
            self.counts['malformed'] += 1
            return False
        try:
            inlet = self._lsl.StreamInlet(info, max_buflen=BUFFER, recover=True)
            labels = inlet.info(2.0).get_channel_labels() or []
            self._places = places(self._terms.layout, [str(label) for label in labels])
            inlet.open_stream(2.0)
        except LookupError:
            self.counts['malformed'] += 1
            return False
        except Exception:  # gone again, or answering nothing
            return False
        listed = [field.count for field in self._terms.layout.sample if field.column is None]
        # Channels known by their place alone are those of the layout, no more and no less.
        whole = len(listed) < len(self._terms.layout.sample) or sum(listed) == info.channel_count()
        if not whole or max(self._places.values()) >= info.channel_count():
            self.counts['malformed'] += 1
            inlet.close_stream()
            return False
        single = info.channel_format() == self._lsl.cf_float32
        self._kind = np.float32 if single else np.float64
        self._inlet = inlet
        self.counts['connections'] += 1
        return True

    def _let_go(self) -> None:
        inlet, self._inlet = self._inlet, None
        if inlet is not None:
            inlet.close_stream()

    def close(self) -> None:
        """End the stream."""
        self._let_go()


class LslSender:
    """Offers a stream of doubles, one channel per field."""

    unheard = 0

    def __init__(self, address: Address, terms: Terms) -> None:
        no_seal(address, terms)
        lsl = library(terms.allowed.entries)
        self._columns = sent_columns(terms.layout)
        self._period = 1.0 / terms.rate
        name, channels = address.name, len(self._columns)
        info = lsl.StreamInfo(name, 'servo', channels, terms.rate, 'double64', f'{name}-sender')
        info.set_channel_labels([label(field) for field in self._columns])
        self._outlet, self._clock = lsl.StreamOutlet(info), lsl.local_clock
        if not self._outlet.wait_for_consumers(PATIENCE):
            raise InputError(f'{address}: nobody listens to this stream after {PATIENCE:g} s')
        self._sent, self._start = 0, float('nan')

    def send(self, values: Mapping[str, Array]) -> int:
        """Send consecutive samples as one chunk."""
        size = len(values['command'])
        columns = [sent_values(field, values) for field in self._columns]
        if not self._sent:
            self._start = self._clock() - (size - 1) * self._period
        self._sent += size
        last = max(self._start + (self._sent - 1) * self._period, 0.0)
        # The stamp is that of the chunk's last sample.
        self._outlet.push_chunk(np.column_stack(columns).tolist(), last)
        return size

    def close(self) -> None:
        """Withdraw the stream, once what was sent last has had time to leave."""
        time.sleep(FAREWELL)
        del self._outlet


TRANSPORT = Transport('lsl', LslListener, LslSender, in_order=True)
