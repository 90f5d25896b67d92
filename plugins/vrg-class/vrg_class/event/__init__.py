"""Events: a timetable of matches on one field, its pages for the stage, the officials and spectators."""
