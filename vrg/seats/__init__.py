"""The seats of a match: who has one, what it may publish and hear, its certificates, and how a router lets it in."""
