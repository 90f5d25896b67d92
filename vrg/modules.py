"""Which file or folder a module is that lies beside a match file."""

from pathlib import Path


def module_in(folder: Path, name: str) -> Path | None:
    """The file or the folder of a module in a folder; None for VRG itself, which is no part of a match."""
    if name == "vrg":
        return None
    if (folder / f"{name}.py").is_file():
        return folder / f"{name}.py"
    package = folder / name
    return package if package.is_dir() and any(package.glob("*.py")) else None
