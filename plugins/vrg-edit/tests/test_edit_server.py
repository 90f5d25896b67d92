"""The server of the configurator's page: only who holds its token is answered, and no other site."""

import json
import urllib.error
import urllib.request
from urllib.parse import urlsplit

import pytest

from vrg_edit.editor import Editor, NextStep
from vrg_edit.server import EditServer


def asked(server: EditServer, path: str, body: bytes = b"", *, token: str = "", **headers: str) -> tuple[int, str]:
    url = server.link.partition("#")[0] + path
    headers = {"Authorization": f"Bearer {token}", **headers}
    try:
        with urllib.request.urlopen(urllib.request.Request(url, body, headers), timeout=60) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


def of(link: str) -> str:
    return link.partition("#")[2]


LOOK = b'{"do": "look"}'


@pytest.mark.parametrize("token", ["", "guessed", "gu\xe9ssed"])
def test_without_its_token_nobody_reads_or_changes_anything(server: EditServer, desk: Editor, token: str) -> None:
    for path, body in (("edit", LOOK), ("edit", b'{"do": "leave", "sure": true}'), ("ticket", b"")):
        status, told = asked(server, path, body, token=token)
        assert (status, told) == (401, "expected the token of the link that the terminal shows")
    assert desk.outcome is None


def test_a_ticket_is_good_once_and_is_no_token(server: EditServer) -> None:
    ticket = of(server.ticket)
    assert asked(server, "edit", LOOK, token=ticket)[0] == 401
    assert asked(server, "ticket", token=ticket) == (200, of(server.link))
    assert asked(server, "ticket", token=ticket)[0] == 401
    assert asked(server, "ticket", token=of(server.link)) == (200, of(server.link))


@pytest.mark.parametrize("headers", [{"Origin": "http://evil.example"}, {"Host": "evil.example"}])
def test_other_sites_are_turned_away_even_with_the_token(server: EditServer, headers: dict[str, str]) -> None:
    status, told = asked(server, "edit", LOOK, token=of(server.link), **headers)
    assert status == 403
    assert "evil.example" in told


def test_a_request_that_is_none_is_told(server: EditServer) -> None:
    for body in (b"", b"{}", b'{"do": "save"}', b'{"do": "look", "more": 1}'):
        status, told = asked(server, "edit", body, token=of(server.link))
        assert (status, told.startswith("expected a request of the configurator's page")) == (400, True)


def test_the_end_is_answered_before_it_is_told(server: EditServer) -> None:
    assert server.wait(0.0) is None
    own = {"token": of(server.link), "Origin": "http://" + urlsplit(server.link).netloc}
    assert json.loads(asked(server, "edit", LOOK, **own)[1])["begins"] == "start"
    status, told = asked(server, "edit", b'{"do": "leave"}', **own)
    assert (status, json.loads(told)["ended"]) == (200, True)
    assert server.wait(60.0) == NextStep()
