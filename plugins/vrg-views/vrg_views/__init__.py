"""Further views of matches: the head-up display of a player, the details of the page, three dimensions, Foxglove."""
