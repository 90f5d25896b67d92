"""The maps that come with VRG, one TOML file each."""
