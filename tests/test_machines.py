"""Where a match file places its processes."""

from pathlib import Path

import pytest

from vrg.config.loading import idle_machines, load_match
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.launch.plan import planned, processes_at
from vrg.launch.process import Process
from vrg.names import NAME_RULE

MATCH = """
name = "machines"
game = "sharks-and-minnows"
map = "open"
engine = "planar"
[rules]
x = [-5.0, 5.0]
y = [-8.0, 8.0]
passes = 1
{more}
[[players]]
name = "ann"
role = "shark"
x = 0.0
y = -7.0
{ann}
[[players]]
name = "bob"
role = "minnow"
x = 0.0
y = 7.0
{bob}
"""
MACHINES = '[machines.lab2]\nhost = "robot@lab2.local"\n[machines.lab3]\nhost = "lab3"\nvrg = "~/vrg/.venv/bin/vrg"\n'
EMULATED = """
[backends.can]
interface = "virtual"
channel = "bus"
emulate = true
[backends.can.robots.ann]
left = [0]
right = [1]
ratio = 50.0
[backends.can.robots.bob]
left = [2]
right = [3]
ratio = 50.0
"""


def load(folder: Path, more: str = "", ann: str = "", bob: str = "") -> MatchSetup:
    path = folder / "match.toml"
    path.write_text(MATCH.format(more=more, ann=ann, bob=bob))
    return load_match(path)


def placed(setup: MatchSetup, *, window: bool, record: bool) -> dict[str, str]:
    return {process.name: process.machine for process in planned(setup, window=window, record=record)}


def problems(folder: Path, more: str = "", ann: str = "", bob: str = "") -> str:
    with pytest.raises(ConfigError) as error:
        load(folder, more, ann, bob)
    return str(error.value)


def test_without_machines_all_run_here(tmp_path: Path) -> None:
    setup = load(tmp_path)
    assert setup.hosts == {}
    assert set(placed(setup, window=True, record=True).values()) == {"here"}


def test_each_process_runs_on_the_machine_that_is_named(tmp_path: Path) -> None:
    setup = load(tmp_path, MACHINES + '[place]\nworld = "lab2"\nrouter = "lab3"\n', bob='machine = "lab3"')
    assert placed(setup, window=False, record=True) == {
        "router": "lab3", "world": "lab2", "referee": "here", "recorder": "here", "ann": "here", "bob": "lab3",
    }  # fmt: skip
    names = {
        machine: [one.name for one in planned(setup, window=False, record=True) if one.machine == machine]
        for machine in ("here", "lab2", "lab3")
    }
    assert names == {"here": ["referee", "recorder", "ann"], "lab2": ["world"], "lab3": ["router", "bob"]}
    assert setup.hosts["lab3"].vrg == "~/vrg/.venv/bin/vrg"
    here = setup.all_here()
    assert (here.hosts, set(placed(here, window=False, record=False).values())) == ({}, {"here"})


def test_a_machine_on_which_nothing_runs_is_not_used(tmp_path: Path) -> None:
    setup = load(tmp_path, MACHINES, bob='machine = "lab3"')
    assert list(setup.hosts) == ["lab3"]
    assert "nothing runs on lab2: name it" in idle_machines(setup)
    assert not idle_machines(load(tmp_path, MACHINES, ann='machine = "lab2"', bob='machine = "lab3"'))


def test_drives_are_emulated_where_their_players_run(tmp_path: Path) -> None:
    can = 'backend = "can"\n'
    setup = load(tmp_path, MACHINES + EMULATED, ann=can, bob=can + 'machine = "lab2"')
    assert setup.place == {"bob": "lab2", "drives-lab2": "lab2"}
    assert [companion.name for companion in setup.companions] == ["drives", "drives-lab2"]
    together = load(tmp_path, MACHINES + EMULATED, ann=can, bob=can)
    assert [companion.name for companion in together.companions] == ["drives"]
    assert together.place == {}
    elsewhere = load(tmp_path, MACHINES + EMULATED + '[place]\ndrives = "lab3"\n', ann=can, bob=can)
    assert elsewhere.place == {"drives": "lab3"}


@pytest.mark.parametrize("typed", ["192.168.1.5", "[2001:db8::1]"])
def test_the_launchers_own_machine_may_have_an_address(tmp_path: Path, typed: str) -> None:
    setup = load(tmp_path, MACHINES + f'[machines.here]\naddress = "{typed}"\n', bob='machine = "lab2"')
    assert setup.machines["here"].address == typed.strip("[]")
    assert list(setup.hosts) == ["lab2"]


