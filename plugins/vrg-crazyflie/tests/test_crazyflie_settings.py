"""Mistakes in [backends.crazyflie], and what it says of robots that are well written."""

from pathlib import Path
from typing import Any

import pytest

from vrg.config.loading import load_match
from vrg.errors import ConfigError
from vrg.hal.driver import DriverContext
from vrg.hal.models import robot_model
from vrg_crazyflie.driver import CrazyflieDriver
from vrg_crazyflie.settings import CrazyflieSettings

CRAZYFLIE, P2AT = robot_model("Crazyflie"), robot_model("P2AT")
ANN, BOB = "radio://0/80/2M/E7E7E7E701", "radio://0/80/2M/E7E7E7E702"


def problems(model: Any = CRAZYFLIE, emulate: bool = False, **uris: str) -> list[str]:
    table = {"emulate": emulate, "robots": {name: {"uri": uri} if uri else {} for name, uri in uris.items()}}
    return CrazyflieSettings.model_validate(table).problems({"ann": model, "bob": model}, Path())


def test_a_ceiling_is_above_the_height() -> None:
    table = {
        "emulate": True,
        "robots": {"ann": {"height": 1.0, "ceiling": 0.8}, "bob": {"height": 1.0, "ceiling": 1.1}},
    }
    [problem] = CrazyflieSettings.model_validate(table).problems({"ann": CRAZYFLIE, "bob": CRAZYFLIE}, Path())
    assert problem == "robots.ann: expected a ceiling above its height, 1 m, got 0.8: raise it, or leave it out"


def test_an_unknown_field_of_a_robot_is_guessed_at(tmp_path: Path) -> None:
    match = tmp_path / "m.toml"
    text = (Path(__file__).parents[1] / "examples" / "emulated.toml").read_text()
    assert "height = " in text
    match.write_text(text.replace("height = ", "hieght = ", 1))
    with pytest.raises(ConfigError, match="hieght: unknown field, did you mean 'height'"):
        load_match(match)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"robots": {"ann": {"uri": "radio://0/126/2M"}}}, "a channel of 0 to 125"),
        ({"robots": {"ann": {"uri": "radio:/0/80/2M"}}}, "expected usb://0, udp"),
        ({"robots": {"ann": {"uri": "radio://0/80/3M/E7E7E7E7E7"}}}, "a rate of 250K, 1M or 2M"),
        ({"robots": {"ann": {"uri": ANN, "height": 0.05}}}, "at least 0.2"),
        ({"robots": {"ann": {"uri": ANN, "height": 5.0}}}, "at most 2"),
        ({"robots": {"ann": {"uri": ANN, "battery_low": 2.0}}}, "at least 3"),
        ({"robots": {"ann": {"uri": ANN, "pose": "gps"}}}, "odometry"),
        ({"robots": {"ann": {"url": ANN}}}, "url"),
        ({"emulate": "perhaps"}, "true or false"),
    ],
)
def test_a_mistake_is_named_in_words(table: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=r"backends\.crazyflie") as caught:
        CrazyflieSettings.read("crazyflie", table)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "uri",
    [
        ANN,
        "radio://0/125/250K",
        "radio://E7E7E7E701/0/1M/01?safelink=1",
        "usb://0",
        "udp://127.0.0.1:19850",
        "vrg://a-b",
    ],
)
def test_addresses_of_cflib_are_taken(uri: str) -> None:
    assert CrazyflieSettings.read("crazyflie", {"robots": {"ann": {"uri": uri}}}).robot("ann").uri == uri


def test_two_robots_need_two_addresses_and_two_radios() -> None:
    """The dongle and options make no other Crazyflie; and one process cannot use the dongle of another."""
    bob = BOB.replace("//0/", "//1/")
    assert problems(ann=ANN, bob=bob) == []
    assert [line.split(": ")[1:] for line in problems(ann=ANN, bob=BOB)] == [
        [
            "it is a process of its own, and cannot share ann's Crazyradio",
            "plug in another one, and write radio://1/ or its serial number",
        ]
    ]
    other_dongle, short = "radio://1/80/2M/e7e7e7e701?safelink=0", "radio://1/80/2M"
    for first, second in ((ANN, other_dongle), ("radio://0/80/2M/E7E7E7E7E7", short), ("usb://0", "usb://0")):
        assert f"{second} is the address of ann, too" in problems(ann=first, bob=second)[0]
    assert len(problems(ann=ANN, bob=ANN)) == 2
    assert problems(ann=ANN, bob=other_dongle.replace("80", "81")) == []
    assert problems(ann="usb://0", bob="usb://1") == []


def test_a_robot_needs_a_table_with_its_address_unless_it_is_emulated() -> None:
    places = [line.split(" ")[1] for line in problems(ann="")]
    assert places == ["[backends.crazyflie.robots.ann]", "[backends.crazyflie.robots.bob]"]
    assert problems(emulate=True) == []
    context = DriverContext(name="ann", model=CRAZYFLIE)
    with pytest.raises(ConfigError, match=r"expected \[backends\.crazyflie\.robots\.ann\] with a uri"):
        CrazyflieDriver(context)
    emulated = CrazyflieSettings.read(
        "crazyflie", {"emulate": True, "robots": {"ann": {"uri": ANN, "height": 0.7}}}
    ).robot("ann")
    assert (emulated.uri, emulated.height) == ("vrg://ann", 0.7)


def test_a_model_must_move_in_any_direction() -> None:
    assert problems(P2AT, emulate=True) == [
        f'{name}: expected a model that moves in any direction, such as model = "Crazyflie", got P2AT'
        for name in ("ann", "bob")
    ]


def test_what_nobody_has_tried_is_said_of_real_ones_only() -> None:
    real, emulated = (
        CrazyflieSettings.read("crazyflie", {"emulate": e, "robots": {"ann": {"uri": ANN}}}) for e in (False, True)
    )
    assert "cuts its motors after 2 s" in real.unverified(["ann"])[0]
    assert emulated.unverified(["ann"]) == emulated.missing_here(["ann"]) == []


def test_a_radio_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = CrazyflieSettings.read("crazyflie", {"robots": {"ann": {"uri": ANN}, "bob": {"uri": "usb://0"}}})
    serials = "cflib.drivers.crazyradio.get_serials"
    monkeypatch.setattr(serials, lambda: [])
    assert "ann: no Crazyradio is plugged in" in settings.missing_here(["ann", "bob"])[0]
    monkeypatch.setattr(serials, lambda: ["E7"])
    assert settings.missing_here(["ann"]) == []
    monkeypatch.setattr(serials, lambda: 1 / 0)
    assert "USB cannot be used" in settings.missing_here(["ann"])[0]
    assert settings.missing_here(["bob"]) == []


def test_the_model_is_a_robot_of_the_plane_that_moves_in_any_direction() -> None:
    assert CRAZYFLIE.drivetrain.holonomic
    assert CRAZYFLIE.scanner is None
