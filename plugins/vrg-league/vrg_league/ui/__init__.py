"""Pictures and pages of many games: pages of tables, games that move, and plots."""
