"""Processes of nodes, and a node of the test that watches them."""

import os
import signal
import subprocess
import threading
import time
from collections import Counter, defaultdict
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import rclpy
import yaml
from actuator_glue_msgs.msg import SampleBlock, TestSetup
from diagnostic_msgs.msg import DiagnosticArray
from forked import Forked
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock

from actuator_glue.io.bag_reader import decoded
from actuator_glue.io.remarks import refuse

RATE = 200.0
# Estimator settings for short tests at RATE.
QUICK = {
    'window': 2.0,
    'hop': 0.5,
    'settle': 0.3,
    'time_budget': 0.5,
    'evaluations': 4000,
    'start_evaluations': 12_000,
}


def executable(name):
    """The installed executable, where `ros2 run` looks for it."""
    for prefix in os.environ['AMENT_PREFIX_PATH'].split(os.pathsep):
        path = Path(prefix, 'lib', 'actuator_glue', name)
        if path.is_file():
            return path
    raise AssertionError(f'{name} is not installed below AMENT_PREFIX_PATH')


class Process:
    """One node in a process of its own, forked (see forked.py) or started as installed."""

    def __init__(self, name, node, parameters, folder, namespace='', installed=False):
        self.name = node
        self.log = folder / f'{namespace}{node}.log'
        file = folder / f'{namespace}{node}.yaml'
        file.write_text(yaml.safe_dump({'/**': {'ros__parameters': parameters}}))
        arguments = ['--ros-args', '--params-file', str(file)]
        if node != name:
            arguments += ['-r', f'__node:={node}']
        if namespace:
            arguments += ['-r', f'__ns:=/{namespace}']
        self.log.touch()
        if not installed:
            self.process = Forked(name, arguments, folder, self.log)
            return
        with self.log.open('ab') as log:
            self.process = subprocess.Popen(
                [str(executable(name)), *arguments],
                stdout=log,
                stderr=subprocess.STDOUT,
                cwd=folder,
                start_new_session=True,
            )

    @property
    def alive(self):
        return self.process.poll() is None

    @property
    def text(self):
        return self.log.read_text(errors='replace')

    def stop(self):
        """Stop it; none of its threads runs when this returns."""
        self.process.send_signal(signal.SIGSTOP)
        end = time.monotonic() + 60.0
        while not all('\tT (' in text for text in self._of_threads('status')):
            assert time.monotonic() < end, f'{self.name} goes on'
            time.sleep(1e-3)

    @contextmanager
    def held(self):
        """Stop it for a while, as a busy machine does; what is sent waits for it."""
        self.stop()
        yield
        self.process.send_signal(signal.SIGCONT)

    def waited_for_a_core(self):
        """Seconds for which its threads could have run and others did."""
        return 1e-9 * sum(int(text.split()[1]) for text in self._of_threads('schedstat'))

    def _of_threads(self, file):
        found = []
        for task in Path(f'/proc/{self.process.pid}/task').iterdir():
            with suppress(OSError):  # it has ended
                found.append((task / file).read_text())
        return found

    def end(self, number=signal.SIGINT, timeout=60.0):
        """Send a signal; return the exit status."""
        self.process.send_signal(number)
        return self.process.wait(timeout)

    def wait(self, timeout):
        """Wait for its own end; return the exit status."""
        return self.process.wait(timeout)

    def kill(self):
        """End the process and its children, whatever they do."""
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.kill()  # before it has a group of its own, too
        self.process.wait()


class NotReady(threading.Event):
    """In place of a worker's `ready`: not before the test wants it, however soon the worker is."""

    def set(self):
        """Do nothing: the worker is ready."""

    def come_true(self):
        """Be ready."""
        super().set()


