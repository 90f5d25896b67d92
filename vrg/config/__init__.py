"""Match files: one TOML file describes a match, and all its problems are reported at once.

`files` declares the tables as people write them; `loading`, with `checks`, reads and checks them. The result is the
set-up of the match in `setup`: the file with what follows from it. Every process of a match is made from it, without
the code that checks match files.
"""
