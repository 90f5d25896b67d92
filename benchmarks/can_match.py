"""The emergency stop from end to end: a match by `vrg play` with two robots of emulated drives on vcan0.

One shark and three minnows, two of which are CAN robots; router, world, coordinator, recorder, four players and the
drives are processes of their own. This process publishes the Estop as an official's command does, and a listener notes
when the Estop frame of each drive is on the bus, by the kernel's clock.

The same goes over python-can's udp_multicast, which needs no CAN in the kernel: where vcan0 is a user-mode kernel's
with one CPU, a dozen processes wait for each other, and this tells what the machine itself takes.
"""

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

from can_peers import CHANNEL, Heard, Idler, Listener, of_command
from can_robots import ZERO
from can_trials import Row, Tell, spread
from common import quantile

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, EstopRelease, Message, Official, OfficialAction, RefereeState, Stage
from vrg.bus.session import Session, open_session
from vrg.bus.topics import Keys, Qos, Topic
from vrg.hal.can.bus import CanBus
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.odrive.codec import command_of, decode, frame_id, node_of
from vrg.hal.can.odrive.messages import Command, EncoderEstimates

AIM = 20.0
"""ms from the Estop's publication to its frames, p99."""
UDP, GROUP = "udp_multicast", "239.74.163.2"
WIRING = {"ann": (0, 1), "bob": (2, 3)}
NODES = [node for pair in WIRING.values() for node in pair]
TURNING = 5.0
"""turn/s of a motor above which its robot drives."""
PATIENCE = 60.0
"""s of real time for anything that is waited for."""
HELD = 0.2
"""s from an engagement to its release, and at least from that to the next."""
STOPS_WITHIN = 1.0
"""s in which driving motors must have come to rest."""
PLACES = {"shark": (0.0, -92.0, 90), "ann": (-28.0, 92.0, -90), "bob": (0.0, 92.0, -90), "cid": (28.0, 92.0, -90)}
"""m and degrees: so far from each other that two minutes pass before a tag."""


def _text(udp: bool) -> str:
    text = (
        'name = "benchmark-can"\ngame = "sharks-and-minnows"\nmap = "open"\nengine = "planar"\nseed = 5\n\n'
        "[rules]\nx = [-30.0, 30.0]\ny = [-95.0, 95.0]\nzone_depth = 6.0\n\n[backends.can]\n"
        + (f'interface = "{UDP}"\nchannel = "{GROUP}"\n' if udp else f'channel = "{CHANNEL}"\n')
        + "emulate = true\n\n"
    )
    for name, (left, right) in WIRING.items():
        text += f"[backends.can.robots.{name}]\nleft = [{left}]\nright = [{right}]\nratio = 50.0\n\n"
    for name, (x, y, heading) in PLACES.items():
        role, backend = "shark" if name == "shark" else "minnow", "can" if name in WIRING else "sim"
        text += f'[[players]]\nname = "{name}"\nrole = "{role}"\nbackend = "{backend}"\n'
        text += f"x = {x}\ny = {y}\nheading = {heading}\n\n"
    return text


