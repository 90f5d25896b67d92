"""The command `vrg new`, which writes a player, a match, a map or a driver to begin with. Each works as it is."""

import ast
import keyword
import os
import re
import shlex
import sys
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from vrg.commands.groups import CommandGroup
from vrg.config.targets import class_in
from vrg.errors import ConfigError
from vrg.names import NAME_RULE, is_name, normal
from vrg.templates import filled
from vrg.toml_text import quoted, with_value

app = CommandGroup(no_args_is_help=True)

NameArgument = Annotated[str, typer.Argument(metavar="NAME", help="Its name, and that of the file or folder.")]
FolderOption = Annotated[Path, typer.Option("--output", "-o", help="Folder to write into; it is made if missing.")]

_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")


@app.command()
def player(name: NameArgument, output: FolderOption = Path()) -> None:
    """Write a player of Sharks and Minnows, NAME.py, which you can change."""
    class_name = _class_name(name)
    text = filled("player.py.template", class_name=class_name)
    file = output / f"{name}.py"
    if name in sys.stdlib_module_names or name == "vrg":
        raise ConfigError(f"{name}: choose another name: {file} could hide the module {name}")
    if class_name in {node.id for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)}:
        raise ConfigError(f"{name}: choose another name: the player itself uses something called {class_name}")
    _write({file: text})
    typer.echo(
        f'\nTo let it play, give a player in a match file this line:\n\n    strategy = "{file.name}:{class_name}"'
    )
    place = "" if output == Path() else f" --output {shlex.quote(str(output))}"
    target = shlex.quote(f"{file}:{class_name}")
    typer.echo(f"\nTo write such a match file:\n\n    vrg new match first {target}{place}")


@app.command()
def match(
    name: NameArgument,
    players: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FILE.py[:CLASS]|POLICY.npz]...",
            help="Your own players, which are spread over the teams of the game.",
        ),
    ] = None,
    game: Annotated[
        str | None, typer.Option("--game", help="The game; the default is that of POLICY.npz, or sharks-and-minnows.")
    ] = None,
    output: FolderOption = Path(),
) -> None:
    """Write a match, NAME.toml: a short one of Sharks and Minnows, or the default match of another game.

    Your first player plays for the largest team, the next one for the next team, and so on. The robots of a team share
    its players in turn and are named after their files; a team without a player of yours keeps the game's own.
    """
    from vrg.games import GAMES

    _check_name(name)
    file, own = output / f"{name}.toml", _seen_from(output, players or [])
    game = _game_of(players or [], game)
    if game == "sharks-and-minnows":
        line = '# strategy = "ann.py:Ann"'.ljust(32) + "# your own player, as `vrg new player ann` writes one\n"
        line = "" if own else line
        text = filled("match.toml.template", name=name, strategy=line)
    else:
        text = with_value(GAMES.get(game).default_match().read_text(encoding="utf-8"), ("name",), name)
    spread = _spread(text, own)
    for number, strategy in spread.items():
        text = with_value(text, ("players", number, "strategy"), strategy)
    for number, called in _names(text, spread).items():
        text = with_value(text, ("players", number, "name"), called)
    _write({file: text})
    if not own:
        typer.echo("\nNo player of your own plays in it yet: `vrg new player ann` writes one.")
    path = shlex.quote(str(file))
    typer.echo(f"\nTo check it, and to play it:\n\n    vrg check {path}\n    vrg play {path}")


def _game_of(targets: Sequence[str], game: str | None) -> str:
    """The game of a new match: the one that was asked for, or that of the policies among its players.

    Raises:
        ConfigError: a policy plays another one alone.
    """
    from vrg.games import is_strategy_file
    from vrg.launch.strategy_class import strategy_class

    for target in targets:
        able = strategy_class(target, Path.cwd()).games if is_strategy_file(target) else ()
        if able and game is not None and game not in able:
            raise ConfigError(f"{target}: expected a strategy for {game}, got one that plays {', '.join(able)} alone")
        game = game or (able[0] if able else None)
    return game or "sharks-and-minnows"


def _spread(text: str, own: Sequence[str]) -> dict[int, str]:
    """The strategies of players in a match file, by the players' numbers; see `match`.

    Raises:
        ConfigError: there are more of them than players.
    """
    from vrg.games import GAMES

    data = tomllib.loads(text)
    teams: dict[str, list[int]] = {}
    for number, player in enumerate(data["players"]):
        role = GAMES.get(data["game"]).role(player["role"])
        teams.setdefault(role.team if role else "", []).append(number)
    places = sorted(teams.values(), key=len, reverse=True)
    if len(own) > len(data["players"]):
        raise ConfigError(f"expected up to {len(data['players'])} players for {data['game']}, got {len(own)}")
    dealt: list[list[str]] = [[] for _ in places]
    turn = 0
    for strategy in own:
        while len(dealt[turn % len(places)]) == len(places[turn % len(places)]):
            turn += 1  # this team is full
        dealt[turn % len(places)].append(strategy)
        turn += 1
    return {n: d[i % len(d)] for numbers, d in zip(places, dealt, strict=True) if d for i, n in enumerate(numbers)}


