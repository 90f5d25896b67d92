"""`python -m vrg` is the `vrg` command."""

from vrg.cli import main

main()
