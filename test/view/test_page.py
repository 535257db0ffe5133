"""The page in a real browser, and who is let to it."""

import asyncio
import json
import os
import re
import threading
import time
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
import pytest
from browser import PROGRAM, Browser
from stream import feed, health, intake, setup

from actuator_glue.errors import InputError
from actuator_glue.view.intake import Intake, read_bag
from actuator_glue.view.server import PageServer

SESSION = Path(__file__).resolve().parents[2] / 'bags' / 'session'
browser = pytest.mark.skipif(PROGRAM is None, reason='no Chromium on this computer')
SHOWN = (
    'north',
    '250 kN/m',
    '\u03b2\u2081',
    '123.4',
    '94 % inside the 95 % band',
    'delay 31.2 ms',
    'missing: backlash',
    '/estimator: R-hat high',
)
LEGENDS = (
    'displacement [mm]',
    '95 % band, fixed before the data',
    'measured',
    'command',
    'residual [um]',
    'measured less the median',
    'tracking error [mm]',
    'force [kN]',
)
TOLD = (
    'backlash \u2013 carried since 21.0 s, above one half since 59.0 s',
    '95 %',
    'if true: \u03b2\u2081 123.4 \u00b1 2.5 1/s, backlash 40 \u00b1 1 um',
    'or coulomb-friction\n37 %',
    'if true: coulomb force 812 N',
    'Next experiment: a slow triangle wave (0.1 Hz) of 0.5 mm without specimen',
    'all explanations, by their weights',
    '102.0 s diagnosis: missing: backlash',
    '/estimator: R-hat high',
)
TURNING = (
    'north, no specimen',
    'displacement [deg]',
    'residual [mdeg]',
    'tracking error [deg]',
    'force [kNm]',
    'mean width 0.8 deg',
    'backlash 40 \u00b1 1 mdeg',
    'coulomb force 812 Nm',
    'of 0.5 deg without specimen',
)
# How long a page is watched, e.g. PAGE_MINUTES=60; and in how many spells.
MINUTES = int(os.environ.get('PAGE_MINUTES', '3'))
SPELLS = 12
BAND = (179, 221, 245)  # the band's blue over white
BLACK = (0, 0, 0)  # what is measured
PLAIN, FIRST, SECOND = (180, 186, 192), (230, 159, 0), (86, 180, 233)  # Eq. (2), and others


class Live:
    """An intake that grows at its own rate from a thread, and its page."""

    def __init__(self, seconds: float = 12.0) -> None:
        self.intake: Intake = intake(seconds)
        self._first = round(seconds * 1000)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._grow, daemon=True)

    def __enter__(self) -> str:
        """Return the page's address."""
        self._server = PageServer(self.intake, 0)
        self._thread.start()
        return self._server.url

    def __exit__(self, *_: object) -> None:
        """End both."""
        self._end.set()
        self._thread.join()
        self._server.close()

    def _grow(self) -> None:
        due = time.monotonic()
        while not self._end.is_set():
            feed(self.intake, self._first, 50)
            self._first += 50
            due += 0.05
            time.sleep(max(due - time.monotonic(), 0.0))


def box_of(name: str) -> str:
    """Return the expression for place and size of a panel's curves in the page."""
    return (
        f'(() => {{ const b = panels.{name}[1].box.getBoundingClientRect(); '
        'return JSON.stringify([b.x, b.y, b.width, b.height].map(Math.round)); })()'
    )


def blue(picture: np.ndarray) -> int:
    """Count the pixels of the band."""
    return int((np.abs(picture.astype(int) - BAND).max(axis=2) < 12).sum())


async def standing(page: Browser) -> str:
    """Return where a page stands, once it has for a second; one that goes on never does."""
    for _ in range(20):
        stop = await page.value('document.body.dataset.stop')
        await asyncio.sleep(1.0)
        if stop == await page.value('document.body.dataset.stop'):
            return str(stop)
    raise AssertionError('it does not stand still')


