#!/bin/bash
# Tries a running match of VRG from ROS 2 (Jazzy or later, with rmw_zenoh). Beside it run `vrg play MATCH --ros`, such as
# plugins/vrg-ros/examples/stand_in.toml, in which ROS drives the robot.
#
#     bash plugins/vrg-ros/try.sh MATCH [ROUTER]      such as: courtyard tcp/127.0.0.1:7447
set -u
match=${1:?name the match, such as courtyard}
export RMW_IMPLEMENTATION=rmw_zenoh_cpp
# Without a router that is named, nodes are peers, and find the router of this machine at port 7447.
[ -n "${2:-}" ] && export ZENOH_CONFIG_OVERRIDE="mode=\"client\";connect/endpoints=[\"$2\"]"
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
    echo "BAD  no topic begins with /$match/: is a match running with --ros, and this its router?"
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
if echo "$topics" | grep -q "^/$match/$robot/cmd_vel\$"; then
    timeout 5 ros2 topic pub -r 20 "/$match/$robot/cmd_vel" geometry_msgs/msg/Twist '{linear: {x: 0.2}}' >/dev/null &
    sleep 3
    check "$robot drives by cmd_vel" bash -c "ros2 topic echo --once --field twist.twist.linear.x /$match/$robot/odom | grep -E '^0\.(1|2)'"
    wait
fi
exit $failed
