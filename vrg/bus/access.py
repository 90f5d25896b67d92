"""The keys that each seat may publish and receive, made from the key map: the router's access control.

Zenoh's router compares the common name of a process's certificate and the key of a message with rules. What no rule
allows is denied. These are functions of plain data, for a router of VRG's own and for a stock `zenohd`.

Three things of zenoh 1.10 shape the rules. A declared publisher sends nothing until the router has informed it of a
subscriber, so every seat may learn that a node listens. Advanced publishers and subscribers exchange history,
heartbeats and presence on keys below `@adv`, which `**` does not match. And a rule allows a message only if its key
expression contains the message's whole expression, so who listens with a wildcard needs the wildcard in its rules.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import Any

from vrg.bus.topics import ALIVE, READINGS, ROUTERS_ALIVE, Keys, Qos, TopicLine
from vrg.names import chunk_of
from vrg.seats.parties import EVERYBODY, Party
from vrg.seats.seat import Roster, Seat, SeatKind

NODE_OF_SEAT: dict[SeatKind, tuple[str, str]] = {
    SeatKind.WORLD: ("world", "world"),
    SeatKind.REFEREE: ("coordinator", "referee"),
    SeatKind.RECORDER: ("recorder", "recorder"),
    SeatKind.LAUNCHER: ("launcher", "*"),
    SeatKind.OFFICIAL: ("spectator", "*"),
    SeatKind.WINDOW: ("spectator", "*"),
    SeatKind.TRACKER: ("tracker", "*"),
}
"""The kind and the name of the node that a seat runs. A seat with a name runs a node of its own kind and name."""
DECIDING = "official"
"""The kind of sender of a command such as `vrg official`, which runs no node."""
_BROAD = (SeatKind.OFFICIAL, SeatKind.WINDOW)
"""The seats that may ask for everything at once, as `vrg topic list` does. They are given what they may hear."""


def speaks(seat: Seat, line: TopicLine[Any], roster: Roster) -> list[str]:
    """The key expressions below `vrg/<match>/` on which a seat may publish messages of a line; none if it may not."""
    kind, name = _node_of(seat)
    own = replace(line, path=line.path.replace("{kind}/{name}", f"{kind}/{name}"))
    return _expressions(seat, own, line.speakers, roster)


def hears(seat: Seat, line: TopicLine[Any], roster: Roster) -> list[str]:
    """The key expressions below `vrg/<match>/` of a line whose messages a seat is given; none if it may not hear any.

    An official is given all.
    """
    if seat.kind is SeatKind.OFFICIAL:
        return [Keys.expression(line.path)]
    return _expressions(seat, line, line.listeners, roster)


@lru_cache(maxsize=4096)
def may_publish(sender: str, key: str) -> bool:
    """True if a sender, as a message names it, may be one of the speakers of a key.

    The router decides by the seat, which cannot be forged. This finds messages that the bus has mixed up. It does not
    know the teams, nor which robots a tracker locates.

    Args:
        sender: such as `player/ann/3f60c1d2`. key: such as `vrg/courtyard/robot/ann/drive`.
    """
    kind, name, *_ = *sender.split("/"), ""
    for line in lines():
        pattern = re.sub(r"\\{(\w+)\\}", r"(?P<\1>[^/]+)", re.escape(line.path))
        found = re.fullmatch(rf"vrg/[^/]+/{pattern}", key)
        if found is not None:
            holes = found.groupdict()
            if "kind" in holes and (holes["kind"], holes["name"]) != (kind, name):
                return False
            return any(kind in _senders(party) and _own(party, name, holes) for party in line.speakers)
    return False


def _senders(party: Party) -> tuple[str, ...]:
    """The kinds of senders that speak from a seat."""
    node = NODE_OF_SEAT.get(party.kind, (party.kind.value, ""))[0]
    return (node, DECIDING) if party.kind in _BROAD else (node,)


def _own(party: Party, name: str, holes: dict[str, str]) -> bool:
    """True if the names in a key are the sender's own, where they must be."""
    own: tuple[str, ...] = ()
    if party.kind in (SeatKind.PLAYER, SeatKind.HUD):
        own = ("robot", "player")
    elif party.kind is SeatKind.COMMANDER and "player" not in holes:
        own = ("team",)
    return all(holes.get(hole, name) == name for hole in own)


def in_words(line: TopicLine[Any], parties: Sequence[Party]) -> str:
    """The speakers or the listeners of a line, in words."""
    kinds = {party.kind for party in parties}
    if kinds >= {party.kind for party in EVERYBODY} - {SeatKind.HOST}:
        return "all"
    return ", ".join(_party_in_words(line, party) for party in parties)


def _party_in_words(line: TopicLine[Any], party: Party) -> str:
    if (party.kind is SeatKind.PLAYER and "{team}" in line.path and "{player}" not in line.path) or party.others:
        return "players of the team"
    if party.kind is SeatKind.COMMANDER:
        return "the team's commander"
    words = party.node or str(party.kind)
    return words if party.fed is None else f"{words} ({'feed' if party.fed else 'odometry'})"


def _node_of(seat: Seat) -> tuple[str, str]:
    """The kind and the name of the nodes that a seat runs, as they stand in keys."""
    return NODE_OF_SEAT.get(seat.kind, (seat.kind.value, chunk_of(seat.name)))


def lines() -> list[TopicLine[Any]]:
    """All lines of the key map, that of the sensors' readings too."""
    return [*Keys.lines(), READINGS]


