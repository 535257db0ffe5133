"""The page of the running nodes."""

import asyncio

import aiohttp
import numpy as np
import pytest

from actuator_glue.cli.main import main


def test_the_page_shows_what_is_published(start, probe):
    viewer = start('viewer', port=0)
    probe.until(lambda: str(probe.value('viewer', 'page', '')).startswith('http'))
    url = probe.value('viewer', 'page').rstrip('/')
    probe.open_stream()
    probe.setup(stiffness=250e3)
    rng = np.random.default_rng(0)
    for _ in range(20):
        probe.block(*rng.standard_normal((2, 100)) * 1e-3)
        probe.for_a_while(0.02)
    probe.until(lambda: float(probe.value('viewer', 'messages', 0)) >= 21)

    async def look():
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(f'{url}/socket', origin=url) as socket,
        ):
            return await socket.receive_bytes()

    data = asyncio.run(look())
    assert b'"live": true' in data
    assert b'"stiffness": 250000.0' in data
    assert viewer.end() == 0


def test_live_without_ros_is_a_plain_error(monkeypatch, capsys):
    monkeypatch.setattr('importlib.util.find_spec', lambda _: None)
    assert main(['view', '--live']) == 2
    assert 'rclpy is not found' in capsys.readouterr().err


@pytest.mark.parametrize('arguments', [(), ('bag', '--live'), ('bag', '--port', '70000')])
def test_arguments_that_do_not_fit(arguments, capsys):
    assert main(['view', *arguments]) == 2
    assert capsys.readouterr().err.startswith('actuator-glue: ')
