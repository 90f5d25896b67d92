"""The bus: what nodes say to each other, and who calls them when."""
