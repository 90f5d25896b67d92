"""A match as a function: played in this process, in steps or as processes, with strategies here or apart."""
