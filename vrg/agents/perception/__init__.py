"""Perception of robots with a laser, for robots that do not report where they are. All are functions of arrays.

`scan` puts a scan on the map, `background` tells unusual returns from those of the empty scene, `clusters` makes
sightings of them, and `tracking` puts the sightings of a team together to the straight courses of several robots.
"""
