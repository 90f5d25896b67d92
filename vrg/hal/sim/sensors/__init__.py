"""The simulations of sensors, one module a kind: from what is true of the robots to what their sensors say."""
