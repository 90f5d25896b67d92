"""Where pages are served, and the links that are handed out."""

import io
import json
import re
import socket
import stat
from collections import namedtuple
from importlib.resources import files
from pathlib import Path
from typing import Any

import psutil
import pytest
import typer
from rich.console import Console
from served_class import serve

from vrg.errors import ConfigError
from vrg.seats.authority import validity
from vrg_class.command import opened
from vrg_class.languages import preferred
from vrg_class.links import PAGE_FILE, Served, served_at

Entry = namedtuple("Entry", "family address")


def at(folder: Path, name: str | None = None, *, tls: bool = False) -> Served:
    return served_at(folder, "0.0.0.0", 18500, "the class", tls=tls, name=name)


def shown(served: Served) -> list[str]:
    out = io.StringIO()
    served.show([("students", "#join=x"), ("teacher", "teacher.html#y")], Console(file=out, width=300))
    return out.getvalue().splitlines()


def test_links_have_all_addresses_and_say_which_are_of_docker_or_a_vpn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interfaces = {
        "lo": "127.0.0.1",
        "docker0": "172.17.0.1",
        "wlan0": "192.168.1.5",
        "tailscale0": "100.64.0.2",
    }
    found = {name: [Entry(socket.AF_INET, address)] for name, address in interfaces.items()}
    monkeypatch.setattr(psutil, "net_if_addrs", lambda: found)
    lines = shown(at(tmp_path))
    assert [line.split("//")[1].split(":")[0] for line in lines[::2]] == ["192.168.1.5", "172.17.0.1", "100.64.0.2"]
    assert "(" not in lines[0]
    assert "Docker" in lines[2]
    assert "VPN" in lines[4]
    assert lines[0].startswith("students  http://192.168.1.5:")
    assert lines[0].endswith("/#join=x")


def test_a_name_takes_the_place_of_the_addresses(tmp_path: Path) -> None:
    (first, second) = shown(at(tmp_path, "robots.school.example"))
    assert first.startswith("students  http://robots.school.example:")
    assert second.startswith("teacher   http://robots.school.example:")
    assert shown(at(tmp_path, "robots.school.example:8443", tls=True))[0] == (
        "students  https://robots.school.example:8443/#join=x"
    )
    for wrong in ("robots school", "a/b", "x:y"):
        with pytest.raises(typer.BadParameter, match="expected"):
            at(tmp_path, wrong)


def test_the_token_and_the_certificate_stay_when_it_is_started_again(tmp_path: Path) -> None:
    first = at(tmp_path, "lab", tls=True).page
    assert "lab" in validity(first.certificate.encode()).hosts
    again = at(tmp_path, "lab", tls=True).page
    assert (again.official, again.certificate) == (first.official, first.certificate)
    assert at(tmp_path, "other", tls=True).page.certificate != first.certificate, "it must have the name"
    plain = at(tmp_path).page
    assert (plain.official, plain.certificate) == (first.official, "")
    assert stat.S_IMODE((tmp_path / PAGE_FILE).stat().st_mode) & 0o77 == 0
    (tmp_path / PAGE_FILE).write_text("{}")
    with pytest.raises(ConfigError, match="remove it"):
        at(tmp_path)


def test_a_picture_of_a_link_needs_no_token_in_an_address(tmp_path: Path) -> None:
    found = serve(opened(tmp_path / "class", "sharks-and-minnows", None, None, None))
    try:
        status, answer = found.ask("/qr", "", text="http://192.168.1.5:8090/#join=secret")
        assert status == 200
        assert answer["svg"].startswith("<svg")
        assert found.get("/qr.svg?text=x")[0] == 404
        assert found.ask("/qr", "", text=5)[0] == 400
        links = [f"http://student/{n}" for n in range(3)]
        assert {found.ask("/qr", "", text=link)[0] for link in links} == {200}, "a teacher looks at one after the other"
        told = [found.ask("/qr", "", text=f"http://other/{n}")[0] for n in range(20)]
        assert 400 in told, "whoever asks for ever new ones must wait"
        assert found.ask("/qr", "", text="http://192.168.1.5:8090/#join=secret")[0] == 200, "but for one that is there"
    finally:
        found.site.stop()


@pytest.mark.parametrize(
    ("accepted", "language"),
    [
        ("de-CH,de;q=0.9,en;q=0.8", "de"),
        ("it,fr;q=0.5,de;q=0.7", "de"),
        ("en-GB,de", "en"),
        ("it", "en"),
        ("", "en"),
        ("de;q=0,fr", "fr"),
        ("de;q=x,,;q=1", "en"),
        ("en; q=0.5, de; q=0.9", "de"),
    ],
)
def test_a_page_has_the_language_that_its_browser_prefers(accepted: str, language: str) -> None:
    assert preferred(accepted, ("en", "de", "fr")) == language


def fields(text: object) -> set[str]:
    """The names in {} of a text, or of its forms."""
    return set(re.findall(r"{(\w+)}", json.dumps(text, ensure_ascii=False)))


def flat(texts: dict[str, Any], above: str = "") -> dict[str, Any]:
    """Texts by their keys, such as `student.try`; the forms of one text stay together."""
    found: dict[str, Any] = {}
    for key, text in texts.items():
        if isinstance(text, dict) and "other" not in text:
            found |= flat(text, f"{above}{key}.")
        else:
            found[above + key] = text
    return found


@pytest.mark.parametrize("language", ["de", "es", "fr"])
def test_every_language_has_all_words_with_the_same_fields(language: str) -> None:
    own, english = (
        flat(json.loads((files("vrg_class") / "words" / f"{tag}.json").read_text(encoding="utf-8")))
        for tag in (language, "en")
    )
    assert own.keys() == english.keys()
    assert [key for key, text in english.items() if fields(text) != fields(own[key])] == []
    same = [key for key, text in english.items() if text == own[key] and len(str(text)) > 20]
    assert [key for key in same if not key.startswith("offers.")] == ["student.title"], "translated"
