"""What cannot be tested where PyBullet has no wheels."""

from vrg.hal.sim.engines import BULLET, installed

collect_ignore = [] if installed(BULLET) else ["test_bullet.py", "test_camera.py"]
