"""The strategies that come with VRG, one file a game."""
