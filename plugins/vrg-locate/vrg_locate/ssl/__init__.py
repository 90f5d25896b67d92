"""A source of fixes: the vision of the RoboCup Small Size League."""
