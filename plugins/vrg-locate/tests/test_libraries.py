"""What becomes of sources of fixes, and of matches without any, where a library is not installed."""

import subprocess
import sys

import pytest

CAMERA = ("cv2", "opencv-python-headless", "camera")
MOCAP = ("motioncapture", "motioncapture", "mocap")


@pytest.mark.parametrize(
    ("use", "library"),
    [
        ("SOURCES.get('camera')", CAMERA),
        ("make_app()(['locate', 'show', 'x.png'], standalone_mode=False)", CAMERA),
        ("SOURCES.get('mocap')", MOCAP),
    ],
)
def test_without_its_library_it_is_told_what_to_install_and_matches_without_it_are_played(
    use: str, library: tuple[str, str, str]
) -> None:
    module, package, extra = library
    code = f"import sys; sys.modules['{module}'] = None\nfrom vrg.localisation.source import SOURCES\n"
    code += "import vrg.commands.play\nSOURCES.get('sim')\n"
    code += "from vrg.cli import make_app\nfrom vrg.errors import ConfigError\n"
    code += f"try: {use}\nexcept ConfigError as error: print(error)"
    out = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, timeout=120, check=True)
    assert f"expected the package {package}" in out.stdout
    assert f"pip install 'virtual-robotic-games-locate[{extra}]'" in out.stdout
