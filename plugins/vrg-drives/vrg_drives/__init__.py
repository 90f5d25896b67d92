"""Motor controllers that speak CiA 402, moteus or VESC: a protocol each, with its emulated drive."""
