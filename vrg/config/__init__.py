"""Match files: one TOML file describes a match, and all its problems are reported at once.

`files` has the tables as people write them, and `loading` reads and checks them. The result is in `setup`: the set-up
from which every process of a match is made, without the code that checks match files.
"""
