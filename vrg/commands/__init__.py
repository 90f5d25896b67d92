"""The subcommands of `vrg`, one module a topic."""
