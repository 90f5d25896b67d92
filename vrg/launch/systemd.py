"""Units of systemd with which the processes of a match start by themselves, on the machines that the match file names.

This module computes texts; it starts and writes nothing. Directives are those of systemd.unit(5), systemd.service(5)
and systemd.exec(5).
"""

import os
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from vrg.bus.names import chunk_of
from vrg.config.files import HERE, WINDOW
from vrg.config.setup import MatchSetup
from vrg.launch.keeping import files_of
from vrg.launch.sandbox.excess import THREADS
from vrg.launch.specs import kind_of, placed, seats_at, window_of

RUN = "run"
"""The name of the unit of the run folder."""
_HARDENING = """\
NoNewPrivileges=yes
ProtectSystem=full
ProtectHome=read-only
PrivateTmp=yes
RestrictSUIDSGID=yes
LockPersonality=yes
"""
_CAN = "RestrictAddressFamilies=AF_INET AF_INET6 AF_UNIX AF_CAN AF_NETLINK\n"
_NO_CAN = "RestrictAddressFamilies=AF_INET AF_INET6 AF_UNIX AF_NETLINK\n"


@dataclass(frozen=True)
class Installation:
    """The installation of VRG and of a match on a machine.

    Args:
        vrg: the path of the command `vrg`. folder: the folder of the match file.
        match_file: the name of the match file in it. user: who runs the processes.
        router: the endpoint of the router that the machine's processes use.
        upstream: the endpoint of the router of the match, if the machine has a further one.
        keys: the folder of the keys of the machine's seats; None in a match without seats.
        display: the display for windows.
    """

    vrg: PurePosixPath
    folder: PurePosixPath
    match_file: str
    user: str
    router: str
    upstream: str | None = None
    keys: PurePosixPath | None = None
    display: str | None = None


def unit_files(
    setup: MatchSetup, installations: Mapping[str, Installation], *, window: bool
) -> dict[str, dict[str, str]]:
    """The units of a match, by machine and by the file's name.

    On each machine a target starts all processes of the match. The units of players come after those of the world, so
    that systemd, which stops in the reverse order, stops players first and routers last. A process that is started
    again after it died finds the journal and the snapshot of the match. When the target is stopped, the run folder is
    put aside, so that the next start is another match.

    Args:
        installations: of each machine that the match uses. window: True adds the window.
    """
    where = placed(setup, window=window, record=True)
    found: dict[str, dict[str, str]] = {machine: {} for machine in installations}
    for process, machine in where.items():
        if machine in found:
            found[machine][f"{_unit(setup, process)}.service"] = _service(setup, process, where, installations[machine])
    for machine, at in installations.items():
        found[machine][f"{_unit(setup, RUN)}.service"] = _run_service(setup, at)
    for machine, texts in found.items():
        services = " ".join(name for name in texts)
        texts[f"{_stem(setup)}.target"] = (
            f"[Unit]\nDescription=VRG match {setup.name} on {machine}\nWants={services}\n\n"
            "[Install]\nWantedBy=multi-user.target\n"
        )
    return found


def _stem(setup: MatchSetup) -> str:
    """The beginning of the names of all units. They have ASCII letters only."""
    return f"vrg-{chunk_of(setup.name)}"


def _unit(setup: MatchSetup, process: str) -> str:
    return f"{_stem(setup)}-{chunk_of(process)}"


def _plain(text: str) -> str:
    """A text as systemd reads it where a line is no list of words."""
    return text.replace("%", "%%")


def _run_service(setup: MatchSetup, at: Installation) -> str:
    """The unit that makes the run folder before all others start, and puts it aside when all have stopped."""
    run = f"/var/lib/{_stem(setup)}/run"
    return (
        f"[Unit]\nDescription=VRG match {setup.name}: the run folder\nPartOf={_stem(setup)}.target\n\n"
        f"[Service]\nType=oneshot\nRemainAfterExit=yes\nUser={at.user}\nStateDirectory={_stem(setup)}\n"
        f"ExecStart=/bin/mkdir -p {run}\n"
        f"ExecStop=/bin/sh -c 'mv {run} {run}-$$(date +%%Y%%m%%d-%%H%%M%%S)'\n{_HARDENING}"
    )


def _service(setup: MatchSetup, process: str, where: Mapping[str, str], at: Installation) -> str:
    kind = kind_of(setup, process)
    before = _started_before(setup, process, where)
    lines = ["[Unit]", f"Description=VRG match {setup.name}: {process}"]
    lines += [f"After={' '.join(['network-online.target', *before])}", "Wants=network-online.target"]
    # A CAN adapter may come much later than the computer.
    lines += [
        "StartLimitIntervalSec=0",
        f"Requires={_unit(setup, RUN)}.service",
        f"PartOf={_stem(setup)}.target",
        "",
        "[Service]",
    ]
    lines += [f"ExecStart={' '.join(map(_quoted, _command(setup, process, at)))}", f"User={at.user}"]
    lines += [f"WorkingDirectory={_plain(str(at.folder))}", f"StateDirectory={_stem(setup)}"]
    if process == WINDOW and at.display is not None:
        lines.append(f"Environment=DISPLAY={at.display}")
    # A process that comes back takes the place of the one that died; a window that was closed stays closed.
    lines += ["Restart=on-failure" if process == WINDOW else "Restart=always", "RestartSec=1", "TimeoutStopSec=10"]
    if kind == "player":
        lines += [f"MemoryMax={setup.memory + 500}M", f"TasksMax={THREADS}"]
    drives = kind is None or process in setup.physical
    return "\n".join(lines) + "\n" + _HARDENING + (_CAN if drives else _NO_CAN)


