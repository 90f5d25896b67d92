"""The commands that serve the page with a link of the official's that opens the details."""

import io
from contextlib import contextmanager
from types import SimpleNamespace

import pytest
from rich.console import Console

from vrg.commands import page as commands
from vrg.commands.groups import MatchOptions, PlayOptions
from vrg.commands.page import print_links
from vrg.kinds import WEB
from vrg.testing.command_line import invoke, play_options
from vrg.ui.web.admission import Admission, admission, read_admission
from vrg_views.developer.command import developer


def test_the_officials_link_alone_opens_the_details() -> None:
    out, page = io.StringIO(), admission("127.0.0.1", 8080, ["ann"])
    print_links(page, Console(file=out, width=200), "details")
    watch, official, drive = (line.split()[-1] for line in out.getvalue().splitlines()[:3])
    assert official == f"http://127.0.0.1:8080/#{page.official}&details"
    assert (watch, drive) == ("http://127.0.0.1:8080/", f"http://127.0.0.1:8080/#{page.seats['ann']}")


@pytest.mark.parametrize(("official", "driven"), [(True, ["ann", "bob"]), (False, [])])
def test_it_serves_the_page_of_a_running_match_also_without_the_officials_keys(
    monkeypatch: pytest.MonkeyPatch, official: bool, driven: list[str]
) -> None:
    served: list[Admission] = []

    def serve(kind: object, *, secret: str) -> None:
        assert kind is WEB
        served.append(read_admission(secret))

    running = SimpleNamespace(endpoint="", keys=None, known_setup=lambda: None, serve=serve)
    state = SimpleNamespace(players=[SimpleNamespace(name=name) for name in ("ann", "bob")])

    @contextmanager
    def connected(*_of: object, **_how: object):  # type: ignore[no-untyped-def]
        yield None, None

    monkeypatch.setattr(commands, "attached", lambda _on: running)
    monkeypatch.setattr(commands, "connected", connected)
    monkeypatch.setattr(commands, "first_state", lambda *_of: state)
    monkeypatch.setattr(commands, "credentials_for", lambda *_of: None)
    monkeypatch.setattr(commands, "is_official", lambda _of: official)
    developer(MatchOptions())
    commands.web(MatchOptions())
    [details, plain] = served
    assert (bool(details.official), [*details.seats]) == (True, driven)
    assert bool(plain.official) == official, "who only watches gets no link to decide by"


def test_a_match_that_is_played_with_it_has_a_page_and_its_window() -> None:
    assert play_options("--developer").address == PlayOptions(web=True).address
    assert play_options("--developer").drawer == "details"
    assert PlayOptions().address is None


def test_a_match_in_one_process_has_none() -> None:
    told = invoke("play", "practice", "--in-process", "--developer")
    assert told.exit_code == 2
    assert "--developer needs the bus" in told.output
