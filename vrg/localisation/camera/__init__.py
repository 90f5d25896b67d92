"""A source of fixes: a camera above the field that sees a printed tag on each robot."""