@browser
def test_a_live_page(tmp_path: Path) -> None:
    """It asks nobody but us, is up to date, shows the band and what is known; pauses."""

    async def look() -> None:
        async with Browser() as page:
            await page.open(url)
            await page.until('document.body.dataset.frames > 5')
            first, begin = int(await page.value('document.body.dataset.frames')), time.monotonic()
            await page.until(f'document.body.dataset.frames > {first + 30}')
            frames = int(await page.value('document.body.dataset.frames')) - first
            rate = frames / (time.monotonic() - begin)
            print(f'{rate:.1f} frames/s')
            assert rate < 25.0  # 20 where the computer has nothing else to do
            text = await page.value('document.body.innerText')
            for words in SHOWN:
                assert words in text, words
            picture = await page.picture()
            picture.save(tmp_path / 'page.png')
            seen = blue(np.asarray(picture))
            assert seen > 5000, seen
            await page.value("document.getElementById('run').click()")
            stopped = await standing(page)
            back = "t = document.getElementById('time'); t.value = t.min; "
            await page.value(back + "t.dispatchEvent(new Event('input'))")
            await page.until('document.body.dataset.stop <= 10.1')
            await page.value("document.getElementById('run').click()")
            await page.until(f'document.body.dataset.stop > {stopped}')
            assert all(r.startswith((url, url.replace('http', 'ws'))) for r in page.requests)
            assert len(page.requests) >= 6
            assert not page.faults

    with Live() as url:
        asyncio.run(look())


@browser
@pytest.mark.parametrize('width', [390, pytest.param(768, marks=pytest.mark.slow), 1440])
def test_no_width_makes_the_chart_grow(width: int, tmp_path: Path) -> None:
    """A phone, a tablet, a desk: the chart keeps its size, all of it is seen, nothing is cut."""
    sizes = (
        '(() => { const one = panels.motion[1]; return JSON.stringify([one.chart.width, '
        'one.chart.root.offsetHeight, one.box.clientWidth, one.box.clientHeight, '
        'document.documentElement.scrollHeight]); })()'
    )

    async def look() -> None:
        async with Browser() as page:
            await page.screen(width, 900, mobile=width < 1000)
            await page.open(url)
            await page.until('document.body.dataset.frames > 5')
            first = await page.value(sizes)
            frames = int(await page.value('document.body.dataset.frames'))
            await page.until(f'document.body.dataset.frames > {frames + 20}')
            assert await page.value(sizes) == first
            wide, high, box_wide, box_high, _ = json.loads(first)
            assert (wide, high) == (pytest.approx(box_wide, abs=1), pytest.approx(box_high, abs=2))
            assert 150 < box_high < 900
            assert await page.value('document.documentElement.scrollWidth') == width
            picture = await page.picture()
            picture.save(tmp_path / f'{width}.png')
            seen = np.asarray(picture).astype(int)
            # The measured line lies over the band, whole.
            left, top, wide, high = json.loads(await page.value(box_of('motion')))
            curve = seen[top : top + high, left + 60 : left + wide - 16]
            assert (np.abs(curve - BLACK).max(axis=2) < 6).sum() > 300
            assert blue(curve) > 1000
            # Numbers beside every curve: a scale has two at least.
            told = await page.value(
                "JSON.stringify(['motion', 'residual', 'error', 'force'].map((name) => "
                'panels[name][1].chart.axes[1]._splits.length))'
            )
            assert min(json.loads(told)) >= 2, told
            legend = await page.value("document.getElementById('samples').innerText")
            for words in LEGENDS:
                assert words in legend
            assert not page.faults

    with Live() as url:
        asyncio.run(look())


@browser
def test_a_page_speaks_the_unit_of_the_motion(tmp_path: Path) -> None:
    """Degrees on every axis, in every text; nothing is said in metres or newtons."""

    async def look() -> None:
        async with Browser() as page:
            await page.screen(1440, 900, mobile=False)
            await page.open(server.url)
            await page.until('document.body.dataset.frames > 1')
            (await page.picture()).save(tmp_path / 'page.png')
            text = (await page.value('document.body.innerText')).replace('\xa0', ' ')
            for words in TURNING:
                assert words in text, words
            assert not re.findall(r'.*\b(?:um|mm|kN|N/m)\b(?!/).*', text)
            assert not page.faults

    made = intake(60.0)
    made.take('TestSetup', setup('deg', 0.0))
    server = PageServer(made, 0)
    try:
        asyncio.run(look())
    finally:
        server.close()


def weight_at(time: float, weight: float) -> str:
    """Return the expression for where a weight [%] stands at a time of the whole test [s]."""
    return (
        '(() => { const b = weights.box.getBoundingClientRect(), at = weights.chart.valToPos; '
        f"return JSON.stringify([b.x + LEFT + at({time}, 'x'), b.y + 6 + at({weight}, 'y')]"
        '.map(Math.round)); })()'
    )