@contextlib.contextmanager
def _played(udp: bool) -> Iterator[tuple[str, Keys]]:
    """A match as long as the context lasts: its router's endpoint and its keys."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "match.toml").write_text(_text(udp))
        command = [sys.executable, "-m", "vrg", "play", str(folder / "match.toml"), "--runs", str(folder / "runs")]
        environment = os.environ | {"XDG_STATE_HOME": str(folder / "state")}
        with (folder / "output.txt").open("wb") as output:
            launcher = subprocess.Popen(
                [*command, "--headless"],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,
            )
        try:
            entry = folder / "state" / "vrg" / f"benchmark-can-{launcher.pid}.json"

            def registered() -> bool:
                if launcher.poll() is not None:
                    raise RuntimeError(f"vrg play has ended: {(folder / 'output.txt').read_text()}")
                return entry.exists() and entry.stat().st_size > 0

            _wait_for(registered, "the match")
            said = json.loads(entry.read_text())
            yield said["router"], Keys(said["match"])
        finally:
            launcher.send_signal(signal.SIGINT)
            try:
                launcher.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                launcher.kill()
                launcher.wait()


def _wait_for(condition: Callable[[], object], what: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"waited {PATIENCE:g} s for {what}")
        time.sleep(0.02)


class _Official:
    """Speaks to the match; hears the referee."""

    def __init__(self, session: Session, keys: Keys) -> None:
        self._session, self._keys = session, keys
        self._mailbox = Mailbox()
        self._states = self._mailbox.subscribe(keys.referee_state)
        session.attach(self._mailbox)
        for topic in (keys.estop, keys.estop_release, keys.official):
            if not session.wait_for_listener(topic.key, Qos.EVENT, PATIENCE):
                raise TimeoutError(f"nobody listens to {topic.key}")

    @property
    def state(self) -> RefereeState | None:
        """The newest."""
        self._session.receive()
        self._mailbox.handover(0.0)
        latest = self._states.latest
        return latest.body if latest is not None else None

    def estop(self) -> float:
        """Engage the emergency stop; s of time.time() just before."""
        return self._say(self._keys.estop, Estop(by="benchmark"))

    def release(self) -> None:
        """Release it."""
        self._say(self._keys.estop_release, EstopRelease(by="benchmark"))

    def resume(self) -> None:
        """Once nothing hinders it; waits until play goes on."""
        _wait_for(lambda: (s := self.state) and s.halted and not s.waiting and not s.estop, "nothing to hinder")
        decision = Official(action=OfficialAction.RESUME, by="benchmark", id=uuid.uuid4().hex)
        self._say(self._keys.official, decision)
        _wait_for(self.playing, "play to go on")

    def playing(self) -> bool:
        """Play goes on."""
        state = self.state
        return state is not None and state.stage is Stage.PLAY_ROUND and state.halted is None

    def _say(self, topic: Topic[Message], body: Message) -> float:  # type: ignore[misc]
        self._mailbox.publish(topic, body)
        out = self._mailbox.collect()
        at = time.time()
        self._session.send(out)
        return at


class _UdpListener:
    """Hears what matches (identifier, mask), as `Listener` does; a thread, as that bus has no queue to speak of."""

    def __init__(self, *filters: tuple[int, int]) -> None:
        self._filters = filters
        self._heard: deque[Heard] = deque()

    def __enter__(self) -> "_UdpListener":
        self._bus = CanBus(Link(interface=UDP, channel=GROUP), self._hear)
        self._bus.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bus.stop()

    def take(self) -> list[Heard]:
        """What has come since the last call."""
        return [self._heard.popleft() for _ in range(len(self._heard))]

    def _hear(self, frame: Frame) -> None:
        if frame.extended or frame.remote or all(frame.id & mask != id_ for id_, mask in self._filters):
            return
        # The driver tells monotonic time, by the kernel's stamp.
        self._heard.append(Heard(time.time() - time.monotonic() + frame.at, frame.id, frame.data))


class _Bus:
    """What the drives of the match hear and say."""

    def __init__(self, listener: Listener | _UdpListener) -> None:
        self._listener = listener
        self.frames: list[Heard] = []

    def look(self) -> None:
        """Take in what has come."""
        self.frames += self._listener.take()

    def estops(self, since: float) -> dict[int, float]:
        """s from `since` to the first Estop frame, by node."""
        found: dict[int, float] = {}
        for frame in self.frames:
            if command_of(frame.id) == Command.ESTOP and frame.at >= since:
                found.setdefault(node_of(frame.id), frame.at - since)
        return found

    def turning(self) -> bool:
        """All motors do, by their newest estimates."""
        self.look()
        newest = {node_of(frame.id): frame for frame in self.frames[-100:]}
        return all(node in newest and abs(_velocity(newest[node])) > TURNING for node in NODES)

    def stopped(self, since: float) -> float:
        """s from `since` until the last motor stood, by its estimates every 10 ms."""
        took = 0.0
        for node in NODES:
            wanted = frame_id(node, Command.ENCODER_ESTIMATES)
            own = [frame for frame in self.frames if frame.id == wanted and frame.at >= since]
            turning = [i for i, frame in enumerate(own) if abs(_velocity(frame)) >= ZERO]
            if turning[-1] + 1 == len(own):
                raise RuntimeError(f"node {node} did not stop")
            took = max(took, own[turning[-1] + 1].at - since)
        return took


def _velocity(frame: Heard) -> float:
    if command_of(frame.id) != Command.ENCODER_ESTIMATES:
        return 0.0
    message = decode(Frame(frame.id, frame.data))
    assert isinstance(message, EncoderEstimates)
    return message.velocity


def rows(driven: int, standing: int, tell: Tell, udp: bool = False) -> tuple[list[Row], list[str]]:
    """Engage while the robots drive, and then again and again while they stand; each is released before the next."""
    first: list[float] = []
    last: list[float] = []
    halts: list[float] = []
    arrivals: list[float] = []
    tell("starting a match")
    with contextlib.ExitStack() as stack:
        idler = stack.enter_context(Idler(1.0))
        wanted = of_command(Command.ESTOP), of_command(Command.ENCODER_ESTIMATES)
        listener = stack.enter_context(_UdpListener(*wanted) if udp else Listener(*wanted))
        endpoint, keys = stack.enter_context(_played(udp))
        bus = _Bus(listener)
        official = _Official(stack.enter_context(open_session(endpoint, patience=PATIENCE)), keys)
        other = stack.enter_context(open_session(endpoint))
        other.watch_raw(keys.estop.key, lambda _key, _payload: arrivals.append(time.time()))
        _wait_for(official.playing, "play to begin")
        _wait_for(bus.turning, "the robots to drive")
        used = idler.used()
        passed: list[float] = []
        for number in range(driven + standing):
            if number < driven:
                tell(f"emergency stop of driving robots, {number + 1} of {driven}")
                _wait_for(bus.turning, "the robots to drive")
            elif (number - driven) % 10 == 0:
                tell(f"emergency stop, {number - driven + 1} of {standing}")
            time.sleep(random.uniform(0.0, 0.1))
            bus.look()
            bus.frames.clear()
            arrivals.clear()
            at = official.estop()
            time.sleep(STOPS_WITHIN if number < driven else HELD)
            _wait_for(lambda at=at: bus.look() or len(bus.estops(at)) == len(NODES), "the Estop frames")  # type: ignore[misc]
            took = bus.estops(at).values()
            first.append(min(took) * 1e3)
            last.append(max(took) * 1e3)
            passed += [(arrival - at) * 1e3 for arrival in arrivals[:1]]
            if number < driven:
                halts.append(bus.stopped(at) * 1e3)
            official.release()
            if number < driven:
                official.resume()
            else:
                time.sleep(HELD)
    source = "the Estop is published"
    aim = f"aim p99 <= {AIM:g}"
    notes = [
        f"over {UDP if udp else CHANNEL}: 11 processes, two CAN robots and two simulated ones; this one and a listener",
    ]
    if os.cpu_count() == 1:
        notes.append(
            f"the match uses {100 * used:.0f} % of the processor while all drive, as an idle process misses it"
        )
    table: list[Row] = [
        {"from": source, "to": "another client of the router", **spread(passed), aim: None},
        {"from": source, "to": "Estop frame of the first drive", **spread(first), aim: None},
        {
            "from": source,
            "to": f"Estop frames of all {len(NODES)} drives",
            **spread(last),
            aim: "met" if quantile(last, 0.99) <= AIM else "missed",
        },
        {"from": source, "to": "zero speed of all motors", **spread(halts), aim: None},
    ]
    return table, notes
