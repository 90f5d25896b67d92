import shlex
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path, PurePosixPath

import pytest
from click.testing import Result

from tests.command_line import invoke
from tests.test_machines import EMULATED, MACHINES, SITES, load
from tests.tiny import TINY
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.games import GAMES
from vrg.launch.systemd import Installation, unit_files, used_machines

AT = Installation(
    vrg=PurePosixPath("/opt/my vrg/bin/vrg"), folder=PurePosixPath("/opt/match"), match_file="match.toml", user="vrg",
    router="tcp/10.0.0.1:7447", upstream="tcp/10.0.0.9:7447",
)  # fmt: skip


def texts(setup: MatchSetup, at: Installation = AT) -> dict[str, dict[str, str]]:
    return unit_files(setup, dict.fromkeys(used_machines(setup, window=False), at), window=False)


def lines(text: str, key: str) -> list[str]:
    return [line.partition("=")[2] for line in text.splitlines() if line.startswith(f"{key}=")]


def test_each_machine_gets_the_units_of_its_own_processes_and_a_target(tmp_path: Path) -> None:
    found = texts(load(tmp_path, MACHINES + '[place]\nworld = "lab2"\n', bob='machine = "lab3"'))
    stem = "vrg-machines"
    assert set(found["here"]) == {
        f"{stem}-{name}.service" for name in ("router", "referee", "recorder", "ann", "run")
    } | {f"{stem}.target"}
    assert set(found["lab2"]) == {f"{stem}-world.service", f"{stem}-run.service", f"{stem}.target"}
    wanted = lines(found["lab3"][f"{stem}.target"], "Wants")[0].split()
    assert wanted == [f"{stem}-bob.service", f"{stem}-run.service"]


def test_players_start_after_the_world_and_so_stop_before_it(tmp_path: Path) -> None:
    found = texts(load(tmp_path))["here"]
    after = lines(found["vrg-machines-ann.service"], "After")[0].split()
    assert {"vrg-machines-router.service", "vrg-machines-world.service", "vrg-machines-run.service"} <= set(after)
    world = lines(found["vrg-machines-world.service"], "After")[0].split()
    assert "vrg-machines-router.service" in world
    assert not any("ann" in unit for unit in world)


def test_commands_are_quoted_as_systemd_wants_it(tmp_path: Path) -> None:
    found = texts(load(tmp_path))["here"]
    (command,) = lines(found["vrg-machines-ann.service"], "ExecStart")
    assert command == (
        '"/opt/my vrg/bin/vrg" node player ann match.toml --router tcp/10.0.0.1:7447 --run /var/lib/vrg-machines/run'
    )


def test_further_routers_are_linked_to_the_one_of_the_match(tmp_path: Path) -> None:
    found = texts(load(tmp_path, SITES, bob='machine = "lab3"'))
    (command,) = lines(found["lab2"]["vrg-machines-router-lab2.service"], "ExecStart")
    assert command.endswith("router --router tcp/10.0.0.1:7447 --upstream tcp/10.0.0.9:7447")
    (main,) = lines(found["here"]["vrg-machines-router.service"], "ExecStart")
    assert "--upstream" not in main


def test_only_what_speaks_to_motors_may_open_a_can_socket(tmp_path: Path) -> None:
    found = texts(load(tmp_path, MACHINES + EMULATED, ann='backend = "can"', bob=""))["here"]
    for process, can in (("ann", True), ("drives", True), ("bob", False), ("world", False)):
        families = lines(found[f"vrg-machines-{process}.service"], "RestrictAddressFamilies")[0]
        assert ("AF_CAN" in families) == can, process


