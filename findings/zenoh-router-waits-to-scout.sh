#!/usr/bin/env bash
# eclipse-zenoh 1.10.2, CPython 3.11, 2026-11-30
#
# A router with scouting by multicast and by gossip turned off still waits for `scouting/delay` (500 ms) before its
# `open` returns. The comment in zenoh's configuration file says that the delay is for peers, to look for others before
# they do anything else; a router that looks for nobody needs none. Its clients are served meanwhile, so whoever
# declares something at the router after `open`, such as a token that says that it lives, does so half a second late.
# Each start of a robot's processes takes half a second longer by it. To live with it: set `scouting/delay` to 0 where
# scouting is off.
. "$(dirname "$0")/setup.bash" eclipse-zenoh==1.10.2
"$python" - <<'PYTHON'
import json
import threading
import time

import zenoh


def configuration(delay, port, mode):
    made = zenoh.Config()
    end = {"listen": {"endpoints": [port]}} if mode == "router" else {"connect": {"endpoints": [port]}}
    scouting = {"multicast": {"enabled": False}, "gossip": {"enabled": False}, "delay": delay}
    for key, value in {"mode": mode, "scouting": scouting, **end}.items():
        made.insert_json5(key, json.dumps(value))
    return made


def served_before_open_returns(delay, port):
    opened = threading.Event()

    def route():
        router = zenoh.open(configuration(delay, port, "router"))
        opened.set()
        done.wait()
        router.close()

    done = threading.Event()
    thread = threading.Thread(target=route)
    thread.start()
    while True:
        try:
            client = zenoh.open(configuration(delay, port, "client"))
            break
        except zenoh.ZError:
            time.sleep(0.05)
    opened.wait(5)  # much longer than it takes without a delay
    before = not opened.is_set()
    client.close()
    done.set()
    thread.join()
    return before


for delay, port in ((20_000, "tcp/127.0.0.1:27447"), (0, "tcp/127.0.0.1:27448")):
    before = served_before_open_returns(delay, port)
    print(f"delay {delay} ms: the client was served, and the router's open had {'not ' * before}returned 5 s later")
    assert before is (delay > 0)
PYTHON
# Seen:
# delay 20000 ms: the client was served, and the router's open had not returned 5 s later
# delay 0 ms: the client was served, and the router's open had returned 5 s later
