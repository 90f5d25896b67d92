"""Where the page is served, how its process gets the tokens, and what is printed of them."""

import io
import os
import socket
from types import SimpleNamespace

import pytest
import typer
from rich.console import Console

from tests.test_machines import load
from vrg.commands.groups import PlayOptions
from vrg.commands.options import web_address
from vrg.commands.page import encrypted, open_page, page_of, print_links, reached_at
from vrg.errors import ConfigError, LaunchError
from vrg.kinds import WEB
from vrg.launch import managed, process_main
from vrg.launch.endpoints import free_port
from vrg.launch.fork_server import ForkServer
from vrg.launch.managed import ManagedProcess
from vrg.launch.plan import processes_at
from vrg.launch.process import Process
from vrg.seats.authority import fingerprint, validity
from vrg.testing.command_line import invoke
from vrg.testing.waiting import wait_until
from vrg.ui.web.admission import Admission, admission


@pytest.mark.parametrize(
    ("typed", "address"),
    [
        (None, ("127.0.0.1", None)),
        ("0.0.0.0", ("0.0.0.0", None)),
        ("192.168.1.5:9000", ("192.168.1.5", 9000)),
        ("lab2:80", ("lab2", 80)),
        ("::1", ("::1", None)),
        ("[::1]:9000", ("::1", 9000)),
        ("[::]", ("::", None)),
    ],
)
def test_addresses(typed, address):
    assert web_address(typed) == address


@pytest.mark.parametrize("typed", ["", ":8080", "lab2:", "lab2:port", "lab2:0", "lab2:70000", "[]:80"])
def test_what_is_no_address_is_told(typed):
    with pytest.raises(typer.BadParameter, match="expected an address such as"):
        web_address(typed)


def test_the_usual_port_or_the_next_free_one_is_taken_but_one_that_was_asked_for_must_be_free():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        assert port < free_port("127.0.0.1", port) < port + 20
        with pytest.raises(LaunchError, match=f"port {port} of 127.0.0.1 cannot be used: Address already in use"):
            open_page("127.0.0.1", port, ["ann"])
    assert open_page("127.0.0.1", port, ["ann"]).port == port


def test_each_link_is_printed_whole_in_one_line_and_who_serves_it_to_others_is_told_who_can_see_it():
    out = io.StringIO()
    name = "a [bold] name of the longest kind that a player may have in a match"[:64]
    page = admission("127.0.0.1", 8080, [name])
    print_links(page, Console(file=out, width=40))
    lines = out.getvalue().splitlines()
    assert [line.split()[-1] for line in lines[:3]] == [link for _, link in page.links("127.0.0.1")]
    assert lines[2].startswith(f"drive {name} ")
    assert "unencrypted" not in out.getvalue()
    out = io.StringIO()
    print_links(admission("0.0.0.0", 8080, []), Console(file=out, width=200))
    assert "everybody who reaches this machine can watch" in out.getvalue()
    assert "0.0.0.0" not in out.getvalue()


def test_a_page_of_https_is_told_by_its_fingerprint_and_keeps_its_certificate_while_it_is_valid(monkeypatch):
    page = encrypted(admission("0.0.0.0", 8080, []))
    found = validity(page.certificate.encode())
    assert {"localhost", "127.0.0.1", socket.gethostname(), *reached_at("0.0.0.0")} <= set(found.hosts)
    out = io.StringIO()
    print_links(page, Console(file=out, width=40, emoji=False))
    assert f"fingerprint is {fingerprint(page.certificate)}" in out.getvalue()
    assert "unencrypted" not in out.getvalue()
    assert encrypted(page) == page
    monkeypatch.setattr("vrg.commands.page.datetime", SimpleNamespace(now=lambda zone: found.ends))
    assert encrypted(page).certificate != page.certificate


def test_a_page_that_another_program_shows_to_others_has_the_address_and_tokens_from_its_file(tmp_path):
    known = Admission("127.0.0.1", free_port("127.0.0.1", 18_080), "official-token", {"ann": "seat-token"})
    file = tmp_path / "page.json"
    file.write_text(known.encoded())
    assert PlayOptions(page=file).address is not None
    assert open_page("0.0.0.0", None, ["ann"], known=page_of(file)) == known
    file.write_text("{")
    with pytest.raises(ConfigError, match=r"page\.json: expected the tokens"):
        page_of(file)
    for wrong in ({"tls": True}, {"listen": "0.0.0.0"}, {"in_process": True}):
        with pytest.raises(typer.BadParameter):
            PlayOptions(page=file, **wrong).check()


def test_encryption_needs_a_page():
    done = invoke("play", "roboflag", "--tls", "--headless", "--dry-run")
    assert done.exit_code == 2
    assert "add --web or --listen" in done.output


def test_the_page_runs_where_the_match_is_launched(tmp_path):
    setup = load(tmp_path)
    views = [Process(name=WEB.process, kind=WEB.name)]
    found = {s.name: s for s in processes_at(setup, tmp_path, "tcp/h:1", window=False, record=False, views=views)}
    web = found[WEB.process]
    assert web.machine == "here"
    assert not web.essential
    assert web.title.startswith("vrg web in ")
    assert WEB.process not in {s.name for s in processes_at(setup, tmp_path, "tcp/h:1", window=False, record=False)}


def test_a_process_is_given_its_secret_at_each_start_and_in_no_argument(tmp_path, monkeypatch):
    (tmp_path / "listening.py").write_text(
        "import os, sys; print(sys.argv, os.environ); print(len(sys.stdin.readline().strip()), flush=True)"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(managed, "process_main", SimpleNamespace(__name__="listening"))
    process = ManagedProcess(Process(name="web", kind="web"), tmp_path / "log", ForkServer(), "t0ken")
    for _ in range(2):
        process.start()
        wait_until(lambda: process.exit_status is not None, "it to end")
        assert process.exit_status == 0
    log = (tmp_path / "log").read_text()
    assert log.splitlines()[1::2] == ["5", "5"]
    assert "t0ken" not in log, "it is in no argument and in no variable"


def test_a_page_without_its_tokens_says_that_its_supervisor_is_gone(monkeypatch):
    reader, writer = os.pipe()
    os.write(writer, b'{"host": "127.0.0.1"')
    os.close(writer)
    monkeypatch.setattr(process_main, "LEASH", reader)
    with pytest.raises(LaunchError, match="the supervisor is gone"):
        process_main.read_secret()
    os.close(reader)
