"""There are no wheels of the library for Linux on ARM; what needs it is not tested there."""

from importlib.util import find_spec

collect_ignore = [] if find_spec("motioncapture") else ["test_source.py", "test_stream.py"]