@browser
def test_explanations_and_their_weights(tmp_path: Path) -> None:
    """One stacked band over the whole test; which, since when, how sure, sizes if true, next."""

    async def look() -> None:
        async with Browser() as page:
            await page.screen(1440, 900, mobile=False)
            await page.open(url)
            await page.until('document.body.dataset.frames > 1 && weights.chart')
            picture = await page.picture()
            picture.save(tmp_path / 'page.png')
            seen = np.asarray(picture).astype(int)
            for time_s, weight, color in (
                (10.0, 30.0, PLAIN),
                (40.0, 35.0, FIRST),
                (100.0, 60.0, SECOND),
            ):
                x, y = json.loads(await page.value(weight_at(time_s, weight)))
                part = seen[y - 3 : y + 4, x - 3 : x + 4].reshape(-1, 3)
                assert (np.abs(part - color).max(axis=1) < 6).any(), (time_s, weight)
            text = (await page.value('document.body.innerText')).replace('\xa0', ' ')
            for words in TOLD:
                assert words in text, words
            # What was known at 30 s: a click on the time of what happened goes there.
            await page.value("document.querySelector('#log li:last-child time').click()")
            await page.until('document.body.dataset.stop < 11')
            await page.until("$('explanations').innerText.includes('Eq. (2)')")
            assert 'backlash' not in await page.value("$('explanations').innerText")
            assert await page.value('weights.names.join()') == 'Eq. (2)'
            assert not page.faults

    server = PageServer(intake(120.0), 0)
    url = server.url
    try:
        asyncio.run(look())
    finally:
        server.close()


@browser
@pytest.mark.slow
def test_keys_wheel_and_drag() -> None:
    """They move and zoom; what stands under the pointer stays; the whole test leads anywhere."""

    async def look() -> None:
        async with Browser() as page:

            async def press(key: str) -> None:
                for kind in ('keyDown', 'keyUp'):
                    await page.call('Input.dispatchKeyEvent', type=kind, key=key)

            async def mouse(kind: str, x: float, y: float, **more: Any) -> None:
                await page.call('Input.dispatchMouseEvent', type=kind, x=x, y=y, **more)

            async def at(stop: float) -> None:
                await page.until(f'Math.abs(document.body.dataset.stop - {stop}) < 0.06', 40.0)

            await page.open(url)
            await page.until('document.body.dataset.frames > 1')
            await press('ArrowLeft')
            await at(119.0)
            await press('+')
            assert await page.value('wanted.span') == 5
            await press('-')
            await press('Home')
            await at(10.0)
            left, top, wide, high = json.loads(await page.value(box_of('motion')))
            inside, y = wide - 74, top + high / 2
            # Six tenths of the picture to the left: time goes on by as much.
            await mouse('mousePressed', left + 58 + inside, y, button='left', clickCount=1)
            for part in (0.8, 0.6, 0.4):
                x = left + 58 + part * inside
                await mouse('mouseMoved', x, y, button='left', buttons=1)
            await mouse('mouseReleased', x, y, button='left', clickCount=1)
            await at(16.0)
            # At half of the picture stands 11 s, and there it stays.
            await mouse(
                'mouseWheel', left + 58 + inside / 2, y, deltaX=0, deltaY=-100, modifiers=2
            )
            await at(13.5)
            assert await page.value('wanted.span') == 5
            x, y = json.loads(await page.value(weight_at(60.0, 50.0)))
            await mouse('mousePressed', x, y, button='left', clickCount=1)
            await mouse('mouseReleased', x, y, button='left', clickCount=1)
            await page.until('Math.abs(document.body.dataset.stop - 60) < 1')
            await press('End')
            await at(120.0)
            assert await page.value('wanted.stop') is None
            assert not page.faults

    server = PageServer(intake(120.0), 0)
    url = server.url
    try:
        asyncio.run(look())
    finally:
        server.close()


