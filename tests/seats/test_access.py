"""The rules of the router: for each line of the key map, what each kind of seat may do."""

import itertools
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.naming import names
from vrg.bus.access import NODE_OF_SEAT, hears, in_words, lines, may_publish, rules, speaks
from vrg.bus.topics import Keys, Qos, TopicLine, key_matches, router_alive
from vrg.names import chunk_of
from vrg.seats.seat import NAMED, Roster, Seat, SeatKind

ROSTER = Roster("final", {"ann": "red", "bob": "red", "cid": "blue", "Łukasz": "blue"}, fed=("bob",), hosts=("pi",))
ROOT = "vrg/final"
W, R, REC, L, H = "world", "referee", "recorder", "launcher", "host.pi"
OFF, WIN, T = "official", "window", "tracker"
ANN, BOB, CID = "player.ann", "player.bob", "player.cid"
LUK = "player.Łukasz"
RED, BLUE = "commander.red", "commander.blue"
DISPLAYS = {"hud.ann", "hud.bob", "hud.cid", "hud.Łukasz"}
DIS, DIB = "hud.ann", "hud.bob"
EVERYBODY = {W, R, REC, L, OFF, WIN, T, ANN, BOB, CID, LUK, RED, BLUE, *DISPLAYS}

WHO: dict[str, tuple[set[str], set[str]]] = {
    "clock": ({W}, EVERYBODY),
    "poses": ({W}, {R, REC, WIN, OFF, T}),
    "world/request": ({R}, {W, OFF}),
    "world/answer": ({W}, {R, OFF}),
    "robot/ann/drive": ({ANN}, {W, OFF}),
    "robot/ann/state": ({W}, {ANN, WIN, OFF}),
    "robot/ann/pose": ({ANN}, {W, R, ANN, REC, L, WIN, OFF, DIS}),
    "robot/bob/pose": ({T}, {W, R, BOB, REC, L, WIN, OFF, DIB}),
    "robot/ann/motion": ({ANN}, {T, REC, OFF}),
    "fix/overhead": ({T}, {T, REC, WIN, OFF}),
    "thing/ball/pose": ({T}, {W, OFF}),
    "robot/ann/seen": ({W}, {ANN, OFF}),
    "robot/ann/limit": ({R}, {ANN, W, OFF}),
    "robot/ann/recover": ({R}, {ANN, OFF}),
    "robot/ann/placed": ({R}, {ANN, OFF, T}),
    "robot/ann/camera/request": ({OFF, WIN, DIS}, {W, OFF}),
    "robot/ann/sensor/laser/front": ({W}, {ANN, REC, WIN, OFF, DIS}),
    "player/ann/report": ({ANN}, {R, REC, L, WIN, OFF, RED, DIS}),
    "player/ann/manual": ({OFF, RED, DIS}, {ANN, OFF}),
    "player/ann/links": ({ANN}, {REC, OFF}),
    "player/ann/sightings": ({ANN}, {R, REC, WIN, OFF}),
    "player/ann/bid": ({ANN}, {R, OFF}),
    "player/ann/sketch": ({ANN}, {REC, WIN, OFF, RED, DIS}),
    "team/red/order": ({RED}, {ANN, BOB, OFF}),
    "team/red/sight": ({R}, {ANN, BOB, RED, OFF, DIS, DIB}),
    "team/red/say/ann": ({ANN}, {ANN, BOB, OFF}),
    "referee/state": ({R}, EVERYBODY),
    "referee/event": ({R}, EVERYBODY),
    "official": ({OFF, L}, {R, OFF}),
    "estop": (EVERYBODY | {H}, EVERYBODY),
    "estop/release": ({OFF}, EVERYBODY),
    "seat/request": ({OFF}, {L, OFF}),
    "seat/answer": ({L}, {OFF}),
    "processes": ({L}, {WIN, OFF}),
    "pulse/player/ann": ({ANN}, {L, H, OFF}),
    "pulse/coordinator/referee": ({R}, {L, H, OFF}),
    "pulse/launcher/launcher": ({L}, {L, H, OFF}),
    "pulse/commander/red": ({RED}, {L, H, OFF}),
    "pulse/hud/ann": ({DIS}, {L, H, OFF}),
    "pulse/spectator/window-17": ({OFF, WIN}, {L, H, OFF}),
}
"""Who may publish on a key, and who may hear it: written by hand, and compared with what the key map gives."""

