"""The bus: the messages that nodes send each other, and the executors that call the nodes."""
