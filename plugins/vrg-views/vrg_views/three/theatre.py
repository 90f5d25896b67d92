"""Shows stages to browsers through viser, whose server runs on threads of its own. This module alone knows viser."""

import contextlib
import io
import logging
import socket
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import viser

from vrg.colours import Rgb, mix
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, LaunchError
from vrg.hal.models import RobotModel, robot_model
from vrg.hal.sensors.depiction import Rays
from vrg.types import Pose, Vector
from vrg.ui import palette, picture
from vrg.ui.scene import Scene, SceneBody
from vrg.ui.web.headers import foreign
from vrg_views.three import camera
from vrg_views.three.board import STYLE, board, last_call
from vrg_views.three.camera import CameraMode, Point, Shot
from vrg_views.three.ground import Extent, extent, ground
from vrg_views.three.robots import robot_look
from vrg_views.three.stage import Batch, BatchMaker, Lines, fan, trails

log = logging.getLogger(__name__)

VIEWERS: Final = 32
"""The most browsers that are admitted at once."""
_HAZE: Final[Rgb] = mix(palette.BACKGROUND, palette.CALM, 0.6)
"""The colour of the horizon."""
_LINEAR: Final = np.round(255 * (np.arange(256) / 255) ** 2.2).astype(np.uint8)
"""viser takes the colours of what is drawn many times as they are before the screen's gamma."""

Scans = Mapping[str, tuple[Pose, Rays]]
"""The newest scan of each robot, with the pose of the robot at that time."""


class _Server(viser.ViserServer):
    """viser's server without its tunnel: with that, any viewer could show the match to the internet."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse it."""
        log.warning("a viewer asked to share the match on the internet: refused")
        return None


@dataclass
class Viewer:
    """One browser.

    Args:
        robots: where its person chooses a robot. view, robot: how it looks, and at which robot.
        shot: from where it looked last; None lets it be aimed again. place: what it was aimed at.
    """

    client: viser.ClientHandle
    robots: viser.GuiDropdownHandle[str]
    view: CameraMode = CameraMode.ORBIT
    robot: str = ""
    shot: Shot | None = None
    place: Extent | None = None


