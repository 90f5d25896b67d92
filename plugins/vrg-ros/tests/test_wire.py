"""Keys, tokens and attachments: as rmw_zenoh's own documents have them, and as another implementation reads them."""

import itertools
import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import zenoh
import zenoh.ext
from rosbags.interfaces import Nodetype

from vrg.bus.configuration import client_settings
from vrg.bus.session import Session, configuration, open_session
from vrg.types import Twist
from vrg_ros import messages
from vrg_ros.cdr import HASHES, STORE, decode, encode
from vrg_ros.graph import FLOODED, QUEUE_LENGTH, RosNode
from vrg_ros.wire import ATTACHMENT, Identity, Kind, Qos, attachment, data_key, gid_of

READER = """
import json, sys, time
from pathlib import Path
from zenoh_ros2_sdk import ROS2Subscriber, get_topic_names_and_types, get_registry
port, wanted, messages = int(sys.argv[1]), json.loads(sys.argv[2]), Path(sys.argv[3])
get_registry().messages_dir = messages
found, heard = [], {}
deadline = time.monotonic() + 60.0
while len(found) < len(wanted) and time.monotonic() < deadline:
    found = get_topic_names_and_types(domain_id=7, router_port=port, timeout=1.0)
subscribers = [
    ROS2Subscriber(topic, kinds[0], lambda message, topic=topic: heard.setdefault(topic, []).append(message),
                   domain_id=7, router_port=port)
    for topic, kinds in found
]
while any(len(heard.get(topic, [])) < 20 for topic in wanted) and time.monotonic() < deadline:
    time.sleep(0.05)
for each in subscribers:
    each.close()
print(json.dumps({"graph": found, "heard": {t: len(m) for t, m in heard.items()},
                  "x": heard["/m/ann/pose"][0].pose.position.x, "text": heard["/m/say"][0].data}))
"""
"""A program of another implementation (zenoh_ros2_sdk): it lists the graph, and reads each topic."""


def test_the_forms_are_those_of_the_middleware() -> None:
    """The examples of rmw_zenoh's docs/design.md, in which /chatter is published by a talker in domain 0."""
    of, hashed = "std_msgs/String", HASHES["std_msgs/String"]
    assert data_key(0, "/chatter", of) == f"0/chatter/std_msgs::msg::dds_::String_/{hashed}"
    talker = Identity(0, "aac3178e146ba6f1fc6e6a4085e77f21", 0, "", "talker")
    assert talker.token == "@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/talker"
    assert talker.endpoint(Kind.PUBLISHER, 10, "/chatter", of, Qos(depth=7)) == (
        "@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/"
        f"{hashed}/::,7:,:,:,,"
    )
    assert Qos(depth=5).chunk == "::,5:,:,:,,"
    assert Qos(transient=True, depth=1).chunk == ":1:,1:,:,:,,"


def test_an_attachment_has_number_time_and_id() -> None:
    gid = gid_of("a token")
    assert ATTACHMENT.unpack(attachment(3, 5_000_000_000, gid)) == (3, 5_000_000_000, 16, gid)
    assert len(attachment(1, 0, gid)) == 33


def definitions(folder: Path) -> Path:
    """The definitions of all types as the other implementation wants them, a file each."""
    for kind, (_, fields) in STORE.fielddefs.items():
        file = (folder / kind).with_suffix(".msg")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("".join(f"{words(of)} {field}\n" for field, of in fields))
    return folder


def words(one: Any) -> str:
    """The type of a field as a definition has it."""
    form, what = one
    if form == Nodetype.BASE:
        return str(what[0])
    if form == Nodetype.NAME:
        return str(what).replace("/msg/", "/")
    return f"{words(what[0])}[{what[1] or ''}]"


def test_another_implementation_lists_the_graph_and_reads_every_type(
    tmp_path: Path, endpoint: str, session: Session
) -> None:
    topics = {f"/m/{kind.split('/')[1].lower()}": kind for kind in HASHES}
    topics |= {"/m/ann/pose": "geometry_msgs/PoseStamped", "/m/say": "std_msgs/String"}
    said = {"/m/ann/pose": {"pose": {"position": {"x": 1.5}}}, "/m/say": {"data": "grüezi"}}
    stop = threading.Event()
    node = RosNode(session, 7, "vrg", "/m")

    def talk() -> None:
        while not stop.wait(0.05):
            for topic, kind in topics.items():
                node.publish(topic, kind, said.get(topic, {}))

    talker = threading.Thread(target=talk)
    talker.start()
    try:
        command = [sys.executable, "-P", "-c", READER, endpoint.rpartition(":")[2], json.dumps(list(topics))]
        command.append(str(definitions(tmp_path)))
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    finally:
        stop.set()
        talker.join()
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout.splitlines()[-1])
    assert dict(found["graph"]) == {topic: [kind.replace("/", "/msg/")] for topic, kind in topics.items()}
    assert found["heard"].keys() == topics.keys()
    assert all(count >= 20 for count in found["heard"].values())
    assert (found["x"], found["text"]) == (1.5, "grüezi")


