"""Games that come with VRG beside the three of the thesis, each in a folder of its own."""
