"""A match of three robots on a small field, which is played in a few seconds; one may have emulated drives."""

TINY = """
name = "tiny"
game = "sharks-and-minnows"
map = "open"
engine = "planar"
seed = 3
lasers = false
[rules]
x = [-5.0, 5.0]
y = [-5.0, 5.0]
passes = 1
[[players]]
name = "shark"
role = "shark"
x = 0.0
y = -4.0
[[players]]
name = "ann"
role = "minnow"
x = -3.0
y = 4.0
[[players]]
name = "bob"
role = "minnow"
x = 3.0
y = 4.0
"""

TINY_CAN = TINY.replace(
    "[[players]]",
    """[backends.can]
interface = "virtual"
channel = "tiny"
emulate = true
[backends.can.robots.ann]
left = [0]
right = [1]
ratio = 50.0
[[players]]""",
    1,
).replace('name = "ann"', 'name = "ann"\nbackend = "can"')
"""The same; the motors of ann's robot are on a CAN bus."""