def _started_before(setup: MatchSetup, process: str, where: Mapping[str, str]) -> list[str]:
    """The units of the same machine that start before this one, and stop after it."""
    kinds = {name: kind_of(setup, name) for name, machine in where.items() if machine == where[process]}
    first: tuple[str | None, ...] = () if kinds[process] == "router" else ("router",)
    if kinds[process] == "player":
        first = ("router", "world", None)  # the companions have no kind
    here = [name for name, kind in kinds.items() if kind in first]
    return [f"{_unit(setup, name)}.service" for name in (RUN, *here)]


def _command(setup: MatchSetup, process: str, at: Installation) -> list[str]:
    """The command line of a process."""
    keys = [] if at.keys is None else ["--keys", str(at.keys)]
    match, run = at.match_file, f"/var/lib/{_stem(setup)}/run"
    kind = kind_of(setup, process)
    if kind is None:
        return [str(at.vrg), *next(c.arguments for c in setup.companions if c.name == process)]
    if kind == "router":
        upstream = ["--upstream", at.upstream] if process != "router" and at.upstream else []
        seats = [match, *keys] if keys else []
        return [str(at.vrg), "node", "router", *seats, "--router", at.router, *upstream]
    if kind == "hud":
        return [str(at.vrg), "show", kind, window_of(setup)[1], match, "--router", at.router, *keys]
    words = ["show", "window"] if kind == "spectator" else ["node", kind, *([process] if kind == "player" else [])]
    return [str(at.vrg), *words, match, "--router", at.router, "--run", run, *keys]


def _quoted(word: str) -> str:
    """A word of a command line, as systemd reads it."""
    plain = word.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{plain}"' if any(sign in word for sign in " \"'\\;") else plain


def league_units(vrg: PurePosixPath, folder: PurePosixPath, at: str, arguments: Sequence[str]) -> dict[str, str]:
    """The units of a user that let a league play every night, by the file's name.

    A run that was missed, because the computer was off, is made up for when it is on again.

    Args:
        vrg: the path of the command `vrg`. folder: that of the entries. at: the time of day, such as `02:00`.
        arguments: of `vrg league play` after the folder.
    """
    stem = "vrg-league-" + "".join(sign if sign.isascii() and sign.isalnum() else "-" for sign in folder.name)
    command = [str(vrg), "league", "play", str(folder), *arguments]
    about = _plain(f"VRG league {folder.name}")
    return {
        f"{stem}.service": (
            f"[Unit]\nDescription={about}\n\n[Service]\nType=oneshot\n"
            f"ExecStart={' '.join(map(_quoted, command))}\nNice=10\nNoNewPrivileges=yes\n"
            # As Ctrl-C does: what was played is kept, and the pages are written.
            "KillSignal=SIGINT\nSuccessExitStatus=130\nTimeoutStopSec=60\n"
        ),
        f"{stem}.timer": (
            f"[Unit]\nDescription={about}, every night\n\n[Timer]\nOnCalendar=*-*-* {at}:00\nPersistent=true\n\n"
            "[Install]\nWantedBy=timers.target\n"
        ),
    }


def install_commands(
    setup: MatchSetup,
    machine: str,
    names: Sequence[str],
    units_in: Path,
    folder: str,
    keys: str | None,
    *,
    window: bool,
) -> list[str]:
    """The commands that bring a machine its match, keys and units, and start them, as a person types them here.

    Args:
        names: the names of the machine's units. units_in: their folder here.
        folder: the folder of the match file on the machine.
        keys: the folder of the keys there; None in a match without seats.
    """
    host = setup.hosts[machine].host if machine in setup.hosts else None

    def there(command: str) -> str:
        return command if host is None else f"ssh -t {host} {shlex.quote(command)}"

    def bring(paths: str, to: str) -> str:
        return f"cp -r {paths} {shlex.quote(to)}" if host is None else f"scp -r {paths} {host}:{shlex.quote(to)}"

    by_place: dict[str, list[str]] = {folder: [setup.origin]}
    for place, source in files_of(setup).copies.items():
        by_place.setdefault((PurePosixPath(folder) / place.parent).as_posix(), []).append(os.path.relpath(source))
    # The units lie in a folder that only the user can write, and are named one by one: whatever another user had put
    # among them would be root's.
    staged = (PurePosixPath(folder) / "units").as_posix()
    made = shlex.join([*by_place, staged, *([keys] if keys else [])])
    lines = [there(f"sudo install -d -m 755 -o $USER {made}")]
    lines += [bring(shlex.join(sources), f"{to}/") for to, sources in by_place.items()]
    if keys is not None:
        seats = " ".join(map(str, seats_at(setup, machine, window=window, record=True)))
        own = shlex.quote(f"{units_in}/keys")
        lines += [f"vrg keys hand {seats} --output {own}", bring(f"{own}/*", f"{keys}/")]
    lines.append(bring(shlex.join(str(units_in / name) for name in names), f"{staged}/"))
    sources = shlex.join(f"{staged}/{name}" for name in names)
    lines.append(there(f"sudo install -m 644 -t /etc/systemd/system {sources} && sudo systemctl daemon-reload"))
    start = there(f"sudo systemctl start {_stem(setup)}.target")
    return [*lines, f"{start}   # and `enable` in place of `start`, to start it with the machine"]


def used_machines(setup: MatchSetup, *, window: bool) -> list[str]:
    """The machines on which something of a match runs, the launcher's first.

    Args:
        window: True counts the window.
    """
    used = set(placed(setup, window=window, record=True).values())
    return [name for name in (HERE, *setup.hosts) if name in used]
