"""The check of ROS 2 in `vrg doctor`."""

import os

from vrg.bus.session import DEFAULT_ENDPOINT, open_session
from vrg.errors import VrgError
from vrg.launch.running import running
from vrg.plugins import Finding
from vrg_ros.command import BESIDE, typed_domain
from vrg_ros.meeting import graph_of


def check() -> Finding:
    """The settings that ROS 2 needs in order to see a match, and its nodes at the routers of this machine."""
    wanted = "rmw_zenoh_cpp"
    distribution, used = os.environ.get("ROS_DISTRO", ""), os.environ.get("RMW_IMPLEMENTATION", "")
    texts = []
    try:
        typed_domain()
    except VrgError as error:
        texts.append(str(error))
    if distribution == "humble":
        texts.append("Humble and VRG cannot exchange messages, as Humble has no hashes of types: use Jazzy or later")
    elif used != wanted:
        texts.append(
            f"in the terminals of ROS 2: export RMW_IMPLEMENTATION={wanted}, and for another router than "
            f"{DEFAULT_ENDPOINT} the line that `vrg play --ros` prints; then ros2 daemon stop; nodes need use_sim_time"
        )
    beside = f"tcp/127.0.0.1:{BESIDE}"
    open_ones = [match.router for match in running() if match.router.startswith("tcp/")]
    for router in dict.fromkeys([DEFAULT_ENDPOINT, beside, *open_ones]):
        try:
            with open_session(router, patience=0.5) as session:
                graph = graph_of(session, "*")
        except VrgError:
            continue
        texts.append(f"{router}: {', '.join(dict.fromkeys(each.node for each in graph)) or 'no node'}")
        texts += dict.fromkeys(each.trouble for each in graph if each.trouble)
    return Finding("ROS 2", None, "; ".join(texts))
