"""Matches in ROS 2, as its zenoh middleware (rmw_zenoh) has them on the wire, without ROS."""
