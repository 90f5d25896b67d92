"""The CAN layer on vcan0, with emulated drives: what a frame, a setpoint and a stop cost in time.

    scripts/with-vcan .venv/bin/python benchmarks/can.py

links   one thread sends a frame, another process answers at once, a receive thread takes the answer: a raw socket,
        bare python-can and the driver's CanBus in turn, in rounds; and frames a second that one thread sends. What
        counts is `x python-can`, the median over the rounds of the ratio in the same round.
codec   us to encode and decode, beside cantools if that is installed
load    of a robot with two axes at 250 kbit/s, frames counted on the bus, bits by the formulas in can_load.py
delay   from the call to the setpoint's frame on the bus, as the kernel stamps it for a listener
stop    from a drive's silence, and from the commander's death, to zero speed: below 0.5 turn/s, 1 cm/s of the wheel
axes    eight axes driven at 100 Hz by one process: gaps between the setpoints of each. That many would nearly fill a
        real bus of 250 kbit/s; a virtual one has no bit rate
estop   from the publication of an Estop in a match of real processes to its frames on the bus, and to zero speed
udp     the same over python-can's udp_multicast, on the machine's own kernel: --only udp, without with-vcan

A listener in a process of its own notes frames with the kernel's time of their arrival; that of calls is the same
clock's, CLOCK_REALTIME. VRG_VCAN tells what vcan0 is: `native`, or `uml`, a user-mode kernel with one CPU, where a
system call costs some 12 us in place of 0.1 and whoever waits on another process waits for its turn too. There the
ratios count, not the times.
"""

import json
import logging
import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

# This file has the name of python-can's package, which must be found first.
sys.path.sort(key=lambda folder: folder == str(Path(__file__).resolve().parent))

import can_links
import can_load
import can_match
import can_robots
import can_trials
from common import arguments, machine, median, show

PARTS = ("links", "codec", "load", "delay", "stop", "axes", "estop", "udp")
MATCHES = ("estop", "udp")
QUICK_SECONDS, SECONDS = 1.0, 60.0
_CALLS = 20_000

Part = tuple[str, list[dict[str, Any]], list[str]]


def kernel() -> str:
    """What vcan0 is, and how dear the kernel and exact a sleep is here."""
    began = time.perf_counter()
    for _ in range(_CALLS):
        os.getppid()
    call = (time.perf_counter() - began) / _CALLS * 1e6
    late = []
    for _ in range(50):
        began = time.perf_counter()
        time.sleep(1e-3)
        late.append((time.perf_counter() - began) * 1e6 - 1e3)
    kind = os.environ.get("VRG_VCAN", "not given by scripts/with-vcan")
    return (
        f"vcan0: {kind}{', a user-mode kernel with one CPU' if kind == 'uml' else ''}; {platform.release()}; "
        f"a system call {call:.2f} us, a sleep of 1 ms {median(late):.0f} us longer"
    )


def measure(part: str, quick: bool, seconds: float, tell: Callable[[str], None]) -> Part:
    """One part: title, rows, notes."""
    rows: list[dict[str, Any]]
    notes: list[str] = []
    match part:
        case "links":
            rounds, trips, burst = (3, 60, 300) if quick else (30, 200, 1000)
            title, rows = "Ways onto the bus", can_links.rows(can_links.measure(rounds, trips, burst, tell))
            notes = [f"{rounds} rounds of {trips} round trips and {burst} frames sent"]
        case "codec":
            costs = can_links.codec_costs(*((3, 1000) if quick else (15, 5000)))
            title, rows = "Codec", [{"what": name, "us": cost} for name, cost in costs.items()]
            notes = ["can.Message to Frame reads two clocks"]
        case "load":
            title, rows = "Bus load at 250 kbit/s", can_load.rows(1.0 if quick else 10.0, tell)
        case "delay":
            title, rows = "From the call to the bus", can_trials.delays(50 if quick else 800, tell)
        case "stop":
            title, rows = "Stopping by itself", can_trials.stops(1 if quick else 12, tell)
            notes = [
                "watchdog of the drives 0.2 s; a drive is taken for dead after 0.5 s; the commander drives at 10 Hz"
            ]
        case "estop" | "udp":
            title = "Emergency stop of a match"
            rows, notes = can_match.rows(*((1, 4) if quick else (10, 100)), tell, udp=part == "udp")
        case "axes":
            title = "Eight axes at 100 Hz"
            rows, notes = can_trials.eight_axes(seconds, tell)
    return title, rows, notes


def main() -> None:
    """Run the benchmark, and print its table."""
    if sys.argv[1:2] == ["--process"]:
        can_robots.process(*sys.argv[2:])
        return
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=None, help="of the eight axes (default: 60)")
    parser.add_argument(
        "--only",
        nargs="+",
        choices=PARTS,
        help="these parts (default: all, with --quick all but estop, which starts a match)",
    )
    options = parser.parse_args()
    logging.getLogger("vrg").setLevel(logging.CRITICAL)  # faults are meant here
    sys.setswitchinterval(1e-3)  # as VRG's own processes do
    seconds = options.seconds or (QUICK_SECONDS if options.quick else SECONDS)
    began = time.monotonic()

    def tell(text: str) -> None:
        print(f"{time.monotonic() - began:6.1f} s  {text}", file=sys.stderr, flush=True)

    head = kernel()
    if not options.json:
        print(head, flush=True)
    tables = []
    usual = [part for part in PARTS if part != "udp" and not (options.quick and part in MATCHES)]
    for part in options.only or usual:
        title, rows, notes = measure(part, options.quick, seconds, tell)
        tables.append({"title": title, "rows": rows, "notes": notes})
        if not options.json:
            show(title, rows, notes, as_json=False)
            sys.stdout.flush()
    if options.json:
        print(json.dumps({"kernel": head, "machine": machine(), "tables": tables}, indent=2))


if __name__ == "__main__":
    main()
