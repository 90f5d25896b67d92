"""The simulations of sensors, one module per kind. They compute the sensors' messages from the true state of robots."""
