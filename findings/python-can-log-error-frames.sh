#!/usr/bin/env bash
# python-can 4.6.1, CPython 3.11, 2026-11-29
#
# can.LogReader reads log files of `candump -L`. An error frame in one, which the kernel logs as an identifier with the
# bit 0x20000000 and the class of the error in the lower bits, is read as an ordinary extended data frame: 20000004 as
# identifier 4, with is_error_frame False. Only the one word 20000080 is taken for an error frame, and that is what
# can.Logger writes for each, whatever its class was: the cause is lost in the file. One expects that a log of a bus that
# failed still tells how, as the writer is documented to be compatible with `candump -L`, and that no error becomes a
# message of some drive. Who counts frames by identifier, or replays such a log, gets frames that no device has sent.
# To live with it: read such logs by hand, where the identifier has the bit 0x20000000.
. "$(dirname "$0")/setup.bash" python-can==4.6.1
"$python" - <<'PYTHON'
import can

CONTROLLER, BUS_ERROR = 0x20000004, 0x20000080  # linux/can/error.h: CAN_ERR_CRTL, CAN_ERR_BUSERROR, with CAN_ERR_FLAG

with open("candump.log", "w") as file:
    file.write("(1764400000.500000) can0 20000004#0004000000000000\n")  # receive queue at the warning level
    file.write("(1764400000.600000) can0 123#010203\n")
error, data = can.LogReader("candump.log")
print(f"read: identifier {error.arbitration_id:#x}, error frame: {error.is_error_frame}, data {bytes(error.data).hex()}")
assert (error.arbitration_id, error.is_error_frame, error.is_extended_id) == (4, False, True)
assert data.arbitration_id == 0x123

with can.Logger("written.log") as writer:
    for kind in (CONTROLLER, BUS_ERROR):
        writer.on_message_received(
            can.Message(timestamp=1.0, channel="can0", arbitration_id=kind, is_error_frame=True, data=bytes(8))
        )
lines = [line.split()[2] for line in open("written.log")]
print("written:", *lines)
assert lines == ["20000080#0000000000000000"] * 2
PYTHON
# Seen:
# read: identifier 0x4, error frame: False, data 0004000000000000
# written: 20000080#0000000000000000 20000080#0000000000000000
