"""The subcommands of `vrg`, one module per topic."""
