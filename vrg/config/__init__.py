"""Match files: one TOML file describes a match, and everything that is wrong with it is said at once.

`files` has the tables as people write them, `loading` reads and checks them, and `setup` is what comes of it: the
set-up from which every process of a match is made, without any of the code that checks it.
"""
