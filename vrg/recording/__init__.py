"""The recording of a match: the recorder that writes it, the schemas that viewers know, and the reader of runs.

Nothing of this room is known to the bus or to a robot; it only listens.
"""
