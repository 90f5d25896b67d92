"""The commands `vrg play`, which plays a match, and `vrg check`, which checks a match file."""

from pathlib import Path
from typing import Annotated

import typer

from vrg.commands.options import (
    EngineOption,
    GameArgument,
    HeadlessOption,
    InProcessOption,
    KeysOption,
    ListenOption,
    RateOption,
    RecordOption,
    RunsOption,
    SandboxOption,
    SeedOption,
    ThreeOption,
    web_address,
)
from vrg.launch.fork_server import fork_server

DryRunOption = Annotated[
    bool, typer.Option("--dry-run", help="Print which process would run on which machine; start nothing.")
]
HereOption = Annotated[
    bool, typer.Option("--here", help="Run everything on this machine, whatever the match file names.")
]
SeatsOption = Annotated[
    bool | None,
    typer.Option("--seats/--no-seats", help="Let only seats with keys in; the default is the match file's."),
]
WebOption = Annotated[bool, typer.Option("--web", help="Show it in browsers too; --listen does so for other machines.")]
FoxgloveOption = Annotated[
    bool, typer.Option("--foxglove", help="Let Foxglove on this machine connect, and show all that is recorded.")
]
DeveloperOption = Annotated[
    bool, typer.Option("--developer", help="Open the developers' view in place of the spectator's window.")
]


def check(match: GameArgument) -> None:
    """Say whether a match file can be played, or what is wrong with it."""
    from vrg.config.loading import (  # `vrg play` must start quickly
        check_strategies,
        idle_machines,
        load_match,
        match_path,
        unproved_properties,
    )
    from vrg.config.rules import rulebook_of
    from vrg.launch.trial import trial, untried

    setup = load_match(match_path(match))
    with trial() as tried:
        check_strategies(setup, tried.make)
    book = rulebook_of(setup)
    rounds = "1 round" if book.rounds == 1 else f"{book.rounds} rounds"
    players = f"{len(setup.players)} players"
    typer.echo(f"{match}: good: {setup.game}, {players}, {rounds}, map {setup.map}")
    for remark in unproved_properties(setup):
        typer.echo(f"not proved: {remark}")
    for note in filter(None, (idle_machines(setup), untried())):
        typer.echo(f"note: {note}")


def play(
    match: GameArgument,
    in_process: InProcessOption = False,
    engine: EngineOption = None,
    rate: RateOption = None,
    seed: SeedOption = None,
    headless: HeadlessOption = False,
    runs: RunsOption = Path("runs"),
    record: RecordOption = True,
    here: HereOption = False,
    dry_run: DryRunOption = False,
    seats: SeatsOption = None,
    keys: KeysOption = None,
    sandbox: SandboxOption = None,
    web: WebOption = False,
    listen: ListenOption = None,
    developer: DeveloperOption = False,
    foxglove: FoxgloveOption = False,
    three: ThreeOption = False,
) -> None:
    """Play a match, show it, and say who won and where the run is recorded."""
    speed = rate_of(rate, in_process)
    if in_process and (seats or sandbox):
        raise typer.BadParameter(
            f"{'--seats' if seats else '--sandbox'} needs processes: a match in one process has no seats and no "
            "sandboxes; leave --in-process out"
        )
    if in_process and (web or listen or foxglove or three):
        raise typer.BadParameter(
            f"{'--foxglove' if foxglove else '--3d' if three else '--web'} needs processes: a match in one process "
            "serves no one; leave --in-process out"
        )
    if in_process and developer:
        raise typer.BadParameter("--developer needs processes: `vrg play` without --in-process has them")
    address = web_address(listen) if web or listen else None
    # The fork server loads what the match's processes need while this process loads the code that checks match files.
    with fork_server(wanted=not (in_process or dry_run)) as server:
        from vrg.commands.playing import PlayOptions, play_match

        wish = PlayOptions(
            in_process=in_process,
            paced=rate not in (None, "max"),
            window=not headless,
            record=record,
            here=here or in_process,
            dry=dry_run,
            seats=seats,
            keys=keys if seats is not False else None,
            sandbox=sandbox,
            web=address,
            developer=developer,
            foxglove=foxglove,
            three=three,
        )
        again = play_match(match, runs, wish, server, engine=engine, seed=seed, rate=speed)
    if again is not None:
        from vrg.commands.replay import replay_window
        from vrg.ui.replay import show

        show(replay_window(*again, runs=runs))


def rate_of(rate: str | None, one_process: bool) -> float | None:
    """The rate that was typed as a number; None if none was typed, or for `max`.

    Raises:
        typer.BadParameter: it makes no sense.
    """
    if rate is None or rate == "max":
        if rate == "max" and not one_process:
            raise typer.BadParameter(
                "max needs --in-process: processes are paced by the match clock", param_hint="--rate"
            )
        return None
    try:
        value = float(rate)
    except ValueError:
        value = -1.0
    if not 0.1 <= value <= 100:
        raise typer.BadParameter(f"expected 0.1 to 100 or max, got {rate!r}", param_hint="--rate")
    return value