SEATS = {str(seat): seat for seat in ROSTER.seats if seat.kind is not SeatKind.ROUTER}
ACCESS = rules(ROSTER)


def includes(allowed: str, wanted: str) -> bool:
    """Whether a key expression contains another, as in zenoh: `*` and `**` stand for no chunk that begins with @."""

    def match(a: list[str], b: list[str]) -> bool:
        if not a:
            return not b
        if a[0] == "**":
            return match(a[1:], b) or (bool(b) and not b[0].startswith("@") and match(a, b[1:]))
        if not b or b[0] == "**":
            return False
        fits = a[0] == b[0] or (a[0] == "*" and not b[0].startswith("@"))
        return fits and match(a[1:], b[1:])

    return match(allowed.split("/"), wanted.split("/"))


def allowed(seat: str, flow: str, message: str, key: str) -> bool:
    """What a zenoh router would decide."""
    name = SEATS[seat].common_name
    subjects = {s["id"] for s in ACCESS["subjects"] if name in s["cert_common_names"]}
    ids = {rule for p in ACCESS["policies"] if subjects & set(p["subjects"]) for rule in p["rules"]}
    return any(
        rule["id"] in ids
        and flow in rule["flows"]
        and message in rule["messages"]
        and any(includes(expression, key) for expression in rule["key_exprs"])
        for rule in ACCESS["rules"]
    )


def line_of(key: str) -> TopicLine[Any]:
    assert "*" not in key
    (found,) = [line for line in lines() if key_matches(Keys.expression(line.path), key)]
    return found


def check(expected: Iterable[tuple[str, str, str, str, bool]]) -> None:
    """That a router decides as expected: by seat, flow, message and key, whether it lets the message pass."""
    wrong = [f"{' '.join(asked)}: expected {may}" for *asked, may in expected if allowed(*asked) is not may]
    assert not wrong, "\n".join(wrong)


CASES = [(key, seat) for key in WHO for seat in SEATS]


def test_a_seat_publishes_and_is_given_what_it_may_and_nothing_else() -> None:
    assert {line_of(key).path for key in WHO} == {line.path for line in lines()}
    check((seat, "ingress", "put", f"{ROOT}/{key}", seat in WHO[key][0]) for key, seat in CASES)
    check((seat, "egress", "put", f"{ROOT}/{key}", seat in WHO[key][1]) for key, seat in CASES)
    check((seat, "egress", "liveliness_token", router_alive(7), seat in (L, H)) for seat in SEATS)


def test_a_speaker_learns_who_listens_or_it_would_send_nothing() -> None:
    asked = itertools.product(SEATS, ("robot/*/drive", "**", "player/*/bid", "estop/@adv/**"))
    check((seat, "egress", "declare_subscriber", f"{ROOT}/{expression}", True) for seat, expression in asked)


def test_a_seat_that_may_hear_may_listen_and_learns_of_the_past() -> None:
    expected = []
    for key, seat in CASES:
        may = seat in WHO[key][1]
        now, past = f"{ROOT}/{key}", f"{ROOT}/{key}/@adv/pub/1f/2/_"
        if may or seat not in (WIN, RED, BLUE):  # these may ask for more than they are given
            expected.append((seat, "ingress", "declare_subscriber", now, may))
        if line_of(key).qos is not Qos.LATEST:
            # What was said, heartbeats, and who publishes.
            given = (("reply", now), ("put", past), ("liveliness_token", past))
            expected += [(seat, "egress", what, where, may) for what, where in given]
            if may:
                asked = ("query", "declare_liveliness_subscriber")
                expected += [(seat, "ingress", what, past, True) for what in asked]
    check(expected)


