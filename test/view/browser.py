"""A headless Chromium, driven over its debugging protocol."""

from __future__ import annotations

import asyncio
import base64
import io
import json
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import aiohttp
from PIL import Image

PROGRAMS = ('chromium', 'chromium-browser', 'google-chrome', 'chrome')
PROGRAM = next((found for name in PROGRAMS if (found := shutil.which(name))), None)


class Browser:
    """One page; use it with `async with`.

    Attributes:
        requests: addresses that the page asked for.
        faults: what the page wrote to its console as errors, and exceptions.
    """

    def __init__(self) -> None:
        self.requests: list[str] = []
        self.faults: list[str] = []
        self._answers: dict[int, asyncio.Future[dict[str, Any]]] = {}

    async def __aenter__(self) -> Browser:
        """Start it."""
        assert PROGRAM is not None
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            [
                PROGRAM,
                '--headless=new',
                '--no-sandbox',
                '--disable-gpu',
                '--hide-scrollbars',
                '--disable-dev-shm-usage',
                '--window-size=1300,800',
                '--remote-debugging-port=0',
                '--remote-allow-origins=*',
                f'--user-data-dir={self._profile.name}',
                'about:blank',
            ],
            stderr=subprocess.PIPE,
            text=True,
        )
        self._session = aiohttp.ClientSession()
        port = Path(self._profile.name, 'DevToolsActivePort')
        for _ in range(600):
            if port.exists() and len(port.read_text().splitlines()) == 2:
                break
            await asyncio.sleep(0.1)
        number = port.read_text().splitlines()[0]
        async with self._session.get(f'http://127.0.0.1:{number}/json/list') as answer:
            (page,) = [t for t in await answer.json() if t['type'] == 'page']
        self._socket = await self._session.ws_connect(
            page['webSocketDebuggerUrl'], max_msg_size=1 << 26
        )
        self._reader = asyncio.create_task(self._read())
        for domain in ('Network', 'Page', 'Runtime', 'Log'):
            await self.call(f'{domain}.enable')
        return self

    async def screen(self, width: int, height: int, *, mobile: bool) -> None:
        """Have a screen of this size [px]."""
        await self.call(
            'Emulation.setDeviceMetricsOverride',
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=mobile,
        )

    async def __aexit__(self, *_: object) -> None:
        """End it."""
        self._reader.cancel()
        await self._socket.close()
        await self._session.close()
        self._process.terminate()
        self._process.communicate(timeout=60)
        self._profile.cleanup()

    async def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol."""
        number = len(self._answers) + 1
        self._answers[number] = asyncio.get_running_loop().create_future()
        await self._socket.send_json({'id': number, 'method': method, 'params': parameters})
        return await asyncio.wait_for(self._answers[number], 60.0)

    async def open(self, url: str) -> None:
        """Go to a page."""
        await self.call('Page.navigate', url=url)

    async def value(self, expression: str) -> Any:
        """Return what an expression is in the page."""
        found = await self.call('Runtime.evaluate', expression=expression, returnByValue=True)
        assert 'exceptionDetails' not in found, found
        return found['result'].get('value')

    async def until(self, expression: str, seconds: float = 60.0) -> None:
        """Wait until an expression is true."""
        for _ in range(round(10 * seconds)):
            if await self.value(f'Boolean(document.body && ({expression}))'):
                return
            await asyncio.sleep(0.1)
        raise AssertionError(f'never came true: {expression}; {self.faults}')

    async def picture(self, height: float | None = None) -> Image.Image:
        """Return what is seen, or that much of the page from its beginning [px]."""
        clip = {}
        if height is not None:
            width = await self.value('innerWidth')
            area = {'x': 0, 'y': 0, 'width': width, 'height': height, 'scale': 1}
            clip = {'captureBeyondViewport': True, 'clip': area}
        found = await self.call('Page.captureScreenshot', format='png', **clip)
        return Image.open(io.BytesIO(base64.b64decode(found['data']))).convert('RGB')

    async def _read(self) -> None:
        async for message in self._socket:
            content = json.loads(message.data)
            if 'id' in content:
                self._answers[content['id']].set_result(content.get('result', content))
            elif content['method'] == 'Network.requestWillBeSent':
                self.requests.append(content['params']['request']['url'])
            elif content['method'] == 'Network.webSocketCreated':
                self.requests.append(content['params']['url'])
            elif content['method'] == 'Runtime.exceptionThrown' or (
                content['method'] == 'Log.entryAdded'
                and content['params']['entry']['level'] == 'error'
            ):
                text = json.dumps(content['params'])
                if not re.search('favicon', text):
                    self.faults.append(text[:500])
