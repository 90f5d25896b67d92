"""Lets `python -m vrg` run the `vrg` command."""

from vrg.cli import main

main()