class Probe(Node):
    """Watches /diagnostics, publishes samples, calls services."""

    def __init__(self):
        super().__init__('probe')
        self.health = {}
        self.faults = defaultdict(str)
        self.reports = Counter()
        self.stamps = {}
        self.create_subscription(DiagnosticArray, '/diagnostics', self._diagnosed, 50)
        self.index = 0
        self.callers = {}

    def _diagnosed(self, message):
        for status in message.status:
            node = status.name.strip('/')
            self.health[node] = {v.key: v.value for v in status.values}
            self.reports[node] += 1
            stamp = message.header.stamp
            self.stamps[node] = stamp.sec + 1e-9 * stamp.nanosec
            self.faults[node] += ''.join(
                f'{v.key}: {v.value}\n' for v in status.values if v.key.endswith('(last)')
            )

    def until(self, condition, timeout=60.0, what=''):
        """Spin until a condition holds; the limit is for what never comes, not for the slow."""
        end = time.monotonic() + timeout
        while not condition():
            assert time.monotonic() < end, f'timed out: {what or condition}; {self.health}'
            rclpy.spin_once(self, timeout_sec=0.02)

    def for_a_while(self, seconds):
        """Spin."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            rclpy.spin_once(self, timeout_sec=0.02)

    def for_reports(self, node, count):
        """Spin until a node has reported so many times from now on."""
        wanted = self.reports[node] + count
        self.until(lambda: self.reports[node] >= wanted, what=f'{count} reports of {node}')

    def until_recorded(self, bag, samples):
        """Spin until so many samples are in the file of a bag being written.

        A recorder that ends writes what has reached it. What has not by then is lost, and on a
        busy computer the last blocks may take a while.
        """

        def there():
            self.for_a_while(0.1)
            return len(recorded(bag, lambda _: None)) >= samples

        self.until(there, what=f'{samples} samples in {bag}')

    def value(self, node, key, default=None):
        """What a node last said under a key of /diagnostics."""
        return self.health.get(node, {}).get(key, default)

    def number(self, node, key):
        return float(self.value(node, key, 'nan'))

    def call(self, service, name, request, timeout=20.0, attempts=3):
        """Call a service; ask again when the answer was lost.

        A server drops its answer when DDS has not yet told it of the client's reader.
        """
        if name not in self.callers:
            self.callers[name] = self.create_client(service, name)
        client = self.callers[name]
        self.until(client.service_is_ready, timeout, name)
        for _ in range(attempts):
            future = client.call_async(request)
            with suppress(AssertionError):
                self.until(future.done, timeout / attempts, name)
                return future.result()
            client.remove_pending_request(future)
        raise AssertionError(f'no answer: {name}; {self.health}')

    def state(self, node):
        return self.call(GetState, f'{node}/get_state', GetState.Request()).current_state.label

    def transition(self, node, label):
        """Ask for a lifecycle transition; return whether it succeeded."""
        request = ChangeState.Request()
        request.transition.label = label
        before = self.state(node)
        try:
            return self.call(ChangeState, f'{node}/change_state', request, attempts=1).success
        except AssertionError:
            # The answer was lost: what it was shows in the state, the last one of a node that
            # has gone in what it said last.
            if self.value(node, 'state') == 'finalized':
                return True
            return self.state(node) != before

    def parameters(self, node):
        """Names of a node's parameters."""
        return list(
            self.call(
                ListParameters, f'{node}/list_parameters', ListParameters.Request()
            ).result.names
        )

    def describe(self, node, names):
        request = DescribeParameters.Request(names=names)
        return self.call(DescribeParameters, f'{node}/describe_parameters', request).descriptors

    def get(self, node, names):
        return self.call(
            GetParameters, f'{node}/get_parameters', GetParameters.Request(names=names)
        ).values

    def set(self, node, **values):
        given = [
            rclpy.parameter.Parameter(n, value=v).to_parameter_msg() for n, v in values.items()
        ]
        request = SetParameters.Request(parameters=given)
        return self.call(SetParameters, f'{node}/set_parameters', request).results

    # Samples.

    def open_stream(self, listeners=1):
        """Make publishers and wait until they are listened to."""
        latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.samples_out = self.create_publisher(SampleBlock, 'samples', QoSProfile(depth=1000))
        self.setup_out = self.create_publisher(TestSetup, 'test_setup', latched)
        for out in self.samples_out, self.setup_out:
            self.until(lambda out=out: out.get_subscription_count() >= listeners, 40)
        self.start_ns = 10**18

    def setup(self, stiffness=250e3, rate=RATE, hold='zoh', index=0):
        message = TestSetup(
            actuator='rig',
            specimen_stiffness=float(stiffness),
            rate=rate,
            hold=hold,
            index=index,
        )
        self.setup_out.publish(message)

    def block(self, command, measured, index=None, stamp_ns=None, period=1.0 / RATE):
        """Publish a block at the running index."""
        index = self.index if index is None else index
        stamp = self.start_ns + round(index / RATE * 1e9) if stamp_ns is None else stamp_ns
        message = SampleBlock(period=period, index=index)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        message.header.frame_id = 'rig'
        message.command = np.asarray(command, dtype=float)
        message.measured = np.asarray(measured, dtype=float)
        self.samples_out.publish(message)
        self.index = index + len(command)

    def stream(self, record, size=20, pause=0.005):
        """Publish a record, going on with the running index."""
        for start in range(0, len(record), size):
            part = slice(start, start + size)
            self.block(record.command[part], record.measured[part])
            self.for_a_while(pause)


def recorded(bag, note=refuse):
    """Running indices of all samples in a bag; told of damage, which one being written has."""
    blocks = decoded(bag, ('SampleBlock',), note=note)
    parts = [np.arange(m.index, m.index + len(m.command)) for _, m in blocks]
    return np.concatenate([np.arange(0), *parts])


@contextmanager
def stranger(kind, topic):
    """Publisher of another process's message type on a topic."""
    # A participant may not have two types on one topic: it needs one of its own.
    context = rclpy.context.Context()
    rclpy.init(context=context)
    node = Node('stranger', context=context)
    yield node.create_publisher(kind, topic, 10)
    node.destroy_node()
    context.shutdown()


class Timekeeper:
    """Publishes /clock a hundred times a second, at a speed that may be 0, from any time."""

    def __init__(self, node, start=1000.0):
        self._out = node.create_publisher(Clock, '/clock', 10)
        self.now, self.speed, self._ended = start, 1.0, threading.Event()
        self._one_at_a_time = threading.Lock()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def jump(self, seconds):
        """Leap ahead, or back."""
        with self._one_at_a_time:
            self.now += seconds

    def stand_still(self):
        """Stop; return the time at which it stands."""
        with self._one_at_a_time:
            self.speed = 0.0
            return self.now

    def _run(self):
        last = time.monotonic()
        while not self._ended.wait(0.01):
            elapsed = time.monotonic() - last
            last += elapsed
            with self._one_at_a_time:
                # On a computer that is busy it goes slower: it never leaps by itself.
                self.now += self.speed * min(elapsed, 0.05)
                now = self.now
            message = Clock()
            message.clock.sec, fraction = divmod(int(now * 1e9), 10**9)
            message.clock.nanosec = fraction
            self._out.publish(message)

    def end(self):
        self._ended.set()
        self._thread.join()
