"""Show a bag, or the running nodes, on a page of the browser; nothing leaves this computer."""

from __future__ import annotations

import argparse
import importlib.util
import os
import sys
import threading

from actuator_glue.arguments import Input, whole
from actuator_glue.cli._output import note, say
from actuator_glue.errors import InputError

EXAMPLES = (
    'view bag_of_test',
    'view --live --open',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('bag', nargs='?', type=Input, metavar='BAG', help='bag folder or .mcap')
    parser.add_argument(
        '--live', action='store_true', help='what the nodes publish now; needs ROS 2'
    )
    parser.add_argument(
        '--port', type=whole, default=8766, metavar='N', help='of 127.0.0.1; 0: any (default 8766)'
    )
    parser.add_argument(
        '--namespace', metavar='/NS', help='which actuator, where there are several'
    )
    parser.add_argument('--open', action='store_true', help='open the page in the browser')


def run(args: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C.

    Raises:
        InputError: no bag, no ROS, or no port.
    """
    if (args.bag is None) != args.live:
        raise InputError('give a bag, or --live for what the nodes publish now')
    if not 0 <= args.port <= 65535:
        raise InputError(f'--port {args.port}: a port is a number from 0 to 65535')
    if args.live:
        return _live(args)
    from actuator_glue.view.intake import read_bag
    from actuator_glue.view.server import PageServer

    server = PageServer(read_bag(args.bag, args.namespace, note=note), args.port)
    say(f'{args.bag}: {server.url} (Ctrl-C ends)', args)
    sys.stdout.flush()
    if args.open:
        import webbrowser

        webbrowser.open(server.url)
    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        server.close()
    return 0


def _live(args: argparse.Namespace) -> int:
    """Become the `viewer` node."""
    if importlib.util.find_spec('rclpy') is None:
        raise InputError(
            'view --live listens to ROS 2, and rclpy is not found; source a workspace, or '
            '`. install/setup.bash` after `make setup`'
        )
    options = ['--ros-args', '-p', f'port:={args.port}', '-p', f'open:={str(args.open).lower()}']
    if args.namespace:
        options += ['-r', f'__ns:=/{args.namespace.strip("/")}']
    sys.stdout.flush()
    os.execv(sys.executable, [sys.executable, '-m', 'actuator_glue.nodes.viewer', *options])
