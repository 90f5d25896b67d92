"""The rooms of the house: who may import whom, and what each process loads."""

import ast
import re
import runpy
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import vrg
from vrg.testing.loading import loaded

ROOT = Path(vrg.__file__).parent
ONLY_IN = {
    "pybullet": ("hal/sim/engines", "hal/sim/sensors/renderer.py"),
    "mujoco": ("hal/sim/engines",),
    "can": ("hal/can",),
    "zenoh": ("bus",),
    "pygame": ("ui", "testing/views/window.py"),  # the suite of windows presses keys
    "matplotlib": ("ui",),
    "mcap": ("recording",),
    "pytest": ("testing",),
    "playwright": ("testing/views",),
    "pyarrow": ("playing/run.py",),
    "cryptography": ("seats",),
    "aiohttp": ("ui/web/server.py", "ui/web/site.py", "ui/web/replay.py"),
    "segno": ("ui/sheet.py",),
    "tomlkit": ("toml_text.py", "commands/practice.py"),
}
"""Libraries, and the only room that imports each."""
BESIDE = {
    "coordinator": ("agents",),
    "recording": ("agents", "coordinator"),
    "config": ("agents", "recording"),
    "ui": ("agents", "config"),
}
"""Rooms below another one that it may not import all the same: each works without the other."""


