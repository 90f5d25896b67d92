#!/usr/bin/env bash
# python-can 4.6.1 (interface `virtual`), CPython 3.11, 2026-11-29
#
# A can.Notifier hands each message to all of its listeners, one after the other, in one thread. An exception in one of
# them ends this thread: the listeners after it do not get the message at hand, and none gets any later one. A display
# that cannot format one frame thus makes the driver deaf that shares the bus with it, and the logger writes no more.
# Nothing is raised in the program; Notifier.exception holds the error for those who look, and `stop` raises nothing. One
# would expect that listeners are independent of one another. To live with it: catch everything in each listener, or
# derive from Listener with `on_error` in mind, and watch the age of what was heard last.
. "$(dirname "$0")/setup.bash" python-can==4.6.1
"$python" - <<'PYTHON'
import logging
import threading
import time

import can

logging.disable(logging.CRITICAL)
ended = threading.Event()
threading.excepthook = lambda _: ended.set()


class Display(can.Listener):
    def on_message_received(self, message):
        if message.arbitration_id == 0x100:
            print("speed:", message.data[4])  # this frame has two bytes


class Driver(can.Listener):
    heard = []

    def on_message_received(self, message):
        self.heard.append(message.arbitration_id)


bus, other = can.Bus("bus", interface="virtual"), can.Bus("bus", interface="virtual")
driver = Driver()
notifier = can.Notifier(bus, [Display(), driver], timeout=0.05)
for number in (0x200, 0x100, 0x201, 0x202):
    other.send(can.Message(arbitration_id=number, data=[1, 2], is_extended_id=False))
ended.wait()
time.sleep(1.0)
print("sent: 0x200 0x100 0x201 0x202; the driver heard:", *map(hex, driver.heard))
print("the notifier holds:", repr(notifier.exception))
assert driver.heard == [0x200]
assert isinstance(notifier.exception, IndexError)
notifier.stop()
bus.shutdown()
other.shutdown()
PYTHON
# Seen:
# sent: 0x200 0x100 0x201 0x202; the driver heard: 0x200
# the notifier holds: IndexError('bytearray index out of range')
