"""A client of `vrg mcp`, as a coding agent has one: it starts the command, and calls tools over its pipes."""

import json
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mcp import Client, StdioServerParameters
from mcp.types import CallToolResult

SMALL = """\
name = "small"
game = "sharks-and-minnows"
map = "open"
lasers = false

[rules]
x = [-10.0, 10.0]
y = [-7.0, 7.0]
zone_depth = 2.0
passes = 1
slowest = 1.0
lineup = "place"

[[players]]
name = "shark"
role = "shark"
motion = { v_max = 0.6 }
x = 0.0
y = -6.0
heading = 90.0

[[players]]
name = "minnow"
role = "minnow"
x = 0.0
y = 6.0
heading = -90.0
"""
"""A match that takes a fraction of a second: the built-in shark is slow, and still catches the built-in minnow."""


@dataclass
class Agent:
    """A client that counts its calls.

    Attributes:
        calls: the number of calls so far.
    """

    client: Client
    calls: int = field(default=0)

    async def ask(self, tool: str, **arguments: Any) -> dict[str, Any]:
        """Call a tool, and return the object of its answer, with `wrong` and the number of `pictures`."""
        self.calls += 1
        return answer_of(await self.client.call_tool(tool, arguments))


def answer_of(result: CallToolResult) -> dict[str, Any]:
    """The object of an answer, with `wrong` and the number of `pictures`."""
    words, *pictures = result.content
    assert words.type == "text"
    found = json.loads(words.text) if words.text.startswith("{") else {"answer": words.text}
    return {**found, "wrong": bool(result.is_error), "pictures": len(pictures)}


@asynccontextmanager
async def agent(folder: Path, *options: str) -> AsyncIterator[Agent]:
    """An agent with a server of its own, in a folder whose match `small` may be played."""
    match = folder / "small.toml"
    match.write_text(SMALL, encoding="utf-8")
    arguments = ["-P", "-m", "vrg", "mcp", str(folder / "players"), "--match", str(match), *options]
    async with Client(StdioServerParameters(command=sys.executable, args=arguments, cwd=folder)) as client:
        yield Agent(client)
