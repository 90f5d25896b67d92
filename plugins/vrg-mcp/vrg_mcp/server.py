"""The tools of a coding agent, and the server that offers them over the standard input and output."""

import functools
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

from mcp.server import MCPServer
from mcp.server.mcpserver.context import Context
from mcp.server.mcpserver.exceptions import ToolError, UnexpectedToolError
from mcp.types import CallToolResult, InputRequiredResult, ToolAnnotations
from pydantic import Field, ValidationError, WithJsonSchema

from vrg import __version__
from vrg.commands.matches import run_folders
from vrg.errors import VrgError
from vrg.games import strategies_of
from vrg.hal.sim.maps import MAPS
from vrg.registry import expected_one_of
from vrg.tables import problems_of
from vrg_mcp import knowledge
from vrg_mcp.answers import CODE, fault, known, number, quoted, shown, told
from vrg_mcp.jobs import Jobs
from vrg_mcp.knowledge import Match
from vrg_mcp.players import PlayerFolder
from vrg_mcp.work import KEPT, WorkError

log = logging.getLogger(__name__)

Tool = Callable[..., Awaitable[CallToolResult]]

GAMES: Final = 200
"""The most games of a comparison."""
SECONDS: Final = 600.0
"""The longest match time of a game, s."""
CHECK: Final = 20.0
"""The match time for which a check plays, s."""

PlayerName = Annotated[str, Field(description="The name of a file of list_folder, such as ann.py.")]
FileName = Annotated[str, Field(description="Such as ann.py: letters, digits and _, without a folder.")]
Code = Annotated[str, Field(description="Python: one class, made from Strategy, with act(self, view).")]
StrategyName = Annotated[str, Field(description="A file such as ann.py, or the name of a built-in strategy.")]
# Some clients take no `additionalProperties`, by which the schema of such a table says what its values are.
ByTeam = Annotated[
    dict[str, str],
    WithJsonSchema({"type": "object", "description": 'Strategies by team, such as {"minnows": "ann.py"}.'}),
]
MatchName = Annotated[str, Field(description="The name of a match, as list_games has it.")]
MapName = Annotated[str, Field(description="The name of a map, as list_games has it.")]
RunName = Annotated[str, Field(description="The name of a run, as list_folder has it.")]
Call = Annotated[int, Field(description="The number of a call, as read_run has it.")]
Games = Annotated[int, Field(description="The most games, 2 to 200.")]
Seconds = Annotated[float, Field(description="Match time, s: at most 120 alone, and 600 in a match.")]
Seed = Annotated[int, Field(description="0 to 1000000; the same seed gives the same game.")]
Topic = Annotated[str, Field(description="view, first (a small player), example (a whole one), helpers.")]