@cache
def rooms() -> dict[str, int]:
    """The rooms of vrg/, and the modules that lie in none, with their height: the row of the table of architecture.md.

    A folder in a folder is a part of its room.
    """
    text = (ROOT.parent / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = text.partition("## The rooms")[2].partition("\n\n|")[2].partition("\n\n")[0]
    found: dict[str, int] = {}
    for height, row in enumerate(table.splitlines()[2:]):
        for name in re.findall(r"`([^`]+)`", row.split("|")[1]):
            found.setdefault(name.partition("/")[0], height)
    return found


@cache
def _imports(path: Path) -> list[tuple[str, bool]]:
    """The names that a module imports, also inside functions, and whether it is not only for types."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    typing = {id(n) for branch in nodes if _is_for_types_only(branch) for n in ast.walk(branch)}
    found = []
    for node in nodes:
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        else:
            continue
        found += [(name, id(node) not in typing) for name in names]
    return found


def _is_for_types_only(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


FILES = sorted(ROOT.rglob("*.py"))


def test_every_room_stands_in_the_table() -> None:
    there = {path.name.removesuffix(".py") for path in ROOT.iterdir() if path.suffix == ".py" or path.is_dir()}
    assert rooms().keys() == there - {"__init__", "__main__", "__pycache__"}


def test_a_module_imports_only_what_its_room_may() -> None:
    wrong, height = [], rooms()
    for path in FILES:
        place = path.relative_to(ROOT).as_posix()
        room = place.split("/")[0].removesuffix(".py")
        for name, _ in _imports(path):
            first, *rest = name.split(".")
            if first in ONLY_IN and not place.startswith(ONLY_IN[first]):
                wrong.append(f"{place} imports {first}, which belongs to {ONLY_IN[first]}")
            inner = rest[0] if first == "vrg" and rest else ""
            above = inner in height and room in height and height[inner] > height[room]
            if above or inner in BESIDE.get(room, ()):
                wrong.append(f"{place} imports {name}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("folder", sorted(p for p in (ROOT / "games").iterdir() if (p / "rules.py").exists()))
def test_a_games_rules_and_its_player_do_not_know_each_other(folder: Path) -> None:
    """A referee loads the one and a player the other; what both need has a module of its own."""
    game = f"vrg.games.{folder.name}"
    imports = {
        f"{game}.{path.stem}": {name for name, _ in _imports(path) if name.startswith(f"{game}.")}
        for path in folder.glob("*.py")
    }

    def reached(module: str) -> set[str]:
        found, waiting = set[str](), [module]
        while waiting:
            name = waiting.pop()
            if name in imports and name not in found:
                found.add(name)
                waiting += imports[name]
        return found

    assert f"{game}.player" not in reached(f"{game}.rules")
    players = [module for module in imports if f"{game}.player" in reached(module)]
    assert all(f"{game}.rules" not in reached(module) for module in players)


def test_no_module_imports_itself_by_way_of_others() -> None:
    """An import inside a function saves time; it hides no circle."""
    names = {".".join(("vrg", *p.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__"): p for p in FILES}
    graph = {
        name: {other for other, used in _imports(path) if used and other in names and other != name}
        for name, path in names.items()
    }
    finished: set[str] = set()

    def visit(name: str, way: tuple[str, ...]) -> None:
        assert name not in way, " imports ".join((*way[way.index(name) :], name))
        if name not in finished:
            for other in sorted(graph[name]):
                visit(other, (*way, name))
            finished.add(name)

    for name in sorted(graph):
        visit(name, ())


def test_the_core_knows_no_plugin() -> None:
    """Plug-ins import VRG, and of each other those that their pyproject.toml names; VRG knows none of them."""
    plugins = {path.parent.name: path for path in (ROOT.parent / "plugins").glob("*/*/__init__.py")
               if path.parent.name.startswith("vrg_")}  # fmt: skip
    assert plugins
    wrong = [f"{path.relative_to(ROOT)} names {name}" for path in FILES for name in plugins
             if name in (text := path.read_text(encoding="utf-8")) or name.replace("_", "-") in text
             or name.replace("vrg_", "virtual-robotic-games-") in text]  # fmt: skip
    wrong += [f"{path.relative_to(ROOT.parent)} imports {name}" for own, home in plugins.items()
              for path in home.parent.rglob("*.py") for name, _ in _imports(path)
              if name.split(".")[0] in {*plugins} - {own, *_named_by(home.parents[1] / "pyproject.toml")}]  # fmt: skip
    assert not wrong, "\n".join(wrong)


def test_no_test_of_a_plugin_imports_what_only_this_repository_has() -> None:
    """They use `vrg.testing`, as those of a package elsewhere do."""
    files = [*(ROOT.parent / "plugins").glob("*/tests/**/*.py")]
    assert files
    wrong = [f"{path.relative_to(ROOT.parent)} imports {name}" for path in files for name, _ in _imports(path)
             if name.split(".")[0] in ("tests", "benchmarks", "conftest")]  # fmt: skip
    assert not wrong, "\n".join(wrong)


def test_what_plugins_offer_stands_in_a_file() -> None:
    made = runpy.run_path(str(ROOT.parent / "scripts" / "offered"))["text"]()
    assert (ROOT / "offered.toml").read_text(encoding="utf-8") == made, "scripts/offered writes it"


def _named_by(project: Path) -> set[str]:
    """The packages of the projects that a project depends on, by itself or with an extra."""
    about = tomllib.loads(project.read_text(encoding="utf-8"))["project"]
    needed = [about["dependencies"], *about.get("optional-dependencies", {}).values()]
    return {
        Requirement(one).name.replace("virtual-robotic-games", "vrg").replace("-", "_")
        for some in needed
        for one in some
    }


HEAVY = ("numpy", "pydantic", "pygame", "matplotlib", "pybullet", "mujoco")
LATE: dict[str, tuple[str, tuple[str, ...]]] = {
    "the command line: whoever plays over ssh waits for no graphics": (
        "import vrg.cli", (*HEAVY, "can", "canopen", "cryptography", "ssl", "aiohttp"),
    ),
    "VRG without its tests": ("import vrg, vrg.cli, vrg.commands.play", ("pytest", "playwright", "vrg.testing")),
    "a match without a page": (
        "import vrg.commands.play, vrg.commands.playing, vrg.ui.window.spectator", ("aiohttp", "asyncio.runners"),
    ),
    "a recorder": (
        "import vrg.recording.recorder\nfrom vrg.games import game_of\nassert game_of('sharks-and-minnows').name",
        (*HEAVY, "zenoh", "vrg.hal.sim", "vrg.coordinator", "vrg.agents", "vrg.games.sharks_and_minnows.rules",
         "vrg.games.sharks_and_minnows.player"),
    ),
}  # fmt: skip
"""What of VRG loads none of these modules."""


@pytest.mark.parametrize(("code", "unwanted"), LATE.values(), ids=LATE)
def test_nothing_is_loaded_that_is_not_needed(code: str, unwanted: tuple[str, ...]) -> None:
    assert loaded(code, unwanted) == []


A_MATCH = """
from pathlib import Path
from vrg.config.setup import read_setup
from vrg.runs.run_folder import RunFolder
setup, folder = read_setup(Path({file!r})), RunFolder(Path({folder!r}))
"""
A_PLAYER = "from vrg.launch.nodes.player import player_node\nplayer_node(setup, setup.players[0].name)"


@pytest.fixture(scope="module")
def setup_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A match whose players' code, as soon as it is loaded, ends the process that loads it."""
    from vrg.config.loading import load_match  # noqa: PLC0415 - it is what the other tests want unloaded
    from vrg.config.setup import write_setup  # noqa: PLC0415
    from vrg.games import GAMES  # noqa: PLC0415

    folder = tmp_path_factory.mktemp("match")
    (folder / "deadly.py").write_text("import os\nos._exit(9)\n", encoding="utf-8")
    text = GAMES.get("sharks-and-minnows").default_match().read_text(encoding="utf-8")
    match = folder / "match.toml"
    match.write_text(text.replace("[[players]]", '[[players]]\nstrategy = "deadly:Player"'), encoding="utf-8")
    file = folder / "setup.json"
    write_setup(load_match(match), file)
    return file


def test_a_player_loads_no_world_and_no_rules(setup_file: Path) -> None:
    unwanted = ("numpy", "pydantic", "typer", "pybullet", "can", "canopen", "pygame", "mcap", "vrg.hal.sim.world")
    unwanted += ("mujoco", "matplotlib", "cryptography", "PIL", "jinja2", "zstandard")  # which the core has not
    unwanted += ("vrg.games.sharks_and_minnows.rules", "vrg.coordinator.coordinator", "vrg.recording.recorder")
    code = A_MATCH.format(file=str(setup_file), folder="")
    code += "from msgspec.structs import replace\n"
    code += "setup = replace(setup, players=[replace(p, strategy='sharks-and-minnows') for p in setup.players])\n"
    assert loaded(code + A_PLAYER, unwanted) == []


def test_a_player_on_a_laptop_needs_three_packages(setup_file: Path) -> None:
    code = A_MATCH.format(file=str(setup_file), folder="")
    code += "import vrg.bus.session, vrg.bus.process\nfrom msgspec.structs import replace\n"
    code += "setup = replace(setup, players=[replace(p, strategy='sharks-and-minnows') for p in setup.players])\n"
    code += f"{A_PLAYER}\n"
    code += "print(*{name.partition('.')[0] for name in sys.modules} - sys.stdlib_module_names)"
    code = f"import sys\n{code}"
    found = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, timeout=600, check=True)
    packages = {name for name in found.stdout.split() if not name.startswith(("_", "vrg", "cython"))}
    assert packages - {"typing_extensions"} <= {"zenoh", "msgspec", "numpy"}, (
        "msgspec looks whether the former is there"
    )