class Theatre:
    """The view in browsers. They choose its look and can change nothing else.

    Args:
        robots: the models of the robots, by name. host: the address to listen on. port: the port. title: of the page.
    """

    def __init__(self, robots: Mapping[str, RobotModel], host: str, port: int, title: str) -> None:
        self._stage = BatchMaker(robots, robot_model("P2AT"))
        self._host, self._port, self._title = host, port, title
        self._viewers: dict[int, Viewer] = {}
        self._nodes: dict[str, Any] = {}
        self._batches: dict[str, Batch] = {}
        self._painted: dict[str, tuple[str, float, Point]] = {}
        self._count = 0
        self._still: tuple[object, ...] = ()
        self._drawn: tuple[object, ...] = ()
        self._bodies: dict[str, SceneBody] = {}
        self._place = extent(Scene())

    @property
    def watched(self) -> bool:
        """True if anybody looks."""
        return bool(self._viewers)

    @property
    def followed(self) -> set[str]:
        """The robots that a viewer follows."""
        return {
            viewer.robot
            for viewer in list(self._viewers.values())
            if viewer.view in (CameraMode.FOLLOW, CameraMode.EYES)
        }

    @property
    def gui(self) -> viser.GuiApi:
        """The small panel of every browser."""
        return self.server.gui

    def open(self) -> None:
        """Let browsers in.

        Raises:
            LaunchError: the port is not free.
        """
        with _quiet():
            self.server = _Server(host=self._host, port=self._port, label=self._title, verbose=False)
        if self.server.get_port() != self._port:
            self.close()
            raise LaunchError(f"port {self._port} of {self._host} is not free any more: try again")
        self.server._websock_server.on_client_connect(self._admit)
        self.server.on_client_connect(self._enter)
        self.server.on_client_disconnect(self._leave)
        gui, scene = self.server.gui, self.server.scene
        gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False, brand_color=palette.ECHO)
        gui.main_panel.float(x=-14, y=14, width=268)
        gui.add_html(STYLE)
        self._nodes["board"], self._nodes["call"] = gui.add_html(""), gui.add_html("")
        scene.configure_default_lights(enabled=False)
        scene.configure_environment_map(None)
        scene.add_light_hemisphere("/lights/sky", sky_color=(205, 222, 255), ground_color=(96, 100, 108), intensity=3.0)
        _shine(scene, shadows=True)
        scene.set_background_image(_sky())

    def close(self) -> None:
        """Send everybody away. Calling it again does nothing."""
        if hasattr(self, "server"):
            with _quiet():
                self.server.stop()
            del self.server

    def show(self, scene: Scene, seconds: float, scans: Scans | None = None) -> None:
        """Show a scene from now on.

        Args:
            seconds: the real time since the last one. scans: what robots have measured.
        """
        self._bodies = {body.name: body for body in scene.bodies}
        with self.server.atomic():
            still = (scene.game, scene.zones, scene.obstacles, scene.starts)
            if self._still != still:
                self._still = still
                self._build(scene)
            batches = {batch.name: batch for batch in self._stage.batches(scene)}
            for name in self._batches.keys() - batches.keys():
                self._nodes.pop(name).remove()
            self._batches = batches
            for batch in batches.values():
                self._batch(batch)
            drawn = tuple((body.trail, body.state) for body in scene.bodies)
            if self._drawn != drawn:
                self._drawn = drawn
                self._lines(trails(scene))
            self._labels(scene)
        self._nodes["board"].content, self._nodes["call"].content = board(scene), last_call(scene)
        names = tuple(sorted(self._bodies))
        for viewer in list(self._viewers.values()):
            if names and viewer.robots.options != names:
                viewer.robots.options = names
            self._look(viewer, seconds)
            self._scan(viewer, scans or {})

    def _build(self, scene: Scene) -> None:
        """Build what stands still, and choose the first view."""
        self._place = place = extent(scene)
        shot, first = camera.overview(place), self.server.initial_camera
        first.fov, first.near, first.far = camera.FIELD_OF_VIEW, 0.05, 500.0
        first.position, first.look_at = shot.eye, shot.target
        far = max(place.length, place.width)
        self.server.scene.configure_fog(2.5 * far, 2.5 * far + 90.0, color=_HAZE)
        for name in [name for name in self._nodes if name.startswith("ground/")]:
            self._nodes.pop(name).remove()
        self._painted = {
            f"label/{figure.name}": (" ".join(figure.writing.lines), 0.7, (*figure.writing.middle, 0.05))
            for figure in picture.ground(scene)
            if figure.writing is not None
        }
        for number, solid in enumerate(ground(scene)):
            self._nodes[f"ground/{number}"] = self.server.scene.add_mesh_simple(
                f"/ground/{number}",
                solid.mesh.vertices,
                solid.mesh.faces,
                color=solid.colour,
                flat_shading=True,
                cast_shadow=solid.casts,
            )

    def _batch(self, batch: Batch) -> None:
        node = self._nodes.get(batch.name)
        if node is not None and len(node.batched_positions) == len(batch.places):
            # What is the same as before is not sent.
            node.batched_positions, node.batched_wxyzs = batch.places, batch.turns
            node.batched_scales, node.batched_colors = batch.scales, _LINEAR[batch.colours]
            return
        node = self._nodes[batch.name] = self.server.scene.add_batched_meshes_simple(
            f"/{batch.name}", batch.mesh.vertices, batch.mesh.faces, batch.turns, batch.places,
            batched_scales=batch.scales, batched_colors=_LINEAR[batch.colours], lod="off", flat_shading=True,
            cast_shadow=batch.casts, opacity=None if batch.opacity == 1.0 else batch.opacity,
        )  # fmt: skip
        if batch.robots:

            @node.on_click
            def _(event: Any, name: str = batch.name) -> None:
                now = self._batches.get(name)
                if now is not None and event.instance_index in range(len(now.robots)):
                    self._choose(event.client.client_id, CameraMode.FOLLOW, now.robots[event.instance_index])

    def _lines(self, lines: Lines) -> None:
        node = self._nodes.get("trails")
        if node is None:
            self._nodes["trails"] = self.server.scene.add_line_segments(
                "/trails", lines.points, _LINEAR[lines.colours], thickness=0.035, thickness_units="world"
            )
        else:
            node.points, node.colors = lines.points, _LINEAR[lines.colours]

    def _labels(self, scene: Scene) -> None:
        """Name the robots and the zones, and write what the referee has just called where it happened."""
        wanted = {
            f"label/{body.name}": (body.name, 0.9, (body.pose.x, body.pose.y, self._eye(body)[1] + 0.15))
            for body in scene.bodies
        }
        wanted |= self._painted
        for news in scene.flashes:
            wanted[f"label/{news.word} {news.at}"] = news.word.upper(), 1.8, (*news.at, 1.0 + 0.8 * news.share)
        for key in [key for key in self._nodes if key.startswith("label/") and key not in wanted]:
            self._nodes.pop(key).remove()
        for key, (text, size, place) in wanted.items():
            if key in self._nodes:
                self._nodes[key].position = place
            else:
                # A name may hold signs that mean something in the name of a node.
                self._count += 1
                self._nodes[key] = self.server.scene.add_label(
                    f"/labels/{self._count}", text, position=place, anchor="bottom-center", font_screen_scale=size
                )

    def _eye(self, body: SceneBody) -> Vector:
        ahead, height = robot_look(self._stage.model(body.name)).eye
        return ahead, height + body.pose.z

    def _look(self, viewer: Viewer, seconds: float) -> None:
        """Aim the camera of a viewer again: always if it follows a robot, and else where the field has changed."""
        if viewer.view in (CameraMode.ORBIT, CameraMode.TOP):
            if viewer.place != self._place:
                viewer.place = self._place
                lens = viewer.client.camera
                shape = lens.image_width / max(lens.image_height, 1)
                _aim(viewer, (camera.overview if viewer.view is CameraMode.ORBIT else camera.above)(self._place, shape))
            return
        body = self._bodies.get(viewer.robot)
        if body is None:
            return
        if viewer.view is CameraMode.FOLLOW:
            wanted = camera.behind(body.pose, body.length)
            shot = wanted if viewer.shot is None else camera.eased(viewer.shot, wanted, seconds)
        else:
            shot = camera.inside(body.pose, self._eye(body))
        _aim(viewer, shot)

    def _scan(self, viewer: Viewer, scans: Scans) -> None:
        """Lay the scan of the robot that a viewer follows on the ground."""
        node = self._nodes.get(f"scan/{viewer.client.client_id}")
        found = scans.get(viewer.robot) if viewer.view in (CameraMode.FOLLOW, CameraMode.EYES) else None
        if found is None:
            if node is not None:
                node.visible = False
            return
        mesh = fan(*found)
        if node is None or len(node.vertices) != len(mesh.vertices):
            self._nodes[f"scan/{viewer.client.client_id}"] = viewer.client.scene.add_mesh_simple(
                "/scan", mesh.vertices, mesh.faces, color=palette.ECHO, opacity=0.16, cast_shadow=False,
                receive_shadow=False,
            )  # fmt: skip
        else:
            node.vertices, node.visible = mesh.vertices, True

    def _choose(self, number: int, view: CameraMode, robot: str) -> None:
        """Give a viewer another way to look."""
        viewer = self._viewers.get(number)
        if viewer is None:
            return
        viewer.view, viewer.robot, viewer.shot, viewer.place = view, robot, None, None
        viewer.client.camera.fov = camera.FIELD_OF_VIEW * (1.35 if view is CameraMode.EYES else 1.0)

    async def _admit(self, connection: Any) -> None:
        """Send away who is one too many, or comes from a page of another site."""
        live = self.server._websock_server._live_connections
        link = live[connection.client_id]
        headers = {} if link.request is None else link.request.headers
        try:
            why = foreign(headers.get("Origin"), headers.get("Host", ""), self._host, socket.gethostname())
        except ValueError as problem:
            why = f"expected an address in Host and Origin: {problem}"
        if len(live) > VIEWERS:
            why = f"{VIEWERS} pages are open already, and this is the limit: close one"
        if why:
            log.warning("refused a viewer: %s", why)
            await link.close(1008, why[:120])

    def _enter(self, client: viser.ClientHandle) -> None:
        number = client.client_id
        # Open, it would hide a part of the field. The panel itself must stay open, as the board is a part of it.
        with client.gui.add_folder("View", expand_by_default=False):
            views = client.gui.add_button_group("", [view.value for view in CameraMode])
            robots = client.gui.add_dropdown("Robot", sorted(self._bodies) or ["-"])
            shadows = client.gui.add_checkbox("Shadows", initial_value=True)
        self._viewers[number] = viewer = Viewer(client, robots)

        @views.on_click
        def _(_event: Any) -> None:
            self._choose(number, CameraMode(views.value), robots.value)

        @robots.on_update
        def _(event: Any) -> None:
            # Without a client it was this process that has put other robots there.
            if event.client is not None:
                view = viewer.view if viewer.view is CameraMode.EYES else CameraMode.FOLLOW
                self._choose(number, view, robots.value)

        @shadows.on_update
        def _(_event: Any) -> None:
            # A light of this viewer alone stands in for everybody's of the same name.
            _shine(client.scene, shadows=shadows.value)

    def _leave(self, client: viser.ClientHandle) -> None:
        self._viewers.pop(client.client_id, None)
        self._nodes.pop(f"scan/{client.client_id}", None)


