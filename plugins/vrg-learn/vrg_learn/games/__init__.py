"""What programs that learn see of the games of VRG, and what they are paid for: a module a game."""
