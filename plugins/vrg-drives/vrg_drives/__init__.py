"""Motor controllers: tools to bring them up, and a protocol each for those that speak CiA 402, moteus or VESC."""
