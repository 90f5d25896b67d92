"""Options that belong together, and so are one parameter of a command."""

import functools
import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from vrg.commands.added import Added, Extended, added_drawers, added_views, extended, names_of, typed
from vrg.commands.options import (
    EngineOption,
    KeysOption,
    ListenOption,
    MatchArgument,
    MatchKeysOption,
    ReasonOption,
    RouterOption,
    RunsOption,
    SandboxOption,
    TlsOption,
    web_address,
)

F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True)
class MatchOptions:
    """The running match that a command means, as it was typed, and the folder of its keys."""

    match: MatchArgument = None
    router: RouterOption = None
    keys: MatchKeysOption = None


@dataclass(frozen=True)
class DecisionOptions(MatchOptions):
    """The running match that a decision is about, and the reason of it."""

    reason: ReasonOption = ""


@dataclass(frozen=True)
class PracticeOptions:
    """The options of a match: in one process or several, its speed, its window and its recording."""

    in_process: Annotated[
        bool, typer.Option("--in-process", help="Play in one process, in lockstep, without the bus.")
    ] = False
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Like --in-process, but each strategy decides in its own process.")
    ] = False
    deadline: Annotated[
        float | None,
        typer.Option(metavar="S", min=0.001, max=4.0, help="Real time after which a strategy forfeits a step, 1 s."),
    ] = None
    engine: EngineOption = None
    rate: Annotated[
        str | None, typer.Option(metavar="X|max", help="Match seconds per real second; max only in lockstep.")
    ] = None
    seed: Annotated[int | None, typer.Option(min=0, help="Seed that replaces the match file's.")] = None
    headless: Annotated[bool, typer.Option("--headless", help="Open no window, even if there is a display.")] = False
    runs: RunsOption = Path("runs")
    record: Annotated[bool, typer.Option(help="Record for Foxglove and the plot.")] = True
    sandbox: SandboxOption = None

    def check(self) -> None:
        """Check the options that are read later, before anything starts.

        Raises:
            typer.BadParameter: one makes no sense, alone or with others.
        """
        self.speed  # noqa: B018 - it raises
        if self.in_process and self.lockstep:
            raise typer.BadParameter("--in-process and --lockstep: choose one")
        if self.deadline is not None and not self.lockstep:
            raise typer.BadParameter("--deadline needs --lockstep: add it", param_hint="--deadline")

    @property
    def steps(self) -> bool:
        """True if the nodes of the match are in one process, in lockstep."""
        return self.in_process or self.lockstep

    @property
    def speed(self) -> float | None:
        """The rate that was typed as a number; None if none was typed, or for `max`.

        Raises:
            typer.BadParameter: it makes no sense.
        """
        if self.rate is None or self.rate == "max":
            if self.rate == "max" and not self.steps:
                raise typer.BadParameter(
                    "max needs --in-process or --lockstep: processes are paced by the match clock", param_hint="--rate"
                )
            return None
        try:
            value = float(self.rate)
        except ValueError:
            value = -1.0
        if not 0.1 <= value <= 100:
            raise typer.BadParameter(f"expected 0.1 to 100 or max, got {self.rate!r}", param_hint="--rate")
        return value


@dataclass(frozen=True)
class PlayOptions(PracticeOptions):
    """The options of `vrg play`."""

    here: Annotated[
        bool, typer.Option("--here", help="Run everything on this machine, whatever the match file names.")
    ] = False
    sim: Annotated[bool, typer.Option("--sim", help="Make all robots virtual, whatever their backends.")] = False
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print which process would run on which machine; start nothing.")
    ] = False
    seats: Annotated[
        bool | None,
        typer.Option("--seats/--no-seats", help="Admit only seats with keys; the default is the match file's."),
    ] = None
    keys: KeysOption = None
    web: Annotated[
        bool, typer.Option("--web", help="Show the match in browsers too; --listen serves it to other machines.")
    ] = False
    listen: ListenOption = None
    tls: TlsOption = False
    page: Annotated[Path | None, typer.Option("--page", hidden=True)] = None
    """The file with the address and the tokens of the page, from the program that shows it to others."""
    show: Annotated[
        list[str] | None,
        typer.Option(metavar="VIEW[=ADDRESS]", help="Show the match in a view of `vrg show` that needs no window."),
    ] = None

    @staticmethod
    def added() -> list[Added]:
        """The options that packages add."""
        return [*added_views(), *added_drawers()]

    def check(self) -> None:
        """See PracticeOptions.check."""
        super().check()
        if self.page and (self.listen or self.tls):
            raise typer.BadParameter("--page says where the page is served: leave --listen and --tls out")
        if self.tls and not self.address:
            raise typer.BadParameter("--tls encrypts the page, but no page is served: add --web or --listen")
        needing = {"--seats": self.seats} | dict.fromkeys((each.option.name for each in typed(self)), True)
        needing |= {"--show": bool(self.show), "--web": self.address is not None}
        if self.steps and (first := next((name for name, wanted in needing.items() if wanted), None)):
            how = "--lockstep" if self.lockstep else "--in-process"
            raise typer.BadParameter(
                f"{first} needs the bus: a match with {how} has no bus, no seats and no pages; leave {how} out"
            )

    @property
    def address(self) -> tuple[str, int | None] | None:
        """The address and the port at which browsers see it; None serves no page."""
        served = self.web or self.listen or self.drawer or self.page
        return web_address(self.listen) if served else None

    @property
    def drawer(self) -> str:
        """The name of the drawer of the page that the official's link opens; empty for none."""
        return next((each.drawer for each in typed(self) if each.drawer), "")

    @property
    def views(self) -> dict[str, str | None]:
        """The further views by their names in `vrg show`, with the address that was typed for each."""
        found: dict[str, str | None] = {each.view: None for each in typed(self) if each.view}
        for each in self.show or ():
            name, _, at = each.partition("=")
            found[name] = at or None
        return found


class CommandGroup(typer.Typer):
    """A group of commands; see `flat`."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(add_completion=False, pretty_exceptions_enable=False, **settings)

    def command(self, name: str | None = None, **settings: Any) -> Callable[[F], F]:
        """Add a command of which several options may be one parameter."""
        add = super().command(name, cls=Extended, **settings)
        return lambda function: add(flat(function))  # type: ignore[return-value]


def flat(function: Callable[..., None]) -> Callable[..., None]:
    """A command for typer in place of one that has parameters of dataclasses: their fields are its own parameters.

    So are the options that packages add to these dataclasses; see `vrg.commands.added.extended`.
    """
    own = inspect.signature(function, eval_str=True).parameters
    groups: Mapping[str, Any] = {name: p.annotation for name, p in own.items() if is_dataclass(p.annotation)}
    named = [(one.name, one.type) for kind in groups.values() for one in fields(kind)]
    named += [(name, parameter.annotation) for name, parameter in own.items()]
    names = {"--help"} | {each for name, annotation in named for each in names_of(name, annotation)}
    groups = {name: extended(kind, names) for name, kind in groups.items()}
    taken = {name: [field.name for field in fields(kind)] for name, kind in groups.items()}
    parameters: list[inspect.Parameter] = []
    for name, parameter in own.items():
        parameters += [
            parameter.replace(
                name=field.name,
                annotation=field.type,
                default=parameter.empty if field.default is MISSING else field.default,
            )
            for field in (fields(groups[name]) if name in groups else ())
        ] or [parameter]

    @functools.wraps(function)
    def command(**typed: Any) -> None:
        made = {name: kind(**{field: typed.pop(field) for field in taken[name]}) for name, kind in groups.items()}
        function(**made, **typed)

    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return command
