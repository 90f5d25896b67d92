"""The commands `vrg node KIND`: each runs one process of a match."""

import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated

import typer

from vrg.bus.session import DEFAULT_ENDPOINT
from vrg.commands.groups import MatchOptions
from vrg.commands.matches import attached
from vrg.commands.options import (
    GameArgument,
    KeysOption,
    LeashOption,
    ListenOption,
    PlayerArgument,
    RouterOption,
    RunOption,
    exit_if_interrupted,
)
from vrg.config.targets import whole_target
from vrg.errors import ConfigError, LaunchError
from vrg.kinds import KINDS, PLAYER, ROUTER, TRACKER, Kind, Opening
from vrg.launch.process import by_hand
from vrg.launch.process_main import child_process, is_sealed, serve, serve_router
from vrg.launch.sandbox.variables import start_with_named_variables
from vrg.registry import expected_one_of, load_object, loaded
from vrg.system import POSIX


@dataclass(frozen=True)
class NodeOptions:
    """The match file of a process, and its place in the match."""

    match: GameArgument
    router: RouterOption = None
    run: RunOption = None
    keys: KeysOption = None


def router(
    match: Annotated[
        str | None, typer.Argument(metavar="[GAME|match.toml]", help="The match whose seats may connect; needs --keys.")
    ] = None,
    endpoint: RouterOption = None,
    upstream: Annotated[str | None, typer.Option(metavar="ENDPOINT", help="Another router to link with.")] = None,
    keys: KeysOption = None,
    leash: LeashOption = False,
) -> None:
    """Serve as the router that all processes of a match connect to. With keys, it admits only seats."""
    at = endpoint or DEFAULT_ENDPOINT
    if match is None:
        if keys is not None:
            raise ConfigError(
                f"expected the match file whose seats have the keys in {keys}, got none: run `vrg node router "
                f"match.toml --keys {keys}`; a router that admits everybody needs neither --keys nor VRG_KEYS"
            )
        exit_if_interrupted(serve_router(at, upstream=upstream, leash=leash))
        return
    from vrg.config.loading import load_match, match_path  # a router without seats needs no match file

    if keys is None:
        raise ConfigError("expected the folder of the match's keys, with --keys or in VRG_KEYS: see `vrg keys init`")
    setup = load_match(match_path(match))
    exit_if_interrupted(serve_router(at, upstream=upstream, setup=setup, keys=keys, leash=leash))


def _serve(kind: Kind, on: NodeOptions, name: str = "", strategy: str | None = None) -> None:
    """Read the match file and run the node until it is stopped."""
    from vrg.config.loading import load_match, match_path  # the router needs no match file

    setup, at = load_match(match_path(on.match)), on.router or DEFAULT_ENDPOINT
    if kind.plays:
        setup.player(name)
    if kind is TRACKER and name not in setup.trackers:
        raise ConfigError([f"{name}: {expected_one_of(setup.trackers, name)}"])
    if strategy is not None:
        setup = setup.substituted(name, whole_target(strategy))
    keys = on.keys if at.startswith("tls/") else None
    if kind.plays and is_sealed(setup, name, seats=keys is not None):
        start_with_named_variables()
    exit_if_interrupted(serve(by_hand(kind, name, at, run=on.run, keys=keys), setup))


def player(
    name: PlayerArgument,
    on: NodeOptions,
    strategy: Annotated[
        str | None, typer.Option(help="Strategy in place of the match file's, such as mine.py:Mine.")
    ] = None,
) -> None:
    """Run one player with its robot. A running match accepts it unless another process already plays for it."""
    # A process with threads cannot be sealed, and the library of numpy, which reads match files, starts some.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    _serve(PLAYER, on, name, strategy)


def host() -> None:
    """Supervise processes of a match on this machine; `vrg play` starts it by ssh on the machines of a match."""
    if sys.stdin.isatty():
        raise SystemExit("`vrg play` starts vrg node host itself, on the machines that a match file names")
    import platformdirs  # only this process of them has a place of its own

    if not POSIX:
        raise LaunchError("a machine with Windows cannot take part in a match over several machines")
    from vrg.launch.remote.agent import HostAgent
    from vrg.launch.remote.channel import Channel
    from vrg.launch.remote.wire import Frames, ToAgent

    # Text that is printed by mistake goes to the log, not between the frames.
    reader, writer = os.dup(0), os.dup(1)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    frames: Frames[ToAgent] = Frames(ToAgent)  # type: ignore[arg-type]  # a union
    home = platformdirs.user_state_path("vrg") / "hosted"
    with child_process(leash=False) as stop:
        HostAgent(Channel(reader, writer, frames), home, stop).run()


def strategy() -> None:
    """Let the strategy of a player decide on this machine; `vrg play --lockstep` starts it by ssh."""
    if sys.stdin.isatty():
        raise SystemExit("`vrg play --lockstep` starts vrg node strategy itself, on the machines of a match file")
    start_with_named_variables()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # a process with threads cannot be sealed
    from vrg.playing.elsewhere import serve

    raise SystemExit(serve())


def command_of(name: str) -> Callable[..., None]:
    """The command that runs a process of a kind.

    Raises:
        ConfigError: there is no such kind, or it cannot be imported.
    """
    own: Mapping[str, Callable[..., None]] = {
        ROUTER.name: router,
        PLAYER.name: player,
        "strategy": strategy,
        "host": host,
    }
    if name in own:
        return own[name]
    if name == "drives":
        return load_object("vrg.commands.drives:drives")  # type: ignore[no-any-return]
    kind = KINDS.get(name)
    kind.check_needs()

    def unnamed(on: NodeOptions) -> None:
        _serve(kind, on)

    def named(name: Annotated[str, typer.Argument(metavar=kind.named.upper())], on: NodeOptions) -> None:
        _serve(kind, on, name)

    def view(on: MatchOptions, listen: ListenOption = None) -> None:
        found = attached(on)
        secured = not found.endpoint.startswith("tcp/")
        opening: Opening = loaded(kind.opens, kind.name)(found.known_setup(), listen, secured=secured)
        typer.echo(opening.words(found.endpoint))
        found.serve(kind, opening.name)

    view.__doc__ = f"Run this beside a running match: {kind.about}."
    command: Callable[..., None] = load_object(kind.command) if kind.command else named if kind.named else unnamed
    return view if kind.opens and not kind.command else command