def test_all_mistakes_are_told_at_once_with_their_lines(tmp_path: Path) -> None:
    more = '[machines.lab2]\naddress = "x"\n[machines.here]\nhost = "me"\n'
    more += '[place]\nwrold = "lab2"\nreferee = "lab9"\nbob = "lab2"\n'
    told = problems(tmp_path, more, bob='machine = "lab1"')
    for line, words in (
        (10, "expected a host for ssh, such as robot@lab2.local, found none"),
        (13, "this is the machine where the match is launched"),
        (15, "got 'wrold', did you mean 'world'?"),
        (16, "expected one of here, lab2, got 'lab9', did you mean 'lab2'?"),
        (17, "write `machine = 'lab2'` into the table of the player bob"),
        (30, "expected one of here, lab2, got 'lab1', did you mean 'lab2'?"),
    ):
        assert any(f":{line}: " in each and words in each for each in told.splitlines()), f"{line} {words}\n{told}"


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ('host = "ssh lab2"', "expected what you type after `ssh`, such as robot@lab2.local; its port"),
        ('host = "-oProxyCommand=x"', "machines.lab2.host: expected what you type after `ssh`"),
        ('host = "lab2"\nuser = "root"', "machines.lab2.user: unknown field"),
        (
            'host = "lab2"\nvrg = "vrg; rm x"',
            "expected the path of the command `vrg` there, such as ~/vrg/.venv/bin/vrg",
        ),
        ('host = "lab2"\ndisplay = "my screen"', "expected a display there, such as :0, got 'my screen'"),
    ],
)
def test_one_mistake_in_the_table_of_a_machine_is_told_in_words_and_once(tmp_path: Path, table: str, told: str) -> None:
    further = '[machines.lab3]\nhost = "lab3"\nvia = "lab2"\n'
    said = problems(tmp_path, f"[machines.lab2]\nrouter = true\n{table}\n{further}", bob='machine = "lab2"')
    assert told in said
    assert len(said.splitlines()) == 1, "that lab2 is used elsewhere is no mistake"


BAD_NAMES, BAD_ADDRESSES = ("../../evil", "lab 2", "a/b", "*"), ("two words", "10.0.0.5:7447", "a..b")
ADDRESS = "expected a host name or an IP address such as 192.168.1.5"
SITES = '[machines.lab2]\nhost = "lab2"\nrouter = true\n[machines.lab3]\nhost = "lab3"\nvia = "lab2"\n'


def test_a_site_may_have_a_router_of_its_own(tmp_path: Path) -> None:
    setup = load(tmp_path, SITES, bob='machine = "lab3"')
    assert [setup.router_at(name) for name in ("here", "lab2", "lab3")] == ["here", "lab2", "lab2"]
    assert placed(setup, window=False, record=False)["router-lab2"] == "lab2"
    (router,) = processes_at(
        setup, tmp_path, "tcp/own:1", window=False, record=False, machine="lab2", upstream="tcp/main:1"
    )
    assert router.is_router
    assert router == Process(
        name="router-lab2", kind="router", machine="lab2", router="tcp/own:1", run=str(tmp_path.resolve()),
        upstream="tcp/main:1",
    )  # fmt: skip
    with_the_matchs_own = load(tmp_path, SITES + '[place]\nrouter = "lab2"\n', bob='machine = "lab3"')
    assert {with_the_matchs_own.router_at(name) for name in ("here", "lab2", "lab3")} == {"lab2"}
    assert "router-lab2" not in placed(with_the_matchs_own, window=False, record=False)


@pytest.mark.parametrize(
    ("tables", "told"),
    [
        (SITES.replace('via = "lab2"', 'via = "lab9"'), "expected a machine with `router = true` (lab2), got 'lab9'"),
        (SITES.replace("router = true\n", ""), "expected a machine with `router = true` (there is none), got 'lab2'"),
        (SITES + "[machines.here]\nrouter = true\n", "a further router is on another machine"),
        (
            SITES + '[machines.lab4]\nhost = "lab4"\nrouter = true\nvia = "lab2"\n',
            "a machine with a router of its own uses that",
        ),
        (SITES + '[machines.here]\nvia = "lab2"\n', "the router of the match runs there"),
        *((f'{SITES}[machines."{name}"]\nhost = "lab2"\n', f"{NAME_RULE}, got {name!r}") for name in BAD_NAMES),
        *((f'{SITES}[machines.here]\naddress = "{one}"\n', f"{ADDRESS}, got {one!r}") for one in BAD_ADDRESSES),
    ],
)
def test_routers_names_and_addresses_that_make_no_sense_are_refused(tmp_path: Path, tables: str, told: str) -> None:
    assert told in problems(tmp_path, tables, bob='machine = "lab3"')


def test_the_match_of_the_laboratory_can_be_played() -> None:
    setup = load_match(Path(__file__).parents[1] / "deploy" / "lab.toml")
    where = placed(setup, window=True, record=True)
    assert {where[name] for name in ("router", "world", "referee", "spectator")} == {"here"}
    assert (where["red1"], where["blue2"], where["drives"], where["drives-blue"]) == ("red", "blue", "red", "blue")
    assert setup.has_seats