def test_systemd_accepts_them(tmp_path: Path) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd is not installed")
    at = Installation(
        vrg=PurePosixPath("/bin/true"), folder=PurePosixPath("/tmp"), match_file="match.toml", user="root",
        router="tcp/127.0.0.1:7447", keys=PurePosixPath("/tmp/keys"),
    )  # fmt: skip
    folder = tmp_path / "units"
    folder.mkdir()
    found = texts(load(tmp_path), at)["here"]
    for name, text in found.items():
        (folder / name).write_text(text)
    command = ["systemd-analyze", "verify", "--man=no", *(str(folder / name) for name in found)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    told = [line for line in done.stderr.splitlines() if "vrg-machines" in line]
    assert done.returncode == 0, done.stderr
    assert told == [], done.stderr


def deployed(folder: Path, *arguments: str, head: str = "") -> Result:
    """The result of `vrg deploy systemd` on a match file of one machine, with its units in folder/units."""
    file = folder / "alone.toml"
    file.write_text(head + (GAMES.get("sharks-and-minnows").default_match()).read_text())
    command = ["deploy", "systemd", str(file), "--output", str(folder / "units"), "--user", "vrg", *arguments]
    return invoke(*command)


def router_command(folder: Path) -> str:
    (unit,) = (folder / "units").rglob("*-router.service")
    (command,) = lines(unit.read_text(), "ExecStart")
    return command


def test_a_match_with_seats_is_not_deployed_without_keys_and_one_without_seats_is(tmp_path: Path) -> None:
    done = deployed(tmp_path, head="seats = true\n")
    assert isinstance(done.exception, ConfigError)
    assert "has seats" in str(done.exception)
    assert "--keys" in str(done.exception)
    assert not (tmp_path / "units").exists()
    assert deployed(tmp_path).exit_code == 0
    assert router_command(tmp_path).endswith("router --router tcp/127.0.0.1:7447")
    shutil.rmtree(tmp_path / "units")
    assert deployed(tmp_path, "--keys", "/etc/vrg/keys", head="seats = true\n").exit_code == 0
    assert "--keys /etc/vrg/keys --router tls/127.0.0.1:7447" in router_command(tmp_path)


def test_it_prints_what_to_type_to_bring_match_keys_and_units_to_each_machine(tmp_path: Path) -> None:
    tables = '[machines.here]\naddress = "10.0.0.1"\n[machines.lab2]\nhost = "robot@lab2"\n[place]\nworld = "lab2"\n'
    file = GAMES.get("sharks-and-minnows").default_match().read_text()
    path = tmp_path / "two.toml"
    path.write_text(file + tables)
    units = tmp_path / "units"
    done = invoke("deploy", "systemd", str(path), "--output", str(units), "--keys", "/opt/vrg/keys")
    said = done.output.splitlines()
    assert done.exit_code == 0, done.exception
    assert f"  scp -r {path} robot@lab2:/opt/vrg/match/" in said
    assert f"  vrg keys hand world --output {units}/lab2/keys" in said
    assert f"  scp -r {units}/lab2/keys/* robot@lab2:/opt/vrg/keys/" in said
    assert any(line.startswith(f"  cp -r {units}/here/vrg-") for line in said)
    assert any("ssh -t robot@lab2 'sudo systemctl start vrg-" in line for line in said)


def test_nothing_that_somebody_else_could_have_put_there_becomes_a_unit(tmp_path: Path) -> None:
    """No folder that everybody can write, no names that the shell completes, and each path is one word."""
    folder, keys = "/opt/our match", "/etc/our keys"
    done = deployed(tmp_path, "--folder", folder, "--keys", keys, head="seats = true\n")
    (unit_files,) = (tmp_path / "units").iterdir()
    commands = [shlex.split(line, comments=True) for line in done.output.splitlines()[1:]]
    (made,) = (words for words in commands if words[:3] == ["sudo", "install", "-d"])
    assert made[-3:] == [folder, f"{folder}/units", keys]
    (installed,) = (words for words in commands if words[:4] == ["sudo", "install", "-m", "644"])
    names = sorted(path.name for path in unit_files.iterdir())
    assert installed[4:7] == ["-t", "/etc/systemd/system", f"{folder}/units/{names[0]}"]
    assert installed[6 : installed.index("&&")] == [f"{folder}/units/{name}" for name in names]
    assert not any(word.startswith("/tmp/") for word in installed)


@pytest.mark.parametrize("keys", ["keys", "~/keys"])
def test_a_folder_of_keys_that_systemd_could_not_find_is_told(tmp_path: Path, keys: str) -> None:
    done = deployed(tmp_path, "--keys", keys, head="seats = true\n")
    assert isinstance(done.exception, ConfigError)
    assert "begins with /" in str(done.exception)


def test_names_of_people_make_units_that_systemd_takes(tmp_path: Path) -> None:
    path = tmp_path / "match.toml"
    path.write_text(TINY.replace('"tiny"', '"café"').replace('"ann"', '"é1"'))
    setup = load_match(path)
    found = texts(setup, replace(AT, folder=PurePosixPath("/opt/100% mine")))["here"]
    assert all(name.isascii() for name in found)
    service = found["vrg-x--caf-dma-x--1-9fa.service"]
    assert lines(service, "WorkingDirectory") == ["/opt/100%% mine"]
    assert lines(service, "StateDirectory") == ["vrg-x--caf-dma"]
    assert set(lines(found["vrg-x--caf-dma.target"], "Wants")[0].split()) == set(found) - {"vrg-x--caf-dma.target"}
