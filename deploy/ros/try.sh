#!/bin/bash
# Tries a running match of VRG from ROS 2 (Jazzy or later, with rmw_zenoh). Beside it run `vrg play` and `vrg show ros`.
#
#     bash deploy/ros/try.sh MATCH [ROUTER]      such as: courtyard tcp/127.0.0.1:7447
set -u
match=${1:?name the match, such as courtyard}
export RMW_IMPLEMENTATION=rmw_zenoh_cpp
export ZENOH_CONFIG_OVERRIDE="mode=\"client\";connect/endpoints=[\"${2:-tcp/127.0.0.1:7447}\"]"
ros2 daemon stop >/dev/null 2>&1
failed=0

check() { # what, command...
    local what=$1
    shift
    if timeout 20 "$@" >/tmp/vrg-ros-try.txt 2>&1 && [ -s /tmp/vrg-ros-try.txt ]; then
        echo "ok   $what"
    else
        echo "BAD  $what: $*"
        sed 's/^/       /' /tmp/vrg-ros-try.txt | head -5
        failed=1
    fi
}

topics=$(timeout 20 ros2 topic list --no-daemon)
echo "$topics" | grep -q "^/$match/" && echo "ok   topics of $match: $(echo "$topics" | grep -c "^/$match/")" || {
    echo "BAD  no topic begins with /$match/: is \`vrg show ros\` running, and this its router?"
    exit 1
}
robot=$(echo "$topics" | sed -n "s#^/$match/\([^/]*\)/odom\$#\1#p" | head -1)
check "the clock" ros2 topic echo --once /clock
check "odometry of $robot" ros2 topic echo --once "/$match/$robot/odom"
check "its scan" ros2 topic echo --once "/$match/$robot/scan"
check "the map" ros2 topic echo --once --qos-durability transient_local "/$match/map"
check "frames" ros2 topic echo --once /tf
check "the referee" ros2 topic echo --once "/$match/referee/state"
check "a bag of 5 s" bash -c "rm -rf /tmp/vrg-ros-bag; timeout -s INT 5 ros2 bag record -o /tmp/vrg-ros-bag /$match/$robot/odom; ros2 bag info /tmp/vrg-ros-bag"
exit $failed
