"""Foxglove's server: what a viewer of its WebSocket protocol gets, and what it cannot do."""

import asyncio
import json
import os
import socket
import struct
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any, cast

import aiohttp
import pytest

from vrg.bus.mailbox import Mailbox
from vrg.bus.session import Session
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys
from vrg.config.loading import load_match, match_path
from vrg.launch.context import NodeContext
from vrg.launch.process import Process
from vrg.runs.run_folder import RunFolder
from vrg.testing.views import synthetic
from vrg_views.foxglove.live import LiveRecorder, LiveServer
from vrg_views.foxglove.node import foxglove

PATIENCE = 60.0


@pytest.fixture
def port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        number: int = probe.getsockname()[1]
        return number


@pytest.fixture
def server(port: int) -> Iterator[LiveServer]:
    server = LiveServer("final", "127.0.0.1", port)
    yield server
    server.finish()


class Viewer:
    """Speaks Foxglove's protocol, and subscribes to everything."""

    def __init__(self, socket_: aiohttp.ClientWebSocketResponse) -> None:
        self._socket = socket_
        self.channels: dict[int, dict[str, Any]] = {}
        self.heard: dict[str, list[Any]] = {}
        self.said: list[dict[str, Any]] = []

    async def until(self, condition: Callable[[], bool], meanwhile: Callable[[], None] = lambda: None) -> None:
        """Wait until a condition holds."""
        async with asyncio.timeout(PATIENCE):
            while not condition():
                meanwhile()
                await asyncio.sleep(0.01)

    async def listen(self) -> None:
        """Take messages in until the connection is closed."""
        async for message in self._socket:
            await self._take(message)

    async def say(self, **message: Any) -> None:
        await self._socket.send_json(message)

    async def _take(self, message: aiohttp.WSMessage) -> None:
        if message.type is aiohttp.WSMsgType.BINARY:
            if message.data[0] == 1:  # message data: subscription, time in ns, payload
                (number,) = struct.unpack_from("<I", message.data, 1)
                topic = self.channels[number]["topic"]
                self.heard.setdefault(topic, []).append(json.loads(message.data[13:]))
            return
        said = json.loads(message.data)
        self.said.append(said)
        if said["op"] == "advertise":
            self.channels |= {channel["id"]: channel for channel in said["channels"]}
            wanted = [{"id": channel["id"], "channelId": channel["id"]} for channel in said["channels"]]
            await self.say(op="subscribe", subscriptions=wanted)


def watch(port: int, what: Callable[[Viewer], Awaitable[None]]) -> None:
    """Do something as a viewer."""

    async def run() -> None:
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(f"ws://127.0.0.1:{port}", protocols=("foxglove.sdk.v1",)) as connected,
        ):
            viewer = Viewer(connected)
            listening = asyncio.create_task(viewer.listen())
            await what(viewer)
            listening.cancel()

    asyncio.run(run())


def test_a_viewer_can_change_nothing(server: LiveServer, port: int) -> None:
    async def meddle(viewer: Viewer) -> None:
        await viewer.until(lambda: any(said["op"] == "serverInfo" for said in viewer.said))
        info = next(said for said in viewer.said if said["op"] == "serverInfo")
        assert info["capabilities"] == ["time"]
        assert info["name"] == "VRG: final"
        await viewer.say(op="advertise", channels=[{"id": 1, "topic": "/x", "encoding": "json", "schemaName": ""}])
        await viewer.until(lambda: any("does not support" in said.get("message", "") for said in viewer.said))

    watch(port, meddle)


def test_a_recorder_shows_a_match_as_it_happens_and_who_comes_late_its_newest_messages(port: int) -> None:
    keys = Keys("test")
    recorder = LiveRecorder("foxglove", Mailbox(), keys, lambda: LiveServer("test", "127.0.0.1", port))
    match = synthetic.SyntheticMatch(keys)
    ticks = iter(range(10_000))

    def play() -> None:
        tick = next(ticks)
        match.step(recorder, tick / 10, tick)

    for _ in range(10):
        play()

    async def look(viewer: Viewer) -> None:
        wanted = {"/view/scene", "/view/field", "/referee/state", "/view/calls", "/poses"}
        await viewer.until(lambda: wanted <= set(viewer.heard), play)
        assert viewer.heard["/view/scene"][-1]["entities"]
        assert viewer.heard["/view/field"][0]["entities"], "it was written before the viewer came"
        assert viewer.heard["/clock"][0]["time"] >= 0.9, "and it has missed the first ones"
        (channel,) = [channel for channel in viewer.channels.values() if channel["topic"] == "/poses"]
        assert (channel["encoding"], channel["schemaName"]) == ("json", "vrg.Poses")
        assert json.loads(channel["schema"])["type"] == "object"

    try:
        watch(port, look)
        assert recorder.kind == "spectator", "it hears what a window may hear"
    finally:
        recorder.stop()


def test_a_port_that_another_program_has_ends_nothing_but_this(server: LiveServer, port: int) -> None:
    keys = Keys("test")
    recorder = LiveRecorder("foxglove", Mailbox(), keys, lambda: LiveServer("test", "127.0.0.1", port))
    synthetic.SyntheticMatch(keys).step(recorder, 0.0, 0)
    assert recorder.fault is not None
    assert f"127.0.0.1:{port}" in recorder.fault


def test_one_that_is_opened_beside_that_of_the_match_has_another_name(tmp_path: Path) -> None:
    setup = load_match(match_path("practice"))

    def name(*, launched: bool) -> str:
        context = NodeContext(
            process=Process(name="foxglove", kind="foxglove", node="127.0.0.1:0"), setup=setup,
            folder=RunFolder(tmp_path),
            session=cast(Session, None), stop=cast(Stop, None), official=True, own=launched, secret="",
        )  # fmt: skip
        return foxglove(context).node.name

    assert name(launched=True) == "foxglove"
    assert name(launched=False) == f"foxglove-{os.getpid()}"
