"""Listen to a match and drive one of its robots, with nothing of VRG: only zenoh and MessagePack.

Start a match, then this program beside it; docs/bus.md says what it speaks:

    vrg play sharks-and-minnows
    python examples/outside.py courtyard player2

It holds the lease of the player's robot, as a person with a gamepad does, and drives it in a circle. The referee's
rules, the emergency stop and the speed limit hold for it, too. The same can be written in any language that has both
libraries.
"""

import argparse
import json
import sys
import threading
import uuid

import msgpack
import zenoh

FORMAT = 2
PERIOD = 0.1
LEASE = 0.5


class Match:
    """What was last heard of a match. Zenoh calls `hear` on a thread of its own."""

    def __init__(self, name: str) -> None:
        self.root = f"vrg/{name}/"
        self.time = 0.0
        self.referee: dict | None = None
        self.places: dict[str, dict] = {}

    def hear(self, sample: zenoh.Sample) -> None:
        form, version, _sender, key, _sequence, stamp, body = msgpack.unpackb(sample.payload.to_bytes())
        if form != FORMAT or key != str(sample.key_expr):
            return  # it is of another release, or zenoh has delivered it under a wrong key
        match key.removeprefix(self.root), version:
            case "clock", 1:
                self.time = stamp
            case "referee/state", 8:
                self.referee = body
            case "poses", 9:
                self.places = {seen["name"]: seen["pose"] for seen in body["bodies"]}

    def line(self, player: str) -> str:
        """How it stands, in a line."""
        if self.referee is None:
            return f"nothing was heard on {self.root} yet: is that the match's name?"
        if player not in self.places:
            return f"expected one of the players {', '.join(self.places)}, got {player}"
        pose = self.places[player]
        score = ", ".join(f"{team} {points}" for team, points in self.referee["score"].items())
        stage = self.referee["halted"] or self.referee["stage"]
        return f"{self.time:6.1f} s  {stage}  {score}  {player} at ({pose['x']:.1f}, {pose['y']:.1f})"


def main() -> None:
    """Listen and drive for a while."""
    options = argparse.ArgumentParser(description="Listen to a match and drive one of its robots.")
    options.add_argument("match", help="its name")
    options.add_argument("player", help="whose robot is driven")
    options.add_argument("--router", default="tcp/127.0.0.1:7447")
    options.add_argument("--seconds", type=float, default=10.0)
    chosen = options.parse_args()

    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([chosen.router]))
    config.insert_json5("scouting/multicast/enabled", "false")

    match = Match(chosen.match)
    pause = threading.Event()
    try:
        session = zenoh.open(config)
    except zenoh.ZError:
        sys.exit(f"no router answers at {chosen.router}: start a match, or name its router with --router")
    with session:
        subscribers = [
            session.declare_subscriber(match.root + key, match.hear) for key in ("clock", "poses", "referee/state")
        ]
        key = f"{match.root}player/{chosen.player}/manual"
        manual = session.declare_publisher(key)
        sender = f"commander/outside/{uuid.uuid4().hex[:8]}"
        for sequence in range(round(chosen.seconds / PERIOD)):
            command = {"forward": 0.5, "turn": 0.2, "lease": LEASE}
            # A command counts from the match time at which it was given, so it has the stamp of the match's clock.
            manual.put(msgpack.packb([FORMAT, 3, sender, key, sequence, match.time, command]))
            if sequence % 10 == 0:
                print(match.line(chosen.player), flush=True)
            pause.wait(PERIOD)
        for subscriber in subscribers:
            subscriber.undeclare()
    if chosen.player not in match.places:
        sys.exit(match.line(chosen.player))


if __name__ == "__main__":
    main()