def test_only_a_speaker_answers_for_its_past() -> None:
    expected = []
    for key, seat in CASES:
        line = line_of(key)
        kept = line.qos is not Qos.LATEST
        may = kept and seat in WHO[key][0]
        past = f"{ROOT}/{key}/@adv/pub/1f/2/_"
        expected += [(seat, "ingress", said, past, may) for said in ("declare_queryable", "liveliness_token", "put")]
        expected.append((seat, "ingress", "reply", f"{ROOT}/{key}", may))
        # Who speaks on a line is asked by a query for all of its keys.
        asked = kept and bool(speaks(SEATS[seat], line, ROSTER))
        queries = (past, f"{ROOT}/{Keys.expression(line.path)}/@adv/**")
        expected += [(seat, "egress", "query", query, asked) for query in queries]
    check(expected)


def test_a_seat_is_present_only_as_what_it_is() -> None:
    own = {
        W: "world/world", R: "coordinator/referee", REC: "recorder/recorder", L: "launcher/me", H: "host/pi",
        OFF: "spectator/window-3", WIN: "spectator/window-3", T: "tracker/x", ANN: "player/ann", BOB: "player/bob",
        CID: "player/cid", LUK: f"player/{chunk_of('Łukasz')}", RED: "commander/red",
        BLUE: "commander/blue",
        **{f"hud.{name}": f"hud/{chunk_of(name)}" for name in ("ann", "bob", "cid", "Łukasz")},
    }  # fmt: skip
    expected = []
    for seat, node in itertools.product(SEATS, sorted(set(own.values()))):
        expected.append((seat, "ingress", "liveliness_token", f"{ROOT}/alive/{node}/1f", node == own[seat]))
        expected.append((seat, "ingress", "liveliness_query", f"{ROOT}/alive/{node}/*", True))  # for its double
    check(expected)


def test_nobody_speaks_outside_of_the_match() -> None:
    keys = ("clock", "vrg/other/clock", "vrg/other/estop", "@/router/config", "vrg/finals/estop", "estop")
    messages = ("put", "query", "declare_subscriber", "reply")
    check((*asked, False) for asked in itertools.product(SEATS, ("ingress", "egress"), messages, keys))


def test_only_linked_routers_pass_messages_on_to_each_other() -> None:
    def may(roster: Roster) -> list[dict[str, Any]]:
        return [rule for rule in rules(roster)["rules"] if rule["id"].startswith(SeatKind.ROUTER)]

    assert may(ROSTER) == []
    (rule,) = may(replace(ROSTER, linked=True))
    assert rule["flows"] == ["ingress", "egress"]
    assert {"put", "reply", "declare_subscriber", "liveliness_token"} <= set(rule["messages"])
    assert len(rules(replace(ROSTER, linked=True))["rules"]) == len(ACCESS["rules"]) + 1, "others may what they might"


def test_what_no_rule_allows_is_denied_nobody_deletes_and_the_router_is_no_subject_of_its_own_rules() -> None:
    assert (ACCESS["enabled"], ACCESS["default_permission"]) == (True, "deny")
    assert {rule["permission"] for rule in ACCESS["rules"]} == {"allow"}
    assert not any("delete" in rule["messages"] for rule in ACCESS["rules"])
    assert "router" not in {s["id"] for s in ACCESS["subjects"]}
    ids = [rule["id"] for rule in ACCESS["rules"]]
    assert len(ids) == len(set(ids))
    assert {name for p in ACCESS["policies"] for name in p["rules"]} == set(ids)


NAMES = names(12)


@given(st.dictionaries(NAMES, st.sampled_from(["red", "blue"]), min_size=1, max_size=5))
def test_whatever_the_players_are_called_nobody_drives_anothers_robot(teams: dict[str, str]) -> None:
    roster = Roster("m", teams)
    for seat in roster.seats:
        spoken = speaks(seat, Keys.drive, roster)
        assert spoken == ([f"robot/{chunk_of(seat.name)}/drive"] if seat.kind is SeatKind.PLAYER else [])
        for name, team in teams.items():
            heard = hears(seat, Keys.say, roster)
            mates = seat.kind is SeatKind.PLAYER and teams[seat.name] == team
            key = f"team/{chunk_of(team)}/say/{chunk_of(name)}"
            assert any(includes(e, key) for e in heard) is (mates or seat.kind is SeatKind.OFFICIAL)


