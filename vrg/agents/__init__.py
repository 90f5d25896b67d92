"""The player: its runtime, hybrid automata, control laws and strategies."""