def _names(text: str, spread: Mapping[int, str]) -> dict[int, str]:
    """The names of players in a match file after the files by which they play, by the players' numbers.

    One whose name another player would have, too, or whose file has a name that no player can have, keeps its own.
    """
    from vrg.games import file_of

    own = [player["name"] for player in tomllib.loads(text)["players"]]
    stems = {number: Path(file).stem for number, target in spread.items() if (file := file_of(target)) is not None}
    found = dict[int, str]()
    for number, stem in stems.items():
        base = normal(re.sub(r"[^\w-]+", "_", stem))
        robots = [other for other, same in spread.items() if same == spread[number]]
        name = base if len(robots) == 1 else f"{base}{robots.index(number) + 1}"
        if is_name(name) and name not in found.values():
            found[number] = name
    while taken := [n for n, name in found.items() if name in {o for m, o in enumerate(own) if m not in found}]:
        for number in taken:
            del found[number]
    return found


@app.command("map")
def new_map(name: NameArgument, output: FolderOption = Path()) -> None:
    """Write a map, NAME.toml: a yard with a wall around it."""
    _check_name(name)
    file = output / f"{name}.toml"
    _write({file: filled("map.toml.template", name=name)})
    typer.echo(f"\nA match file beside it names it with this line:\n\n    map = {quoted(file.name)}")


@app.command()
def driver(name: NameArgument, output: FolderOption = Path()) -> None:
    """Write a driver for a robot of your own: a Python package in the folder NAME, with its tests."""
    class_name = _class_name(name) + "Driver"
    package = output / name
    if os.path.lexists(package):
        raise ConfigError(_already_there(package))
    if name == "tests" or _is_installed(name):
        raise ConfigError(f"{name}: choose another name: another Python package has this name")
    words = {"name": name, "class_name": class_name}
    _write(
        {
            package / "pyproject.toml": filled("driver/pyproject.toml.template", **words),
            package / name / "__init__.py": filled("driver/package.py.template", **words),
            package / name / "driver.py": filled("driver/driver.py.template", **words),
            package / name / "robot.py": filled("driver/robot.py.template", **words),
            package / "tests" / "test_driver.py": filled("driver/test_driver.py.template", **words),
        }
    )
    path = shlex.quote(str(package))
    typer.echo(
        f"\nIt drives a simulated robot: put the code that speaks to yours into {package / name / 'robot.py'}."
        "\n\nTo test and install it in the environment of VRG:"
        f"\n\n    python -m pytest {path}\n    python -m pip install -e {path}"
        f'\n\nThen a player in a match file may have this line:\n\n    backend = "{name}"'
    )


def _class_name(name: str) -> str:
    """The name of the class for a module's name: `old_ann` becomes `OldAnn`.

    Raises:
        ConfigError: the name cannot be the name of a module.
    """
    class_name = "".join(part[:1].upper() + part[1:] for part in name.split("_"))
    if not _IDENTIFIER.fullmatch(name):
        raise ConfigError(
            f"expected a name of 1 to 64 characters, A-Z a-z 0-9 _, beginning with a letter, got {name!r}"
        )
    if keyword.iskeyword(name) or keyword.iskeyword(class_name):
        raise ConfigError(f"{name}: choose another name: it is a keyword of Python")
    return class_name


def _check_name(name: str) -> None:
    """Raise a ConfigError if the name cannot be the name of a match or a map."""
    if not is_name(name):
        raise ConfigError(f"{NAME_RULE}, got {name!r}")


def _is_installed(name: str) -> bool:
    """True if a package or a module has this name. A folder that only happens to be on the path does not count."""
    spec = find_spec(name)
    return spec is not None and spec.origin is not None


def _seen_from(folder: Path, targets: Sequence[str]) -> list[str]:
    """Players as a match file in a folder names them.

    They are imported, so that a mistake is reported before anything is written.

    Raises:
        ConfigError: there is no such player, or it cannot be imported.
    """
    if not targets:
        return []
    from vrg.games import file_of
    from vrg.playing.trial import trial  # it loads what checks match files

    found = []
    with trial() as tried:
        for typed in targets:
            target = f"{typed}:{class_in(Path(typed))}" if typed.endswith(".py") else typed
            file = file_of(target)
            if file is not None and not Path(file).is_file():
                raise ConfigError(f"{target}: no such file: {file}; `vrg new player` writes one")
            tried.find(target, Path.cwd())
            if file is not None:
                target = Path(os.path.relpath(file, folder)).as_posix() + target.removeprefix(file)
            found.append(target)
    return found


def _write(files: Mapping[Path, str]) -> None:
    """Write new files, and say so. None is written if one of them is there already.

    Raises:
        ConfigError: a file is there already, or cannot be written.
    """
    there = [_already_there(file) for file in files if os.path.lexists(file)]
    if there:
        raise ConfigError(there)
    for file, text in files.items():
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError(f"{file.parent}: the folder cannot be made: {error.strerror}") from None
        try:
            # "x" refuses a file that was made since.
            with file.open("x", encoding="utf-8") as opened:
                opened.write(text)
        except FileExistsError:
            raise ConfigError(_already_there(file)) from None
        except OSError as error:
            with suppress(OSError):
                file.unlink()  # what a full disk has taken of it would be in the way
            raise ConfigError(f"{file}: cannot be written: {error.strerror}") from None
        typer.echo(f"wrote {file}")


def _already_there(path: Path) -> str:
    return f"{path}: it exists already and is never overwritten: choose another name, or another folder with --output"
