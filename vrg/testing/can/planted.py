"""The suite of frames that should not be on the bus while a motor drives.

A protocol's test subclasses PlantedFrames, and says what each frame causes.
"""

from collections.abc import Mapping

import pytest

from vrg.hal.can.axis import MotorState
from vrg.hal.can.frame import Frame
from vrg.hal.can.protocols import PROTOCOLS
from vrg.testing.wire import ProtocolWire

NODE = 5
"""The id of the drive beside which they are planted."""
ANOTHER = "another program commands it too"


class PlantedFrames:
    """Subclasses have these attributes.

    Attributes:
        protocol: its name.
        planted: frames, by what each is: the frame, and words that are in what the axis reports; None if it reports
            nothing.
    """

    protocol: str
    planted: Mapping[str, tuple[Frame, str | None]]

    def pytest_generate_tests(self, metafunc: pytest.Metafunc) -> None:
        """Have a test for each frame."""
        if "frame" in metafunc.fixturenames:
            metafunc.parametrize(("frame", "words"), self.planted.values(), ids=self.planted.keys())

    @pytest.fixture
    def wire(self) -> ProtocolWire:
        """A drive whose motor drives."""
        found = PROTOCOLS.get(self.protocol)
        options = found.axis_type.options_type.model_validate(found.drive_type.wiring)
        return ProtocolWire(found, NODE, options=options).running()

    def test_what_a_planted_frame_causes(self, wire: ProtocolWire, frame: Frame, words: str | None) -> None:
        axis = wire.axis
        assert axis.state is not MotorState.SILENT
        assert axis.implausible is None
        axis.receive(Frame(frame.id, frame.data, frame.remote, frame.extended, axis.heard, frame.fd))
        assert (axis.implausible is None) == (words is None)
        assert (words or "") in (axis.implausible or "")

    def test_each_that_must_be_noticed_passes_the_filters_of_the_interface(self, wire: ProtocolWire) -> None:
        filters = wire.axis.filters
        for what, (frame, words) in self.planted.items():
            if words is not None:
                assert any(wanted.passes(frame) for wanted in filters), what
