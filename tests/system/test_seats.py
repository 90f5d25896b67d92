"""A match with seats: everybody gets what it should, and nobody can do what its seat may not."""

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from vrg.bus import messages as m
from vrg.bus.codec import Received, encode
from vrg.bus.configuration import client_settings
from vrg.bus.messages import Message
from vrg.bus.session import configuration, open_session
from vrg.config.loading import load_match
from vrg.errors import BusError
from vrg.recording.reader import read_tracks
from vrg.seats.credentials import Credentials, find_credentials
from vrg.seats.folder import KeysFolder
from vrg.seats.seat import Seat, SeatKind
from vrg.testing.processes.arena import Arena
from vrg.testing.processes.match import PLAYERS, LiveMatch, long_match, patient, short_match
from vrg.testing.waiting import DEADLINE
from vrg.types import STILL, Pose, Twist

pytestmark = pytest.mark.system

ANN, SHARK = Seat(SeatKind.PLAYER, "ann"), Seat(SeatKind.PLAYER, "shark")
FAR = 9e5
"""A number in every forged message, which no process of the match says by itself."""


@pytest.fixture(scope="module")
def guarded(arena: Arena, tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMatch]:
    """A long match with seats whose keys were made before, in play."""
    folder = tmp_path_factory.mktemp("guarded")
    text = patient(long_match("guarded"))
    (folder / "match.toml").write_text(text)
    roster = load_match(folder / "match.toml").roster
    KeysFolder(folder / "keys").make("guarded", roster.seats, datetime.now(UTC))
    # What is refused is in the log whatever people have set for other programs.
    running = arena.start(text, seats=folder / "keys", environment={"RUST_LOG": "off"})
    yield running
    running.close()


def seat(match: LiveMatch, wanted: Seat) -> Credentials:
    assert match.seats is not None
    return find_credentials(match.seats, [wanted])


