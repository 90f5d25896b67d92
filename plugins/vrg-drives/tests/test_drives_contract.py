"""The protocols keep the contract of protocols."""

import pytest
from pydantic import ValidationError

from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.settings import CanSettings
from vrg.testing.protocol import ProtocolContract
from vrg_drives.cia402.units import Cia402Options
from vrg_drives.vesc.axis import VescOptions


class TestCia402(ProtocolContract):
    protocol = PROTOCOLS.get("cia402")
    nodes = (1, 64, 127)
    impossible_nodes = (-1, 0, 128)


class TestCia402ThatDoesNotTellItsUnits(ProtocolContract):
    protocol = PROTOCOLS.get("cia402")
    options = Cia402Options(counts=4096, velocity_unit="0.1/min")
    nodes = (1, 64, 127)
    impossible_nodes = (-1, 0, 128)


class TestMoteus(ProtocolContract):
    protocol = PROTOCOLS.get("moteus")
    nodes = (1, 7, 8, 126)
    impossible_nodes = (-1, 0, 127)


class TestVesc(ProtocolContract):
    protocol = PROTOCOLS.get("vesc")
    options = VescOptions(pole_pairs=7)
    nodes = (0, 42, 223)
    impossible_nodes = (-1, 224, 254, 255)


@pytest.mark.parametrize("name", ["cia402", "moteus", "vesc"])
def test_a_protocol_has_the_name_that_it_is_found_by(name: str) -> None:
    assert PROTOCOLS.get(name).name == name


def test_drives_of_two_protocols_on_one_bus_are_refused() -> None:
    robots = {"sue": {"left": [0], "right": [1]}, "bob": {"left": [2], "right": [4], "protocol": "cia402"}}
    with pytest.raises(ValidationError, match="cia402 on can0, where others speak odrive"):
        CanSettings.model_validate({"channel": "can0", "robots": robots})