@pytest.mark.parametrize(
    "make",
    [
        "from vrg.launch.nodes.referee import coordinator_node, open_journal\n"
        "with open_journal(setup, folder) as journal:\n    coordinator_node(setup, journal)",
        "from vrg.launch.nodes.world import world_node\nworld_node(setup)",
        "from vrg.launch.nodes.recorder import recorder_node\nrecorder_node(setup, folder).stop()",
    ],
    ids=["referee", "world", "recorder"],
)
def test_no_referee_world_or_recorder_loads_a_students_code(setup_file: Path, tmp_path: Path, make: str) -> None:
    """A student's import may block or end its process: only that player's may suffer."""
    code = A_MATCH.format(file=str(setup_file), folder=str(tmp_path))
    assert loaded(code + make, ("vrg.agents.player", "deadly", "vrg.commands")) == []


def test_a_command_does_not_load_the_others() -> None:
    code = "from typer.main import get_command\nfrom vrg.cli import make_app\n"
    code += "app = get_command(make_app())\nshow = app.get_command(None, 'show')\nshow.list_commands(None)\n"
    modules = tuple(f"vrg.commands.{name}" for name in ("show", "page", "sensors", "run", "replay", "play", "official"))
    assert loaded(code, modules) == []
    assert loaded(f"{code}show.get_command(None, 'window')", modules) == ["vrg.commands.show"]