@browser
@pytest.mark.slow
def test_ten_minutes_add_nothing_to_the_page() -> None:
    """Fed in seconds: elements, listeners, height and heap are what they were before."""
    counted = (
        "JSON.stringify([document.getElementsByTagName('*').length, "
        'document.documentElement.scrollHeight])'
    )

    async def look() -> None:
        async with Browser() as page:
            await page.call('Network.disable')
            await page.call('Performance.enable')
            await page.screen(390, 844, mobile=True)
            await page.open(url)
            kept = []
            for seconds in range(120, 721, 40):
                feed(made, 1000 * (seconds - 40), 40_000, size=200)
                for i in range(8):  # the log is full from the second time on
                    fault = health(f'/node{i}', b'\1', f'{i}', one=seconds, two=seconds)
                    made.take('DiagnosticArray', fault)
                await page.until(f'document.body.dataset.stop > {seconds - 0.5}')
                await page.call('HeapProfiler.collectGarbage')
                used = (await page.call('Runtime.getHeapUsage'))['usedSize'] / 1e6
                found = await page.call('Performance.getMetrics')
                metrics = {m['name']: m['value'] for m in found['metrics']}
                listeners = metrics['JSEventListeners']
                kept.append([*json.loads(await page.value(counted)), listeners, used])
            after = np.array(kept)[7:]
            print(np.array(kept))
            # Lines of the log and of what is carried differ by a few from time to time.
            assert np.ptp(after[:, 0]) < 20
            assert np.ptp(after[:, 1]) < 120
            assert np.ptp(after[:, 2]) < 60
            assert after[-3:, 3].mean() - after[:3, 3].mean() < 0.5
            assert not page.faults

    made = intake(80.0)
    server = PageServer(made, 0)
    url = server.url
    try:
        asyncio.run(look())
    finally:
        server.close()


@browser
def test_a_bag_with_a_time_slider() -> None:
    """The reference session: at its end the diagnosis, at its beginning none; it plays."""

    async def look() -> None:
        async with Browser() as page:
            await page.open(server.url)
            await page.until('document.body.dataset.frames > 0')
            assert 'backlash' in await page.value('document.body.innerText')
            slide = "t = document.getElementById('time'); t.value = 11; "
            await page.value(slide + "t.dispatchEvent(new Event('input'))")
            await page.until('document.body.dataset.stop < 11.1')
            assert await page.value('last.state.diagnosis') is None
            await page.value("document.getElementById('run').click()")
            await page.until('document.body.dataset.stop > 12')
            assert blue(np.asarray(await page.picture())) > 100
            assert not page.faults

    server = PageServer(read_bag(SESSION), 0)
    try:
        asyncio.run(look())
    finally:
        server.close()


def test_a_bag_of_several_actuators_and_a_damaged_one(tmp_path: Path) -> None:
    """One is chosen by its namespace; damage is told, and the rest shown."""
    from actuator_glue.io.bag_records import write_record
    from actuator_glue.io.bag_writer import BagWriter
    from actuator_glue.records import Record

    with BagWriter(tmp_path / 'bag') as writer:
        for i, name in enumerate(('/east', '/west'), start=1):
            record = Record(np.arange(100.0) * i * 1e-3, np.arange(100.0) * i * 1e-4, 1e-3)
            write_record(writer, record, namespace=name)
    with pytest.raises(InputError, match='--namespace'):
        read_bag(tmp_path / 'bag')
    west = read_bag(tmp_path / 'bag', 'west').history
    np.testing.assert_allclose(west.curves(0, 100, 4000).rows[0], np.arange(100) * 2.0)
    file = next((tmp_path / 'bag').glob('*.mcap'))
    file.write_bytes(file.read_bytes()[:-200])
    with pytest.raises(InputError, match='cut off'):
        read_bag(file, 'east')
    told: list[str] = []
    assert read_bag(file, 'east', note=told.append).history.measured_to == 100
    assert told


def test_a_bag_of_other_topics_is_told_how_it_can_be_shown(tmp_path: Path) -> None:
    """What it holds, and the two commands that make it one of ours."""
    from actuator_glue.io.bag_writer import BagWriter
    from actuator_glue.io.messages import message

    with BagWriter(tmp_path / 'bag') as bag:
        bag.add_topic('/command', 'std_msgs/msg/Float64')
        bag.write('/command', message('std_msgs/msg/Float64', data=1.0), 1)
    with pytest.raises(InputError, match=r'/command .*`actuator-glue map .*convert .* --channels'):
        read_bag(tmp_path / 'bag')


