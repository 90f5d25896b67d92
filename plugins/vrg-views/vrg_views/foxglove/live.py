"""Sends what a recorder writes to Foxglove as it happens, through the WebSocket server of the Foxglove SDK.

Viewers can only read: the server offers them nothing else.
"""

import math
from collections import deque
from pathlib import Path
from typing import Final

import foxglove
import msgspec
from foxglove.websocket import Capability, ChannelView, Client, ServerListener, WebSocketServer
from msgspec import Struct

from vrg.recording.recorder import Recorder
from vrg.recording.schemas import json_schema, schema_name

PORT: Final = 8765
"""The port at which Foxglove looks for a server."""


class LiveServer:
    """A sink that serves viewers in place of a file; see `vrg.recording.sink.Sink`.

    Who begins to watch late gets the newest message of each topic at once: what changes seldom, such as the map, is not
    sent again. The SDK drops the oldest messages of a viewer that is too slow.

    Args:
        name: the name of the match. host: the address to listen on. port: its port.

    Raises:
        OSError: it cannot listen there.
    """

    def __init__(self, name: str, host: str, port: int) -> None:
        self.path: Path | None = None
        self._context = foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self._newest: dict[str, tuple[bytes, int]] = {}
        self._encode = msgspec.json.Encoder().encode
        self._listener = _Listener()
        foxglove.set_log_level("WARN")
        try:
            self._server: WebSocketServer = foxglove.start_server(
                name=f"VRG: {name}", host=host, port=port, capabilities=[Capability.Time],
                server_listener=self._listener, context=self._context,
            )  # fmt: skip
        except RuntimeError as error:
            raise OSError(f"no server for Foxglove at {host}:{port}: {error}") from error

    def write(self, topic: str, record: Struct, stamp: float, sequence: int) -> None:
        """Send a message; see `vrg.recording.mcap_file.McapFile.write`."""
        channel = self._channels.get(topic)
        if channel is None:
            kind = type(record)
            schema = foxglove.Schema(name=schema_name(kind), encoding="jsonschema", data=json_schema(kind))
            channel = self._channels[topic] = foxglove.Channel(
                topic, message_encoding="json", schema=schema, context=self._context
            )
        self._newest[topic] = self._encode(record), round(stamp * 1e9)
        channel.log(self._newest[topic][0], log_time=self._newest[topic][1])
        self._server.broadcast_time(self._newest[topic][1])

    def flush(self) -> None:
        """Send the newest message of each topic that a viewer has begun to watch."""
        while self._listener.topics:
            topic = self._listener.topics.popleft()
            if topic in self._newest:
                data, at = self._newest[topic]
                self._channels[topic].log(data, log_time=at)

    def finish(self) -> None:
        """Stop the server."""
        self._server.stop()

    def abandon(self) -> None:
        """Stop the server."""
        self._server.stop()


class _Listener(ServerListener):
    """Notes what viewers begin to watch; threads of the server call it."""

    def __init__(self) -> None:
        self.topics: deque[str] = deque()

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        self.topics.append(channel.topic)


class LiveRecorder(Recorder):
    """A recorder whose records go to Foxglove. It is a window: it may hear what windows hear, and no more."""

    kind = "spectator"
    linger = math.inf
    """Viewers stay connected until the match ends."""
