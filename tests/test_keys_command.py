"""The command `vrg keys`."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import Result

from vrg.bus.access import rules
from vrg.bus.session import configuration
from vrg.commands import node
from vrg.commands.keys import seat_of
from vrg.commands.page import encrypted, open_page, reached_at
from vrg.config.loading import load_match
from vrg.errors import ConfigError
from vrg.games import GAMES
from vrg.seats.seat import Seat, SeatKind
from vrg.testing.command_line import invoke
from vrg.ui.web.admission import Admission, admission

GAME = "sharks-and-minnows"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("made") / "keys"
    done = keys("init", GAME, "--keys", str(made), "--days", "3", "--host", "10.0.0.5")
    assert done.exit_code == 0, done.output
    assert "valid until" in done.output
    return made


def keys(*arguments: str) -> Result:
    return invoke("keys", *arguments)


def shown(folder: Path) -> dict[str, dict[str, object]]:
    done = keys("show", "--keys", str(folder), "--json")
    assert done.exit_code == 0
    return {row["seat"]: row for row in json.loads(done.output)}


def test_every_seat_of_the_match_gets_keys(folder: Path) -> None:
    roster = load_match(GAMES.get(GAME).default_match()).roster
    found = shown(folder)
    assert set(found) == {str(seat) for seat in roster.seats}
    assert {row["state"] for row in found.values()} == {"valid"}
    assert {"localhost", "127.0.0.1", "10.0.0.5"} <= set(found["router"]["hosts"])  # type: ignore[call-overload]
    assert "player." in keys("show", "--keys", str(folder)).output


def test_keys_that_were_made_or_handed_out_are_not_overwritten(folder: Path, tmp_path: Path) -> None:
    handed = keys("hand", "player.player1", "official", "--keys", str(folder), "--output", str(tmp_path))
    assert handed.exit_code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"player.player1", "official"}
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.*") if path.is_file()}
    for there in (folder, tmp_path):
        done = keys("init", GAME, "--keys", str(there))
        assert isinstance(done.exception, ConfigError)
        assert "renew them with `vrg keys renew` where they were made, choose another folder, or add --replace" in str(
            done.exception
        )
    assert {path: path.read_bytes() for path in tmp_path.rglob("*.*") if path.is_file()} == before


def test_no_key_is_written_behind_a_link(tmp_path: Path) -> None:
    elsewhere, made = tmp_path / "elsewhere", tmp_path / "keys"
    for path in (elsewhere, made):
        path.mkdir()
    (made / "authority").symlink_to(elsewhere)
    done = keys("init", GAME, "--keys", str(made))
    assert "keys cannot be written: expected a folder, found a link at authority" in str(done.exception)
    assert list(elsewhere.iterdir()) == []


def test_renewed_keys_last_longer_for_every_machine_of_the_match_file_and_for_all_addresses(tmp_path: Path) -> None:
    file, folder = tmp_path / "match.toml", tmp_path / "keys"
    table = '\n[machines.lab2]\nhost = "lab2"\naddress = "10.0.0.2"\n\n[place]\nworld = "lab2"\n'
    file.write_text(GAMES.get(GAME).default_match().read_text() + table)
    typed = (str(file), "--keys", str(folder))
    assert keys("init", *typed, "--days", "3", "--host", "10.0.0.5").exit_code == 0
    before = shown(folder)
    for address in ("10.0.0.6", "10.0.0.7"):
        assert keys("renew", *typed, "--days", "9", "--host", address).exit_code == 0
    after = shown(folder)
    assert all(str(after[seat]["until"]) > str(before[seat]["until"]) for seat in ("world", "host.lab2"))
    assert {"localhost", *(f"10.0.0.{last}" for last in (2, 5, 6, 7))} <= set(after["router"]["hosts"])  # type: ignore[call-overload]


def test_another_authority_makes_all_keys_worthless_that_were_handed_out(tmp_path: Path) -> None:
    folder, stick = tmp_path / "keys", tmp_path / "stick"
    assert keys("init", GAME, "--keys", str(folder)).exit_code == 0
    assert keys("hand", "world", "--keys", str(folder), "--output", str(stick)).exit_code == 0
    assert keys("init", GAME, "--keys", str(folder), "--replace").exit_code == 0
    (stick / "world" / "ca.crt").write_bytes((folder / "world" / "ca.crt").read_bytes())
    assert shown(stick)["world"]["state"] == "of another authority"


def test_the_routers_configuration_is_one_that_zenoh_takes(folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "router.json5"
    done = keys("rules", GAME, "--keys", str(folder), "--output", str(file), "--router", "tls/0.0.0.0:7500")
    assert done.exit_code == 0, done.output
    settings = json.loads(file.read_text())
    assert settings["listen"]["endpoints"] == ["tls/0.0.0.0:7500"]
    assert settings["access_control"] == rules(load_match(GAMES.get(GAME).default_match()).roster)
    assert "PRIVATE KEY" not in file.read_text()
    assert configuration(settings).get_json("mode") == '"router"'
    printed = keys("rules", GAME, "--keys", str(folder))
    assert json.loads(printed.output)["access_control"] == settings["access_control"]


def test_no_router_lets_everybody_in_that_was_given_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node, "serve_router", lambda *_, **__: pytest.fail("a router was started"))
    typed = invoke("node", "router", "--keys", "somewhere")
    monkeypatch.setenv("VRG_KEYS", "somewhere")
    for done in (typed, invoke("node", "router")):
        assert isinstance(done.exception, ConfigError)
        assert "expected the match file whose seats have the keys in somewhere" in str(done.exception)


@pytest.mark.parametrize("text", ["", "playr.ann", "player", "world.ann", ".", "host.../../evil", "player.a/b"])
def test_what_is_no_seat_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match=r"expected a seat \(router, world, .*player\.NAME"):
        seat_of(text)


def test_a_seat_is_read_as_it_is_shown() -> None:
    for seat in (Seat(SeatKind.WORLD), Seat(SeatKind.PLAYER, "Łukasz"), Seat(SeatKind.HOST, "pi")):
        assert seat_of(str(seat)) == seat


def test_the_sheet_has_a_link_for_each_player_that_the_page_admits(folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "sheet.html"
    command = ("sheet", GAME, "--keys", str(folder), "--listen", "10.0.0.5:9000", "--output", str(file))
    done = keys(*command)
    assert done.exit_code == 0, done.output
    assert file.stat().st_mode & 0o077 == (folder / "page.json").stat().st_mode & 0o077 == 0
    players = [player.name for player in load_match(GAMES.get(GAME).default_match()).players]
    page = open_page("127.0.0.1", None, players, keys=folder)
    assert page.port == 9000
    text = file.read_text()
    links = page.links("10.0.0.5")
    assert len(links) == text.count("<svg") == len(players) + 2
    assert all(link in text for _, link in links)
    assert keys(*command).exit_code == 0
    assert file.read_text() == text, "links that were printed stay good"
    assert keys(*command, "--tls").exit_code == 0
    served = open_page("127.0.0.1", None, players, keys=folder)
    assert all(link in file.read_text() for _, link in served.links("10.0.0.5"))
    assert served.links("10.0.0.5")[0][1].startswith("https://")
    for everywhere in ("0.0.0.0", "[::]:9001"):
        assert keys("sheet", GAME, "--keys", str(folder), "--listen", everywhere).exit_code == 0
        text = (folder / "sheet.html").read_text()
        assert f"http://{reached_at('0.0.0.0')[0]}:" in text, "an address that other machines reach"
        assert "//0.0.0.0" not in text
        assert "//[::]" not in text


@pytest.mark.parametrize(
    "broken",
    [
        lambda page, _: replace(page, certificate="C"),
        lambda page, _: replace(page, certificate=page.certificate[:200]),
        lambda page, _: replace(page, private_key=""),
        lambda page, other: replace(page, private_key=other.private_key),
    ],
    ids=["no certificate", "half a certificate", "no key", "the key of another"],
)
def test_a_broken_certificate_of_the_page_is_an_error_in_words(
    tmp_path: Path, broken: Callable[[Admission, Admission], Admission]
) -> None:
    page, other = (encrypted(admission("127.0.0.1", 8080, ["ann"])) for _ in range(2))
    (tmp_path / "page.json").write_text(broken(page, other).encoded())
    with pytest.raises(ConfigError, match=r"page.json: expected a certificate and its private key: .*vrg keys sheet"):
        open_page("127.0.0.1", None, ["ann"], keys=tmp_path)


def test_a_sheet_for_another_match_changes_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "keys"
    assert keys("init", GAME, "--keys", str(folder)).exit_code == 0
    assert keys("sheet", GAME, "--keys", str(folder)).exit_code == 0
    before = (folder / "page.json").read_bytes()
    done = keys("sheet", "roboflag", "--keys", str(folder))
    assert done.exit_code == 1
    assert "expected the authority of the match roboflag" in str(done.exception)
    assert (folder / "page.json").read_bytes() == before
    assert keys("init", GAME, "--keys", str(folder), "--replace").exit_code == 0
    assert not (folder / "sheet.html").exists()


def test_each_player_is_handed_its_own_keys(folder: Path, tmp_path: Path) -> None:
    done = keys("hand", "--keys", str(folder), "--output", str(tmp_path))
    assert done.exit_code == 0, done.output
    players = load_match(GAMES.get(GAME).default_match()).players
    assert {path.name for path in tmp_path.iterdir()} == {player.name for player in players}
    assert [path.name for path in (tmp_path / "player1").iterdir()] == ["player.player1"]
    assert keys("hand", "router", "--keys", str(folder), "--output", str(tmp_path / "router")).exit_code == 0
    none = keys("hand", "--keys", str(tmp_path / "router"), "--output", str(tmp_path / "all"))
    assert "expected keys of players, found none" in str(none.exception)