def _expressions(seat: Seat, line: TopicLine[Any], parties: Iterable[Party], roster: Roster) -> list[str]:
    found: dict[str, None] = {}
    holes = set(re.findall(r"\{(\w+)\}", line.path))
    for party in parties:
        if party.kind is seat.kind:
            own = {hole: names for hole, names in _own_names(seat, party, roster).items() if hole in holes}
            if party.fed is not None:
                robots = own.get("robot", roster.teams)
                own["robot"] = [robot for robot in robots if (robot in roster.fed) is party.fed]
            found |= dict.fromkeys(
                Keys.expression(line.path, dict(zip(own, names, strict=True))) for names in product(*own.values())
            )
    return list(found)


def _own_names(seat: Seat, party: Party, roster: Roster) -> dict[str, Sequence[str]]:
    """The names that the holes of a line's path must hold, by hole. A hole that is missing may hold anything."""
    if seat.kind in (SeatKind.PLAYER, SeatKind.HUD):
        team: dict[str, Sequence[str]] = {"team": [roster.teams[seat.name]]}
        return team if party.others else {**team, "robot": [seat.name], "player": [seat.name]}
    if seat.kind is SeatKind.COMMANDER:
        members = roster.members(seat.name)
        return {"team": [seat.name], "robot": members, "player": members}
    return {}


def rules(roster: Roster) -> dict[str, Any]:
    """The `access_control` part of the configuration of a zenoh router: one subject and its rules for each seat."""
    made: list[dict[str, Any]] = []
    subjects: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    for seat in roster.seats:
        if seat.kind is SeatKind.ROUTER and not roster.linked:
            continue
        name = seat.common_name
        own = [_rule_of_routers(seat)] if seat.kind is SeatKind.ROUTER else _rules_of(seat, roster)
        made += own
        subjects.append({"id": name, "cert_common_names": [name]})
        policies.append({"subjects": [name], "rules": [rule["id"] for rule in own]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": made,
        "subjects": subjects,
        "policies": policies,
    }


def _rule_of_routers(seat: Seat) -> dict[str, Any]:
    """The rule for messages between routers: everything may pass, as each router has checked its own clients
    already."""
    return {
        "id": f"{seat.common_name}:pass-on",
        "permission": "allow",
        "flows": ["ingress", "egress"],
        "messages": [
            "put", "reply", "query", "declare_subscriber", "declare_queryable", "liveliness_token",
            "liveliness_query", "declare_liveliness_subscriber",
        ],
        "key_exprs": ["**", "**/@adv/**"],
    }  # fmt: skip


def _rules_of(seat: Seat, roster: Roster) -> list[dict[str, Any]]:
    root = Keys(roster.match).root
    said, answered, said_lasting, heard, heard_lasting, asked, asked_of = [], [], [], [], [], [], []
    for line in lines():
        spoken, listened = speaks(seat, line, roster), hears(seat, line, roster)
        said += spoken
        heard += listened
        if listened and seat.kind is SeatKind.COMMANDER:
            asked.append(Keys.expression(line.path))
        if line.qos is not Qos.LATEST:
            answered += spoken
            said_lasting += [f"{key}/@adv/**" for key in spoken]
            # A listener asks all speakers of the line at once.
            asked_of += [f"{Keys.expression(line.path)}/@adv/**"] if spoken else []
            heard_lasting += [f"{key}/@adv/**" for key in listened]
    everything = ["**", "**/@adv/**"]
    asked += everything if seat.kind in _BROAD else [*heard, *heard_lasting]
    asked_before = everything[1:] if seat.kind in _BROAD else heard_lasting
    kind, name = _node_of(seat)
    alive = [ALIVE.format(kind=kind, name=name, instance="*")]
    all_alive = [Keys.expression(ALIVE)]

    wanted = [
        ("speak", ["ingress"], ["put"], [*said, *said_lasting]),
        ("answer", ["ingress"], ["reply", "declare_queryable"], [*answered, *said_lasting]),
        ("be-asked", ["egress"], ["query"], [*said_lasting, *asked_of]),
        ("be", ["ingress"], ["liveliness_token"], [*alive, *said_lasting]),
        ("hear", ["egress"], ["put", "reply"], [*heard, *heard_lasting]),
        ("listen", ["ingress"], ["declare_subscriber"], asked),
        ("ask", ["ingress"], ["query"], asked_before),
        ("look", ["ingress"], ["liveliness_query", "declare_liveliness_subscriber"], [*all_alive, *asked_before]),
        ("see", ["egress"], ["liveliness_token"], [*all_alive, *heard_lasting]),
        ("learn", ["egress"], ["declare_subscriber", "declare_queryable"], everything),
    ]
    found = [
        {
            "id": f"{seat.common_name}:{what}",
            "permission": "allow",
            "flows": flows,
            "messages": messages,
            "key_exprs": [f"{root}/{key}" for key in dict.fromkeys(keys)],
        }
        for what, flows, messages, keys in wanted
        if keys
    ]
    if seat.kind in (SeatKind.LAUNCHER, SeatKind.HOST):
        # A supervisor makes sure that the router that answers is the one that it has started.
        found.append(
            {
                "id": f"{seat.common_name}:router",
                "permission": "allow",
                "flows": ["ingress", "egress"],
                "messages": ["liveliness_token", "liveliness_query"],
                "key_exprs": [ROUTERS_ALIVE],
            }
        )
    return found
