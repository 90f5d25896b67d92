"""The commander's window: a person coaches one team with a gamepad, or drives one of its players (thesis 4.4.4)."""