def theatre(setup: MatchSetup, address: str) -> Theatre:
    """Make what browsers see of a match in three dimensions, running or recorded.

    Args:
        address: where it is served, such as `127.0.0.1:8090`.
    """
    robots, (host, _, port) = {}, address.rpartition(":")
    for player in setup.players:
        # A recording may name a model that is not installed here.
        with contextlib.suppress(ConfigError):
            robots[player.name] = player.robot
    return Theatre(robots, host.strip("[]"), int(port), setup.name)


def _aim(viewer: Viewer, shot: Shot) -> None:
    viewer.shot, lens = shot, viewer.client.camera
    with viewer.client.atomic():
        lens.up_direction = (0.0, 0.0, 1.0)
        lens.position = shot.eye
        lens.look_at = shot.target


def _shine(scene: viser.SceneApi, *, shadows: bool) -> None:
    """Let the sun shine. Shadows double the work of a computer without a graphics card."""
    scene.add_light_directional(
        "/lights/sun", color=(255, 240, 218), intensity=2.5, cast_shadow=shadows, position=(-5.0, -8.0, 12.0)
    )


def _sky() -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Night above, lighter towards the horizon: a picture that lies behind everything."""
    share = np.clip(np.linspace(0.0, 2.0, 128), 0.0, 1.0)[:, None]
    rows = np.array(palette.BACKGROUND) * (1.0 - share) + np.array(_HAZE) * share
    return np.repeat(rows[:, None, :], 4, axis=1).astype(np.uint8)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """viser prints where it listens, which commands tell themselves."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield
