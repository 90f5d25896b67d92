"""Strategies that cheat. Each tries at every tick what would help its team if it reached the referee or the world."""

CHEATS = '''
import gc
import json
import os
import random
import signal
import socket
import time
from pathlib import Path

from msgspec import structs
from vrg.agents import STILL
from vrg.bus import messages as m
from vrg.bus.topics import Keys
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer
from vrg.types import Pose

EVERYWHERE = dict(x_min=-99.0, y_min=-99.0, x_max=99.0, y_max=99.0)
_known = {}


def every(kind):
    """All objects of a class that are in this process."""
    if kind not in _known:
        gc.unfreeze()
        _known[kind] = [thing for thing in gc.get_objects() if type(thing).__name__ == kind]
    return _known[kind]


def force(thing, **fields):
    for name, value in fields.items():
        structs.force_setattr(thing, name, value)


def patched(module, name, value):
    __import__(module)
    import sys
    setattr(sys.modules[module], name, value)


def publish(body, topic, *names):
    """Publish a message as the referee, if it is in this process, or else as this player."""
    for node in every("Coordinator") or every("Player"):
        keys = Keys(node.mailbox.inlets[0].topic.key.split("/")[1])
        found = getattr(keys, topic)
        node.mailbox.publish(found(*names) if names else found, body)


def official(view, action, subject=None, value=None):
    publish(m.Official(action=action, by="x", subject=subject, value=value), "official")


def zones(view):
    for zone in view.referee.zones:
        if zone.kind == "safe":
            force(zone.region, **EVERYWHERE)


def book_zones(view):
    for book in every("SharksAndMinnows"):
        book._setting.zones[:] = [tuple(EVERYWHERE.values())] * 2


def reach(view):
    for book in every("SharksAndMinnows"):
        book._setting.tag_distance = -9.0


def sizes(view):
    for book in every("SharksAndMinnows"):
        for name, contestant in book.contestants.items():
            force(contestant, size=(0.01, 0.01))


def points(view):
    for match in every("Match"):
        match.game = match.game.with_points("minnows", 99)


def winner(view):
    for match in every("Match"):
        match.winner = "minnows"
        match.end("minnows")


def hurry(view):
    for match in every("Match"):
        match.clock += 5.0


def no_tags(view):
    patched("vrg.games.sharks_and_minnows.judging", "first_tag", lambda *a: float("inf"))


def no_limit(view):
    for book in every("SharksAndMinnows"):
        book.pass_limit = 0.0


def roles(view):
    for match in every("Match"):
        for name in list(match.game.roles):
            if match.game.roles[name] == "shark":
                match.game = match.game.with_state([name], "inactive")


def hypnosis(view):
    for player in every("Player"):
        if player.name == "shark":
            player._strategy.act = lambda view: STILL


def brakes(view):
    for player in every("Player"):
        if player.name == "shark":
            player._device.stop()
            player._device.drive = lambda twist: player._device.stop() or STILL


def teleport(view):
    for engine in every("PlanarEngine"):
        for row in (1, 2):
            engine.poses[row, 1] = -4.0


def freeze(view):
    for engine in every("PlanarEngine"):
        engine.velocities[0] = 0.0
        engine.speeds[0] = 0.0


def engines(view):
    for engine in every("PlanarEngine"):
        engine.velocities[1:] *= 4.0


def unlimited(view):
    for device in every("Device"):
        device._limit = None if device.name != "shark" else 0.01


def bodies(view):
    for node in every("Coordinator"):
        for name in ("ann", "bob"):
            if name in node._bodies:
                force(node._bodies[name], pose=Pose(0.0, -4.0, 0.0))


def fields(view):
    for node in every("Coordinator"):
        poses = dict(node._field.poses)
        poses.update(shark=Pose(90.0, 90.0, 0.0))
        object.__setattr__(node._field, "poses", poses)


def score(view):
    official(view, m.OfficialAction.SET_SCORE, "minnows", "99")


def accuse(view):
    official(view, m.OfficialAction.DISQUALIFY, "shark")


def stops(view):
    publish(m.Estop(by="x", reason="x"), "estop")


def drives(view):
    publish(m.Drive(twist=STILL, armed=False), "drive", "shark")


def slows(view):
    publish(m.SpeedLimit(v_max=0.01), "speed_limit", "shark")


def lease(view):
    for player in view.referee.players:
        if player.name == "shark":
            force(player, may_move=False)


def lists(view):
    view.referee.players.clear()
    view.referee.zones.clear()


def shared(view):
    view.referee.score["minnows"] = 99
    view.referee.numbers["tag_distance"] = 0.0


def journal(view):
    for path in (Path(__file__).parent.parent.parent / "playing").glob("*/journal.jsonl"):
        path.write_text("")


def record(view):
    for path in Path(__file__).parents[2].glob("games.jsonl"):
        path.write_text("")


def forge(view):
    played = json.dumps({"ended": "game over", "winner": "minnows", "score": {"minnows": 9, "sharks": 0}})
    content = played.encode()
    for number in range(3, 64):
        try:
            os.write(number, len(content).to_bytes(4) + content)
        except OSError:
            pass


def luck(view):
    random.seed(0)
    time.time = lambda: 0.0


def code(view):
    import vrg.coordinator.match as module
    module.Match._play = lambda self, dt, now: module.Effects()


def memory(view):
    with open(f"/proc/{os.getppid()}/mem", "r+b") as found:
        found.seek(0x400000)
        found.write(bytes(8))


def halts(view):
    for name in filter(str.isdigit, os.listdir("/proc")):
        with open(f"/proc/{name}/cmdline", "rb") as found:
            if b"vrg strategy shark" in found.read():
                os.kill(int(name), signal.SIGSTOP)


def slow(view):
    os.setpriority(os.PRIO_PROCESS, os.getppid(), 19)


def pinned(view):
    os.sched_setaffinity(os.getppid(), {0})


def calls(view):
    with socket.create_connection(("127.0.0.1", 7447), timeout=0.1) as router:
        router.sendall(bytes(100))


def rubbish(view):
    for path in ("/dev/shm/vrg", "/tmp/vrg", "../../journal.jsonl", "../../evidence.bin"):
        try:
            Path(path).write_bytes(bytes(100))
        except OSError:
            pass


ALL = [
    zones, book_zones, reach, sizes, points, winner, hurry, no_tags, no_limit, roles, hypnosis, brakes, teleport,
    freeze, engines, unlimited, bodies, fields, score, accuse, stops, drives, slows, lease, lists, shared, journal,
    record, luck, code, memory, halts, slow, pinned, calls, rubbish,
]


class Honest(SharksAndMinnowsPlayer):
    cheats = ()

    def act(self, view):
        action = super().act(view)
        if self.name != "shark" and view.time > 1.0:
            for cheat in self.cheats:
                try:
                    cheat(view)
                except (Exception, SystemExit):
                    pass
        return action


for cheat in ALL:
    globals()[cheat.__name__.title()] = type(cheat.__name__.title(), (Honest,), {"cheats": (cheat,)})


class Everything(Honest):
    cheats = tuple(ALL)


class Forges(Honest):
    cheats = (forge,)


class Kills(Honest):
    cheats = (lambda view: os.kill(os.getppid(), signal.SIGKILL),)


class Exits(Honest):
    cheats = (lambda view: os._exit(0),)
'''