def rogue(match: LiveMatch, folder: Path, **told: Any) -> Counter[str]:
    """Let a process with the keys in a folder do things; how many messages it has heard, by key."""
    told.setdefault("until", [match.keys.clock.key])
    done = subprocess.run(
        [sys.executable, "-m", "tests.system.rogue", match.endpoint, str(folder)],
        input=json.dumps(told),
        capture_output=True,
        text=True,
        timeout=DEADLINE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return Counter(json.loads(done.stdout))


def put(key: str, body: Message, stamp: float = 1.0) -> tuple[str, str]:
    """What a rogue publishes, which names as its sender one that may publish on the key."""
    _, _, first, *rest = key.split("/")
    senders = {"referee": "coordinator/referee", "official": "official/x", "estop": "official/x", "seat": "official/x"}
    sender = senders.get(first, "world/world")
    if rest[-1:] == ["manual"]:
        sender = "official/x"
    elif first in ("robot", "player") and rest[-1] in ("drive", "pose", "report"):
        sender = f"player/{rest[0]}"
    elif first == "team":
        sender = f"player/{rest[-1]}" if "say" in rest else f"commander/{rest[0]}"
    elif first == "pulse":
        sender = "/".join(rest)
    return key, encode(Received(key, stamp, 10_000, body, f"{sender}/1")).hex()


class Spy:
    """What an official hears, which is everything, with the payloads."""

    def __init__(self, match: LiveMatch) -> None:
        self.heard: list[tuple[str, bytes]] = []
        self._key = f"{match.keys.root}/**"
        self._stack = open_session(match.endpoint, credentials=seat(match, Seat(SeatKind.OFFICIAL)))

    def __enter__(self) -> "Spy":
        session = self._stack.__enter__()
        session.watch_raw(self._key, self._hear)
        return self

    def __exit__(self, *error: Any) -> None:
        self._stack.__exit__(*error)

    def _hear(self, key: str, payload: bytes) -> None:
        self.heard.append((key, payload))

    def got(self, key: str, payload: str) -> bool:
        return (key, bytes.fromhex(payload)) in self.heard


def test_a_whole_match_is_played_and_nothing_of_it_is_refused(start: Callable[..., LiveMatch]) -> None:
    match = start(short_match("whole"), seats=True, movers=())
    assert match.endpoint.startswith("tls/")
    window = match.join(Seat(SeatKind.WINDOW))
    window.wait_until(lambda: window.heard.states and window.heard.clocks and window.heard.poses, "what a window shows")
    late = match.join()
    late.wait_until(lambda: set(late.heard.limits) == set(PLAYERS), "the speed limits, which were told once")
    assert match.play_out() == 0
    log = match.log("router")
    assert match.seats is not None
    assert not match.seats.exists(), "keys for one run are gone with it"
    assert json.loads(match.run.result.read_text())["ended"].startswith("game over")
    refused = [line for line in log.splitlines() if "may not" in line and " window " not in line]
    assert refused == [], "the match's own processes do nothing that their seats may not"
    for name in (*PLAYERS, "world", "referee", "recorder"):
        assert "Traceback" not in match.log(name), match.log(name)
    assert not window.heard.limits, "a window needs none"
    tracks = read_tracks(match.run.recordings())
    assert set(tracks) == set(PLAYERS), "the recorder has heard everything that it records"


def test_who_has_a_players_keys_can_do_nothing_else_with_them(guarded: LiveMatch) -> None:
    keys, observer = guarded.keys, guarded.observer
    before = observer.state
    own = put(keys.report("ann").key, m.Report(mode="rogue", armed=False, fault="forged"))
    twist = Twist(0.123, 0.456)
    pose = Pose(FAR / 10, 0.0, 0.0)
    state = m.RefereeState(**{f: getattr(before, f) for f in before.__struct_fields__} | {"score": {"minnows": 999}})
    forged = [
        put(keys.referee_state.key, state, observer.now),
        put(keys.drive("bob").key, m.Drive(twist=twist)),
        put(keys.robot_pose("bob").key, m.MeasuredPose(pose=pose)),
        put(keys.report("bob").key, m.Report(mode="rogue", armed=False)),
        put(keys.manual("ann").key, m.Manual(forward=0.321, turn=0.0, lease=1.0), observer.now),
        put(keys.say("sharks", "shark").key, m.Say(words=b"\xa5rogue")),
        put(keys.say("minnows", "bob").key, m.Say(words=b"\xa5rogue")),
        put(keys.order("minnows").key, m.TeamOrder(priority="rogue", lease=2.0)),
        put(keys.referee_event.key, m.Call(number=999, rule="rogue", text="x", players=(), poses=(), clock=0.0)),
        put(keys.speed_limit("ann").key, m.SpeedLimit(v_max=99.0)),
        put(keys.recover("ann").key, m.Recover(by="rogue")),
        put(keys.clock.key, m.Clock(time=FAR, tick=1, epoch=99, rate=1.0, estop=False), FAR),
        put(keys.poses.key, m.Poses(bodies=(m.Body("ann", pose, STILL, False),))),
        put(keys.robot_state("ann").key, m.RobotState(armed=True, estop=False, fault="rogue")),
        put(keys.world_request.key, m.WorldRequest(places={"bob": pose})),
        put(keys.official.key, m.Official(action=m.OfficialAction.END, by="rogue")),
        put(keys.estop_release.key, m.EstopRelease(by="rogue")),
        put(keys.seat_request.key, m.SeatRequest(player="bob", strategy="rogue", by="rogue", id="1")),
        put(keys.pulse("player", "bob").key, m.Pulse(ticks=1, missed=0)),
    ]
    hidden = [keys.poses.key, keys.drive().key, keys.report().key, keys.world_request.key, keys.official.key]
    hidden += [keys.robot_state("bob").key, f"{keys.root}/robot/bob/sensor/**", keys.say("sharks").key]
    hidden += [f"{keys.root}/**"]
    with Spy(guarded) as spy:
        ann = seat(guarded, ANN).folder
        pretended = [keys.alive("world", "world", "rogue"), keys.alive("player", "bob", "rogue")]
        rogue(guarded, ann, put=[own, *forged], be=pretended, answer=[forged[0]])
        # In a process of its own: what a session publishes itself it hears without the router.
        heard = rogue(guarded, ann, listen=hidden)
        observer.wait_until(lambda: spy.got(*own), "what the rogue may say, which shows that it has spoken")
        observer.time_passes(0.5, "in which more might arrive")
    assert [key for key, payload in forged if spy.got(key, payload)] == []
    assert set(heard) == {keys.clock.key}, "it hears what it may, and nothing more"
    assert observer.playing or observer.stalled
    assert observer.state.score == before.score
    assert observer.now < FAR / 10
    assert observer.epoch == 0
    nodes = json.loads(guarded.command("topic", "list", "--json", "--for", "0.5"))["nodes"]
    assert nodes.count("world/world") == nodes.count("player/bob") == 1


def test_a_player_stops_all_robots_but_only_an_official_lets_them_go(guarded: LiveMatch, tmp_path: Path) -> None:
    keys, observer = guarded.keys, guarded.observer
    stick = tmp_path / "stick"
    guarded.command("keys", "hand", str(ANN), "--keys", str(guarded.seats), "--output", str(stick))
    where = (keys.match, "--router", guarded.endpoint, "--keys", str(stick))
    guarded.command("estop", *where, "--reason", "smoke")
    assert guarded.vrg("estop", "--release", *where).returncode == 1
    observer.wait_until(lambda: observer.state.estop and observer.state.halted, "the emergency stop")
    observer.wait_until(observer.standing, "all robots to stand")
    for held in (ANN, Seat(SeatKind.WINDOW), Seat(SeatKind.COMMANDER, "minnows")):
        rogue(guarded, seat(guarded, held).folder, put=[put(keys.estop_release.key, m.EstopRelease(by="rogue"))])
    observer.time_passes(0.5, "in which a release might arrive")
    assert observer.state.estop
    assert observer.heard.releases == 0
    guarded.command("estop", "--release")
    observer.wait_until(lambda: not observer.state.estop, "the release")
    guarded.resume()


@pytest.mark.thorough
def test_the_commands_of_officials_find_the_keys_of_a_match_on_this_machine(guarded: LiveMatch) -> None:
    keys = guarded.keys
    lines = guarded.command("topic", "echo", "robot/*/drive", "--count", "3", "--json").splitlines()
    drives = [json.loads(line) for line in lines]
    assert all({"key", "sender", "stamp", "sequence", "twist", "armed"} == set(drive) for drive in drives)
    assert {drive["key"].split("/")[3] for drive in drives} <= set(PLAYERS)
    where = (keys.match, "--router", guarded.endpoint)
    restarts = guarded.said().count("started again")
    strategy = "sharks-and-minnows"
    assert "plays by" in guarded.command("official", "substitute", "cid", strategy, keys.match)
    guarded.go_on()
    assert guarded.said().count("started again") == restarts
    folder = guarded.seats
    assert folder is not None
    stick = folder.parent / "stick"
    guarded.command("keys", "hand", "window", "--keys", str(folder), "--output", str(stick))
    refused = guarded.vrg("official", "halt", *where, "--keys", str(stick))
    assert refused.returncode == 1
    assert "expected the keys of the seat official, found those of window" in refused.stderr


@pytest.mark.thorough
def test_after_the_router_has_died_everybody_gets_in_again_and_nobody_else(guarded: LiveMatch) -> None:
    guarded.lose_router()
    late = guarded.join()
    late.wait_until(lambda: set(late.heard.limits) == set(PLAYERS), "the speed limits, which were told once")
    forged = put(guarded.keys.referee_event.key, m.Call(number=9, rule="x", text="x", players=(), poses=(), clock=0.0))
    with Spy(guarded) as spy:
        rogue(guarded, seat(guarded, ANN).folder, put=[forged])
        assert not spy.got(*forged)


def test_who_has_no_certificate_is_refused(guarded: LiveMatch) -> None:
    with pytest.raises(BusError, match="admits only seats with keys"), open_session(guarded.endpoint):
        pass
    plain = guarded.endpoint.replace("tls/", "tcp/")
    with pytest.raises(BusError, match="none answered"), open_session(plain, patience=0.5):
        pass
    import zenoh  # noqa: PLC0415 - what VRG itself never tries

    settings = client_settings(guarded.endpoint, seat(guarded, ANN))
    settings["transport"]["link"]["tls"] = {
        "root_ca_certificate": settings["transport"]["link"]["tls"]["root_ca_certificate"]
    }
    with pytest.raises(zenoh.ZError):
        zenoh.open(configuration(settings))
    assert guarded.observer.playing or guarded.observer.stalled
