"""The comparison of strategies: many games in pairs with the sides swapped, and what they prove."""