BUDGETS = {
    "ui": 5_914,  # with things of any form and their ways, a crowd, gamepads, the emergency stop, what a match awaits
    "commands": 2_868,  # with an emergency stop that tries all ways, what to do after a match; the kernel
    "hal/can": 2_910,  # with drives that are met again, judges, and actuators at outputs, as the model has them
    "launch": 3_815,  # with what a process says why it ends, the owner of a folder, rules that fail, fingerprints
    "games": 3_900,  # with the look of what lies on a field, rules that a match and batches share, scouts in the air
    "bus": 2_741,  # with the rules and the entrance of its router, messages that are made when read, and what is a body
    "hal/sim": 3_903,  # with passive bodies, real ones among them, what grips and pulls them, what flies, low walls
    "localisation": 591,  # with things that have no odometry
    "hal/can/workshop": 1_100,  # with what is no drive, and what is sent to none; what a match asks of emulated drives
    "coordinator": 2_160,  # with passive bodies that are placed and published, and looks as rows of numbers
    "runs": 1_398,  # with what a replay shows and takes up, what differs between runs and what computed them, robots
    "hal": 1_763,  # actuators; the permission of robots, which the world uses too; what flies and looks down
    "shared values": 1_904,  # figures of a picture; what plug-ins add and show; whom an error is about; releases
    "testing": 3_185,  # what tests of plug-ins share with those of the core, which was in tests/
    "agents": 1_537,  # with sketches that are rounded, beams that are computed once, installed packages, and flying
    "recording": 1_163,  # with what a file of MCAP cannot hold, and the ways of bodies
    "playing": 2_218,  # with matches over processes, and views for strategies elsewhere, packed without slow structs
    "config": 991,  # the tables of bodies; what processes get is a thing of its own
    "launch/sandbox": 677,  # with where plug-ins lie, of which nobody hides one, and signals
    "navigation": 455,
    "seats": 500,
    "templates": 10,
    "portable": 220,  # cosines, arcs, exponentials and small matrices
}
"""The most lines of code of each room, by scripts/size. A change that needs more raises a number, and says why."""


KERNEL = 650
"""The most lines of C of the kernel, which computes again what Python computes: it must save enough time for them."""


def test_no_room_is_larger_than_its_budget() -> None:
    sizes = runpy.run_path(str(ROOT.parent / "scripts" / "size"))["sizes"]
    found = {room: of.lines for room, of in sizes(ROOT).items()}
    assert found.keys() == BUDGETS.keys(), "each room has a budget"
    over = [f"{room}: {lines}, {lines - BUDGETS[room]} more than its budget" for room, lines in found.items()
            if lines > BUDGETS[room]]  # fmt: skip
    assert not over


def test_the_kernel_is_small() -> None:
    """The lines of its C, of which comments and blank ones do not count."""
    comment = re.compile(r"/\*.*?\*/", re.DOTALL)
    found = 0
    for path in (ROOT / "hal" / "sim" / "kernel").glob("*.[ch]"):
        lines = [line for line in comment.sub("", path.read_text(encoding="utf-8")).splitlines() if line.strip()]
        assert len(lines) <= 300, path
        found += len(lines)
    assert 0 < found <= KERNEL, found - KERNEL


def test_no_module_and_no_folder_is_too_large() -> None:
    of = runpy.run_path(str(ROOT.parent / "scripts" / "size"))
    for top in (ROOT, *(ROOT.parent / "plugins").glob("vrg-*")):
        for module in top.rglob("*.py"):
            text = module.read_text(encoding="utf-8")
            lines = of["lines_of"](text) if text.count("\n") > 350 else 0  # to count takes a while
            assert lines <= 350, f"{module.relative_to(ROOT.parent)}: {lines} lines of code"
        for folder in (top, *(path for path in top.rglob("*") if path.is_dir())):
            assert len([*folder.glob("*.py")]) <= 25, f"{folder.relative_to(ROOT.parent)}: more than 25 modules"