def test_parties_are_told_in_words() -> None:
    words = {line.path: (in_words(line, line.speakers), in_words(line, line.listeners)) for line in lines()}
    assert words["clock"] == ("world", "all")
    assert words["estop"] == ("all", "all")
    assert words["robot/{robot}/drive"] == ("player's device", "world")
    assert words["robot/{robot}/pose"][0] == "player's device (odometry), tracker (feed)"
    assert words["team/{team}/say/{player}"] == ("player", "players of the team")
    assert words["team/{team}/order"] == ("the team's commander", "players of the team")


def test_a_match_has_a_seat_for_everybody() -> None:
    found = {str(seat) for seat in Roster("m", {"a": "x", "b": "x", "c": "y"}, hosts=("pi",)).seats}
    plain = {str(kind) for kind in SeatKind if kind not in NAMED} - {"tracker"}
    each = {f"{kind}.{player}" for kind in ("player", "hud") for player in "abc"}
    assert found == plain | each | {"commander.x", "commander.y", "host.pi"}
    assert "tracker" in SEATS


def test_a_seat_has_a_name_only_if_its_kind_has_several() -> None:
    with pytest.raises(ValueError, match="expected a name"):
        Seat(SeatKind.PLAYER)
    with pytest.raises(ValueError, match="expected no name"):
        Seat(SeatKind.WORLD, "x")


@given(NAMES, NAMES)
def test_two_seats_never_share_a_common_name(one: str, other: str) -> None:
    first, second = Seat(SeatKind.PLAYER, one), Seat(SeatKind.PLAYER, other)
    assert (first.common_name == second.common_name) is (one == other)
    assert first.common_name != Seat(SeatKind.COMMANDER, one).common_name


@pytest.mark.parametrize("name", ["a" * 64, "ł" * 64, "a" * 57, "a" * 58])
def test_a_common_name_fits_into_a_certificate(name: str) -> None:
    seat = Seat(SeatKind.PLAYER, name)
    assert len(seat.common_name) <= 64
    assert seat.common_name.isascii()
    assert seat.common_name != Seat(SeatKind.PLAYER, f"{name[:-1]}b").common_name


def sender(seat: Seat) -> str:
    """What stands in the messages of a node of this seat."""
    kind, name = NODE_OF_SEAT.get(seat.kind, (seat.kind.value, chunk_of(seat.name)))
    return f"{kind}/{name.replace('*', WINDOW if kind == 'spectator' else kind)}/1"


WINDOW = "window-17"
# What depends on the roster, which is not known where a message is taken in.
UNKNOWN = {("robot/ann/pose", T), ("robot/bob/pose", BOB), *itertools.product(["player/ann/manual"], [RED, BLUE])}


def test_a_sender_is_believed_on_the_keys_of_its_seat_only() -> None:
    seats = [seat for seat in ROSTER.seats if seat.kind is not SeatKind.ROUTER]
    wrong = []
    for path, (speakers, _) in WHO.items():
        # A window and an official run nodes of one kind.
        believed = {sender(seat) for seat in seats if str(seat) in speakers or (path, str(seat)) in UNKNOWN}
        for who in map(sender, seats):
            if may_publish(who, f"{ROOT}/{path}") != (who in believed):
                wrong.append(f"{who} on {path}: expected {who in believed}")
    assert not wrong, "\n".join(wrong)


def test_a_sender_that_is_none_is_not_believed() -> None:
    expected = {
        ("official/ann/1", "official"): True,
        ("official/ann/1", "estop"): True,
        ("official/ann/1", "clock"): False,
        ("player/ann/1", "pulse/player/ann"): True,
        ("player/ann/1", "pulse/player/bob"): False,
        ("player/bob/1", "team/red/say/ann"): False,
        ("player", "robot/ann/drive"): False,
        ("", "robot/ann/drive"): False,
        ("player/ann/1", "no/such/key"): False,
    }
    wrong = [f"{who} on {key}" for (who, key), may in expected.items() if may_publish(who, f"{ROOT}/{key}") != may]
    assert not wrong, "\n".join(wrong)