def test_who_is_let_in() -> None:
    """Another name, another origin, no origin at the socket, other paths, absurd requests."""

    async def knock() -> None:
        async with aiohttp.ClientSession() as session:
            own = server.url.rstrip('/')
            port = own.rpartition(':')[2]

            async def status(path: str = '/', **headers: str) -> int:
                async with session.get(own + path, headers=headers) as answer:
                    policy = answer.headers.get('Content-Security-Policy', '')
                    assert answer.status != 200 or policy.startswith("default-src 'self';")
                    return answer.status

            assert await status() == 200
            assert await status(Host=f'localhost:{port}') == 200
            assert await status(Host=f'evil.example:{port}') == 403
            assert await status(Host='127.0.0.1:1') == 403
            assert await status(Origin='http://evil.example') == 403
            assert await status('/socket') == 403
            for path in ('/page.py', '/../server.py', '/%2e%2e/server.py', '/assets/page.js'):
                assert await status(path) == 404
            with pytest.raises(aiohttp.WSServerHandshakeError):
                await session.ws_connect(own + '/socket', origin='http://evil.example')
            for absurd in ('{}', 'x' * 5000):
                async with session.ws_connect(own + '/socket', origin=own) as socket:
                    await socket.send_str(absurd)
                    while (await socket.receive()).type == aiohttp.WSMsgType.BINARY:
                        pass
                    assert socket.close_code in (1008, 1009)

    server = PageServer(intake(1.0), 0)
    try:
        asyncio.run(knock())
        with pytest.raises(InputError, match='choose another'):
            PageServer(intake(1.0), int(server.url.rstrip('/').rpartition(':')[2]))
    finally:
        server.close()


def test_a_frame_that_fails_is_told_and_closes_the_socket(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """An open page would stand still for ever; this one connects anew, and goes on."""
    live = intake(1.0)
    server = PageServer(live, 0)
    own = server.url.rstrip('/')

    async def look() -> None:
        async with aiohttp.ClientSession() as session:
            async with session.ws_connect(own + '/socket', origin=own) as socket:
                assert (await socket.receive(timeout=60.0)).type == aiohttp.WSMsgType.BINARY
                with monkeypatch.context() as broken:
                    broken.setattr(live.history, 'curves', None)
                    feed(live, 1000, 50)
                    while (await socket.receive(timeout=60.0)).type == aiohttp.WSMsgType.BINARY:
                        pass
                assert socket.close_code == 1011
            async with session.ws_connect(own + '/socket', origin=own) as socket:
                assert (await socket.receive(timeout=60.0)).type == aiohttp.WSMsgType.BINARY

    try:
        asyncio.run(look())
    finally:
        server.close()
    assert capfd.readouterr().err.count('a frame could not be made') == 1


@browser
@pytest.mark.slow
@pytest.mark.timeout(2 * 60 * MINUTES + 300)
def test_a_page_that_stays_open_is_up_to_date_and_does_not_grow() -> None:
    """Frames for MINUTES: their rate; memory of browser and server, measured while none arrive."""

    async def look() -> None:
        async with Browser() as page:
            await page.call('Network.disable')
            await page.open(url)
            await page.until('document.body.dataset.frames > 5')
            rates, used, own = [], [], []
            for _ in range(SPELLS):
                first = int(await page.value('document.body.dataset.frames'))
                begin = time.monotonic()
                await asyncio.sleep(60.0 * MINUTES / SPELLS)
                frames = int(await page.value('document.body.dataset.frames')) - first
                rates.append(frames / (time.monotonic() - begin))
                await page.value("document.getElementById('run').click()")
                await asyncio.sleep(1.0)
                for _ in range(3):
                    await page.call('HeapProfiler.collectGarbage')
                used.append((await page.call('Runtime.getHeapUsage'))['usedSize'] / 1e6)
                own.append(anonymous())
                await page.value("document.getElementById('run').click()")
                memory = f'browser {used[-1]:.3f} MB, server {own[-1]:.2f} MB'
                print(f'{rates[-1]:.2f} frames/s, {memory}', flush=True)
            print(f'median {np.median(rates):.2f} frames/s, least {min(rates):.2f}')
            for name, memory in (('browser', used), ('server', own)):
                later = memory[SPELLS // 3 :]
                slope = np.polyfit(np.arange(len(later)), later, 1)[0] * 60.0 * SPELLS / MINUTES
                print(f'{name}: {slope:+.2f} MB per hour')
                assert slope < 2.0, name
            assert np.median(rates) > 10.0  # 20 where the computer has nothing else to do

    with Live() as url:
        asyncio.run(look())


def anonymous() -> float:
    """Return the memory of this process that is no file's [MB]."""
    status = Path('/proc/self/status').read_text()
    return int(status.partition('RssAnon:')[2].split()[0]) / 1024.0