def test_nodes_that_are_peers_find_one_another_and_the_match(endpoint: str, session: Session) -> None:
    """Peers with gossip, as rmw_zenoh's configuration of sessions has them, at VRG's router."""
    gossip = {"enabled": True, "multihop": False, "autoconnect": {"router": [], "peer": ["router", "peer"]}}
    settings = {
        "mode": "peer",
        "connect": {"endpoints": [endpoint]},
        "listen": {"endpoints": ["tcp/localhost:0"]},
        "scouting": {"multicast": {"enabled": False}, "gossip": gossip},
    }
    heard: dict[str, set[str]] = {"one": set(), "two": set()}
    kept: list[zenoh.LivelinessToken] = []

    def peer(name: str) -> zenoh.Session:
        session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
        session.declare_subscriber("0/**", lambda sample: heard[name].add(str(sample.key_expr).split("/")[1]))
        kept.append(session.liveliness().declare_token(Identity(0, str(session.info.zid()), 0, "", name).token))
        return session

    with peer("one") as one, peer("two"):
        node = RosNode(session, 0, "vrg")
        deadline = time.monotonic() + 60.0
        while not all(found >= {"match", "one"} for found in heard.values()) and time.monotonic() < deadline:
            node.offer("/match", "std_msgs/String", lambda: [{"data": "x"}])
            one.put("0/one/x", b"x")
            time.sleep(0.05)
        names = {key.rpartition("/")[2] for key in session.alive("@ros2_lv/0/*/*/*/NN/**")}
    assert all(found >= {"match", "one"} for found in heard.values()), heard
    assert names == {"vrg", "one", "two"}


def test_a_topic_without_subscribers_is_not_made(endpoint: str, session: Session) -> None:
    made: list[int] = []

    def make() -> list[dict[str, str]]:
        made.append(1)
        return [{"data": "x"}]

    node = RosNode(session, 0, "vrg")
    node.advertise("/say", "std_msgs/String")
    for _ in range(20):
        node.offer("/say", "std_msgs/String", make)
        time.sleep(0.01)
    assert made == []
    deadline = time.monotonic() + 60.0
    with open_session(endpoint) as other:
        take = other.collect_raw("0/say/**", 10)
        while not (found := take()) and time.monotonic() < deadline:
            node.offer("/say", "std_msgs/String", make)
            time.sleep(0.01)
    assert found
    while node.wanted("/say", "std_msgs/String") and time.monotonic() < deadline:
        time.sleep(0.01)
    made.clear()
    node.offer("/say", "std_msgs/String", make)
    assert made == [], "the subscriber has gone"


def test_what_lasts_is_there_for_those_who_come_later(endpoint: str, session: Session) -> None:
    """As rmw_zenoh subscribes to topics that are transient local: with history."""
    heard: list[zenoh.Sample] = []
    RosNode(session, 0, "vrg").publish("/map", "std_msgs/String", {"data": "once"}, lasting=True)
    with zenoh.open(configuration(client_settings(endpoint))) as late:
        history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
        subscriber = zenoh.ext.declare_advanced_subscriber(late, "0/map/**", heard.append, history=history)
        deadline = time.monotonic() + 60.0
        while not heard and time.monotonic() < deadline:
            time.sleep(0.01)
        subscriber.undeclare()
    assert decode("std_msgs/String", heard[0].payload.to_bytes()) == {"data": "once"}
    assert heard[0].attachment is not None
    assert len(heard[0].attachment.to_bytes()) == 33


def test_a_message_of_another_type_is_refused(session: Session) -> None:
    node = RosNode(session, 0, "vrg", wall=time.time_ns)
    with pytest.raises(ValueError, match="has no field word"):
        node.publish("/say", "std_msgs/String", {"word": "x"})


@pytest.mark.parametrize(
    ("waiting", "named"),
    [
        ([QUEUE_LENGTH], 1),
        ([QUEUE_LENGTH - 1], 0),
        ([QUEUE_LENGTH] * FLOODED + [QUEUE_LENGTH - 1], 1),
        ([QUEUE_LENGTH] * FLOODED + [QUEUE_LENGTH - 1] * FLOODED, 4),
    ],
    ids=["a flood", "fast commands", "commands at the limit", "floods again and again"],
)
def test_of_a_flood_of_commands_the_newest_counts_and_it_is_named_once(
    waiting: list[int], named: int, caplog: pytest.LogCaptureFixture
) -> None:
    class Flooded:
        """A session on which so many commands wait at each look in turn."""

        def __init__(self) -> None:
            self.v = 0.0
            self.waiting = itertools.cycle(waiting)

        def declare_alive(self, key: object) -> None:
            """Nobody looks."""

        def collect_raw(self, expression: str, limit: int) -> Callable[[], list[tuple[str, bytes]]]:
            return list if "TwistStamped" in expression else self.take

        def take(self) -> list[tuple[str, bytes]]:
            of, found = "geometry_msgs/Twist", []
            for _ in range(next(self.waiting)):
                self.v += 0.001
                found.append((data_key(0, "/cmd_vel", of), encode(of, messages.twist(Twist(self.v, 0.0)))))
            return found

    session = Flooded()
    newest = RosNode(session, 0, "vrg").commands("/cmd_vel")  # type: ignore[arg-type]
    for _ in range(8 * FLOODED):
        command = newest()
        assert command is not None
        assert command["linear"]["x"] == pytest.approx(session.v)
    assert [record.message for record in caplog.records] == [
        "/cmd_vel: geometry_msgs/Twist comes much faster than it can count: only the newest of a tick does"
    ] * named