@dataclass
class Tools:
    """The tools; each method without `_` is one, and its docstring is what the agent reads.

    Args:
        _folder: of the players. _matches: those that may be played, by name. _jobs: does the work.
    """

    _folder: PlayerFolder
    _matches: Mapping[str, Match]
    _jobs: Jobs | None = None

    async def list_games(self) -> CallToolResult:
        """List the games with their teams, built-in strategies and matches, and the maps. Begin here."""
        return told("The games:", "read_rules of a match", games=knowledge.games(self._matches), maps=MAPS.names())

    async def read_rules(self, match: MatchName) -> CallToolResult:
        """Read the rules of a match: what is called, who wins, sizes in m, times in s, and where players begin."""
        return told("The rules:", "read_api with topic view", **knowledge.rules(self._match(match)))

    async def read_api(self, topic: Topic = "view") -> CallToolResult:
        """Read what a player is shown (a View) and may return, code to begin with, or functions to build with."""
        text = knowledge.TOPICS[known("topic", topic, [*knowledge.TOPICS])]()
        return told("By the code of VRG:", "read_api with topic first, or example; then write_player", text=text)

    async def list_folder(self) -> CallToolResult:
        """List the players that were written, and the runs, the newest first."""
        return told("The folder:", "read_player, read_run", players=self._folder.names(), runs=self._runs())

    async def read_player(self, file: PlayerName) -> CallToolResult:
        """Read the code of a player."""
        return told("See `quoted`.", "write_player", {"code": quoted(self._folder.read(file), CODE)})

    async def write_player(self, file: FileName, code: Code) -> CallToolResult:
        """Write the code of a player into the folder, also over an earlier one. It is not run: check_player does."""
        new = self._folder.write(file, code)
        return told(f"{file} was {'written' if new else 'replaced'}.", "check_player")

    async def check_player(self, file: PlayerName, match: MatchName) -> CallToolResult:
        """Import a player sealed, and let it play 20 s for all teams; faults come with file and line."""
        players = dict.fromkeys(knowledge.teams_of(self._match(match)), str(self._folder.path_of(file)))
        found = await self._run("play", **self._of(match), players=players, seed=0, seconds=CHECK)
        drove, faults = {p["name"]: p["drove_m"] for p in found["players"]}, found["faults_in_all"]
        after = "fix the faults in `quoted`" if faults else "play_match against a built-in strategy"
        return told(f"It played with {faults} faults.", after, _quotes(found), wrong=faults > 0, drove_m=drove)

    async def practice(self, file: PlayerName, seconds: Seconds = 20.0, map: MapName = "open") -> CallToolResult:
        """Let a player drive alone on a map, without zones or rules: its places (s, m, m, rad) and its prints."""
        time, place = number("seconds", seconds, 1.0, 120.0), known("map", map, MAPS.names())
        found = await self._run("practice", player=str(self._folder.path_of(file)), map_=place, seconds=time)
        return told("It drove alone.", "play_match", _quotes(found), run=found["run"], players=found["players"])

    async def play_match(
        self, match: MatchName, strategies: ByTeam, seed: Seed = 0, seconds: Seconds = SECONDS
    ) -> CallToolResult:
        """Play one game; teams that are not named play with their built-in strategy. The game is recorded as a run."""
        teams, time = knowledge.teams_of(self._match(match)), number("seconds", seconds, 1.0, SECONDS)
        players = {known("team", team, teams): self._strategy(name, match) for team, name in strategies.items()}
        seed = int(number("seed", seed, 0, 1_000_000))
        found = await self._run("play", **self._of(match), players=players, seed=seed, seconds=time)
        after = "why or picture of this run; compare, as one game proves nothing"
        return told("It was played." if found.get("over") else "It was broken off.", after, _quotes(found), **found)

    async def compare(
        self, first: StrategyName, second: StrategyName, match: MatchName, games: Games = 40, seed: Seed = 0
    ) -> CallToolResult:
        """Find out which strategy is better: games in pairs with the sides swapped, until a 95 % interval decides.

        A call plays for up to 50 s; the same call again goes on. 16 games are enough if one wins them all.
        """
        found = await self._run(
            "compare", **self._of(match), first=self._strategy(first, match), second=self._strategy(second, match),
            games=int(number("games", games, 2, GAMES)), seed=int(number("seed", seed, 0, 1_000_000)),
        )  # fmt: skip
        more = found.pop("interrupted") and found["result"] == "undecided"
        after = "the same call again, which continues" if more else "change one thing and compare again, or stop here"
        return told(f"{first} is {found['result']} against {second}.", after, _quotes(found), **found)

    async def read_run(self, run: RunName) -> CallToolResult:
        """Read the result of a run, its calls, and what failed or was printed."""
        found = await self._run("look", run=self._run_path(run))
        return told("The run:", "why with the number of a call, or picture", _quotes(found), **found)

    async def why(self, run: RunName, call: Call) -> CallToolResult:
        """Learn why the referee made a call: the rule, who was where, the number that decided, and a picture."""
        found = await self._run("why", run=self._run_path(run), call=int(number("call", call, 1, 1e9)))
        return told(found.pop("why", "See `quoted`."), "picture of another instant", _quotes(found), **found)

    async def picture(self, run: RunName, time: float) -> CallToolResult:
        """See the field of a run at a match time, s: a PNG, and the robots as name, role, state, x and y (m)."""
        found = await self._run("picture", run=self._run_path(run), seconds=number("time", time, 0.0, 1e6))
        return told("The field:", "another time, or why with a call", **found)

    async def decide(self, action: Literal["halt", "resume", "end"], reason: str) -> CallToolResult:
        """As an official, halt, resume or end the match that runs on this machine; physical robots are not resumed."""
        return told("The referee:", "", await self._run("decide", action=action, reason=quoted(reason, 100)))

    async def _run(self, kind: str, **arguments: object) -> dict[str, Any]:
        assert self._jobs is not None, "the server has not begun"
        return await self._jobs.run(kind, runs=str(self._folder.runs), **arguments)

    def _match(self, name: str) -> Match:
        return self._matches[known("match", name, [*self._matches])]

    def _of(self, name: str) -> dict[str, object]:
        return {"match": str(self._match(name).path), "named": self._match(name).named}

    def _strategy(self, name: str, match: str) -> str:
        """A strategy as VRG takes it: the name of one of the game, or the path of a file of the folder."""
        built_in = strategies_of(self._match(match).game)
        known("strategy", name, [*built_in, *self._folder.names()])
        return name if name in built_in else str(self._folder.path_of(name))

    def _runs(self) -> list[str]:
        return [path.name for path in run_folders(self._folder.runs)][:KEPT]

    def _run_path(self, name: str) -> str:
        return str(self._folder.runs / known("run", name, self._runs()))


