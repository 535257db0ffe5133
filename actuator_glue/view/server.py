"""The page's server: loopback only, its own files only, for pages of its own origin only."""

from __future__ import annotations

import asyncio
import sys
import threading
from collections.abc import Awaitable, Callable
from pathlib import Path

from actuator_glue.errors import InputError
from actuator_glue.view.frames import Frames, Wanted, parse_wanted
from actuator_glue.view.intake import Intake

try:
    from aiohttp import WSMsgType, web
except ImportError as error:
    raise InputError(
        "the page needs aiohttp; install it with `pip install 'actuator_glue[lab]'`"
    ) from error

HOST = '127.0.0.1'
PORT = 8766
_RATE = 20.0  # frames per second
_PAGES = 8  # open at once
_SHARE = 4.0  # pause after a frame, in times that it took
_ASSETS = Path(__file__).resolve().parent / 'assets'
_FILES = {
    '/': ('page.html', 'text/html'),
    '/page.js': ('page.js', 'text/javascript'),
    '/page.css': ('page.css', 'text/css'),
    '/charts.js': ('charts.js', 'text/javascript'),
    '/uplot.js': ('uplot.js', 'text/javascript'),
    '/uplot.css': ('uplot.css', 'text/css'),
}
_HEADERS = {
    'Content-Security-Policy': (
        "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
    ),
    'X-Content-Type-Options': 'nosniff',
    'Referrer-Policy': 'no-referrer',
    'Cross-Origin-Resource-Policy': 'same-origin',
    'Cache-Control': 'no-store',
}
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class PageServer:
    """Serves one intake from a thread of its own until `close`.

    Args:
        intake: what is shown.
        port: of 127.0.0.1; 0 for any that is free.

    Attributes:
        url: where the page is.

    Raises:
        InputError: the port cannot be had.
    """

    def __init__(self, intake: Intake, port: int = PORT) -> None:
        self.url = ''
        self._intake = intake
        self._pages = 0
        self._port = port
        self._fault: OSError | None = None
        self._loop = asyncio.new_event_loop()
        self._started = threading.Event()
        self._thread = threading.Thread(target=self._run, name='page', daemon=True)
        self._thread.start()
        self._started.wait()
        if self._fault is not None:
            self._thread.join()
            detail = self._fault.strerror or self._fault
            raise InputError(f'port {port} of {HOST} cannot be had ({detail}); choose another')

    def close(self) -> None:
        """End the server."""
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._loop.close()
            self._started.set()

    async def _serve(self) -> None:
        self._end = asyncio.Event()
        app = web.Application(middlewares=[self._guard])
        for path in _FILES:
            app.router.add_get(path, self._file)
        app.router.add_get('/socket', self._socket)
        runner = web.AppRunner(app, access_log=None, shutdown_timeout=0.5)
        await runner.setup()
        try:
            site = web.TCPSite(runner, HOST, self._port)
            await site.start()
            self._port = runner.addresses[0][1]
            self.url = f'http://{HOST}:{self._port}/'
            self._started.set()
            await self._end.wait()
        except OSError as error:
            self._fault = error
        finally:
            await runner.cleanup()

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse whoever reached us by another name or from another page."""
        # A name that an attacker's DNS points to 127.0.0.1 is none of these (rebinding).
        hosts = {f'{name}:{self._port}' for name in (HOST, 'localhost')}
        origin = request.headers.get('Origin')
        if request.host not in hosts:
            raise web.HTTPForbidden(text='this page answers to 127.0.0.1 only')
        if origin is not None and origin not in {f'http://{host}' for host in hosts}:
            raise web.HTTPForbidden(text='this page answers to itself only')
        if request.path == '/socket' and origin is None:
            raise web.HTTPForbidden(text='the socket answers to the page only')
        return await handler(request)

    async def _file(self, request: web.Request) -> web.StreamResponse:
        name, kind = _FILES[request.path]
        body = (_ASSETS / name).read_bytes()
        return web.Response(body=body, content_type=kind, charset='utf-8', headers=_HEADERS)

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        if self._pages >= _PAGES:
            raise web.HTTPServiceUnavailable(text=f'{_PAGES} pages are open already')
        socket = web.WebSocketResponse(max_msg_size=1024, heartbeat=20.0, compress=False)
        await socket.prepare(request)
        self._pages += 1
        page = _Page(self._intake, socket)
        sending = asyncio.create_task(page.send())
        try:
            async for message in socket:
                if message.type != WSMsgType.TEXT:
                    break
                page.wanted = parse_wanted(message.data)
        except InputError as error:
            await socket.close(code=1008, message=str(error).encode()[:100])
        finally:
            self._pages -= 1
            sending.cancel()
        return socket


class _Page:
    """One open page: what it asks for, and what it has."""

    def __init__(self, intake: Intake, socket: web.WebSocketResponse) -> None:
        self.wanted = Wanted()
        self._intake = intake
        self._frames = Frames(intake)
        self._socket = socket

    async def send(self) -> None:
        """Send frames; what fails is told, and the socket closed: the page says so and asks anew.

        A page that gets nothing more, of an open socket, looks like a test that stands still.
        """
        try:
            await self._frames_on()
        except Exception as error:
            print(
                f'page: a frame could not be made ({type(error).__name__}: {error}); the page '
                'connects anew. This is a fault of actuator-glue, please report it',
                file=sys.stderr,
                flush=True,
            )
            await self._socket.close(code=1011, message=b'a frame could not be made')

    async def _frames_on(self) -> None:
        """Send a frame wherever there is something new, as fast as the page takes them."""
        shown: tuple[Wanted, int] | None = None
        loop, due = asyncio.get_running_loop(), 0.0
        while not self._socket.closed:
            # What making and sending a frame takes is part of its time.
            due = max(due + 1.0 / _RATE, loop.time())
            now = (self.wanted, self._intake.history.version)
            # A page that stands still in the past has what it asked for.
            still = shown is not None and now[0] == shown[0] and now[0].stop is not None
            if self._frames.owing or (now != shown and not still):
                shown = now
                begin = loop.time()
                content = self._frames.next(self.wanted, begin)
                # A quarter of an hour of samples takes longer: never more than a fifth of a core.
                due = max(due, loop.time() + _SHARE * (loop.time() - begin))
                try:
                    await self._socket.send_bytes(content)
                except (ConnectionError, RuntimeError):  # the page was closed meanwhile
                    return
            await asyncio.sleep(max(due - loop.time(), 0.0))
