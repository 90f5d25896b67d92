"""The simulated source of fixes: the truth with noise, late, with gaps, and now and then under another robot's name."""