def _quotes(found: dict[str, Any]) -> dict[str, object]:
    """Take what came from code out of an answer."""
    return {name: found.pop(name, None) for name in ("faults", "prints", "sentence", "by_code")}


def _answering(tool: Tool) -> Tool:
    """The same tool, whose errors are answers: what was expected, what came, and what to do."""

    @functools.wraps(tool)
    async def answer(**arguments: object) -> CallToolResult:
        try:
            return await tool(**arguments)
        except WorkError as error:
            return told("it could not be done", "read `quoted`", {"faults": [fault(str(error))]}, wrong=True)
        except VrgError as error:
            return told(str(error), wrong=True)

    return answer


class Server(MCPServer[None]):
    """A server that refuses a call by an answer in our words, whatever is wrong with it."""

    async def call_tool(
        self, name: str, arguments: dict[str, Any], context: Context[None, Any] | None = None
    ) -> CallToolResult | InputRequiredResult:
        """Call a tool. An argument that is null is one that was left out, as many clients write it."""
        given = {key: value for key, value in arguments.items() if value is not None}
        try:
            return await super().call_tool(name, given, context)
        except UnexpectedToolError as error:
            log.exception("the tool %s has failed", name)
            why = f"{type(error.__cause__).__name__}: {error.__cause__}"
            words = "it failed because of a mistake in VRG, not in the call: another call may still work"
            return told(words, "read `quoted`, and tell the person", {"faults": [fault(why)]}, wrong=True)
        except ToolError as error:
            if isinstance(error.__cause__, ValidationError):
                return told("; ".join(map(str, problems_of(error.__cause__))), wrong=True)
            names = [tool.name for tool in await self.list_tools()]
            return told(f"tool: {expected_one_of(names, shown(name))}", wrong=True)


def server_of(folder: PlayerFolder, matches: Mapping[str, Match], *, official: bool) -> Server:
    """The server of these tools; it is not started.

    Args:
        folder: of the players. matches: those that may be played. official: True adds the tool of an official.
    """
    tools = Tools(folder, matches)

    @asynccontextmanager
    async def begun(_: MCPServer[None]) -> AsyncIterator[None]:
        tools._jobs = Jobs()
        try:
            yield
        finally:
            tools._jobs.close()

    about, version = knowledge.text("about"), __version__
    server = Server("vrg", instructions=about, version=version, lifespan=begun, log_level="ERROR")
    for name in (name for name in vars(Tools) if not name.startswith("_") and (official or name != "decide")):
        reads = name.startswith(("list", "read", "why", "picture"))
        hints = ToolAnnotations(read_only_hint=reads, destructive_hint=name == "decide", open_world_hint=False)
        server.add_tool(_answering(getattr(tools, name)), annotations=hints, structured_output=False)
    return server
