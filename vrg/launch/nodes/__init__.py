"""Makes the nodes of a match, the same for every executor. A process imports only the module of its own."""
