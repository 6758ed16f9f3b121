"""Frame time of our renderer and of PyBullet's, on one scene and one view; run alone it prints a table.

Every function returns rows: ``{"name": ..., "median_ms": ..., "p10_ms": ..., "p90_ms": ..., ...}``.
"""

import importlib.util
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import cv2
import numpy as np
import pybullet
import trimesh

from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.render.renderer import Renderer
from drone_sim.shapes.box import Box
from drone_sim.shapes.cylinder import Cylinder
from drone_sim.shapes.mesh import Mesh
from drone_sim.shapes.shape import DrawnShape, Files, Rgba
from drone_sim.shapes.sphere import Sphere
from drone_sim.shapes.visual import Visual

Row = dict[str, Any]
Drawn = tuple[list[Visual], np.ndarray]  # and their poses, world from visual (N, 4, 4)

CAMERA = Intrinsics(640, 480, np.radians(60.0), 0.02, 100.0)
LENS = Distorted(640, 480, np.radians(60.0), 0.02, 100.0, "plumb_bob", (-0.28, 0.07))
EQUIDISTANT = Distorted(640, 480, np.radians(60.0), 0.02, 100.0, "equidistant", (-0.05, 0.01))
FISHEYE = Distorted(640, 480, np.radians(170.0), 0.02, 100.0, "equidistant")
AHEAD = np.array([[0.0, 0.0, 1.0, 0.2], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.8], [0.0, 0.0, 0.0, 1.0]])
DOWNWARD = np.array(  # 1 m above the floor, 30 degrees down: floor to the last pixel, and the quadrotor's shadow
    [[0.0, -0.5, np.sqrt(0.75), -4.5], [-1.0, 0.0, 0.0, 0.0], [0.0, -np.sqrt(0.75), -0.5, 1.0], [0.0, 0.0, 0.0, 1.0]]
)
WHITE, DARK = (1.0, 1.0, 1.0, 1.0), (0.2, 0.2, 0.22, 1.0)
COLOURS = ((0.85, 0.25, 0.2, 1.0), (0.2, 0.5, 0.8, 1.0), (0.95, 0.75, 0.2, 1.0), (0.35, 0.65, 0.35, 1.0))
ARM = 0.13  # metres from the middle to a propeller


def measure(name: str, draw: Callable[[], Any], seconds: float = 2.0, **facts: Any) -> Row:
    """Time `draw` for so many `seconds`, at least five times."""
    amounts = ", ".join(f"{key} {value}" for key, value in facts.items())
    print(f"  {amounts or name}", file=sys.stderr, flush=True)
    return {**_row(name, in_turn({name: draw}, seconds)[name]), **facts}


def in_turn(draws: Mapping[str, Callable[[], Any]], seconds: float) -> dict[str, np.ndarray]:
    """Time five frames of each, again and again, for `seconds` each; return the rounds of each, (n, 5), ms."""
    rounds: dict[str, list[list[float]]] = {name: [] for name in draws}
    end = time.perf_counter() + seconds * len(draws)
    while not all(rounds.values()) or time.perf_counter() < end:
        for name, draw in draws.items():
            draw()  # what the one before has left in the caches is not its own
            draw()
            rounds[name].append([_milliseconds(draw) for _ in range(5)])
    return {name: np.array(times) for name, times in rounds.items()}


def _milliseconds(draw: Callable[[], Any]) -> float:
    start = time.perf_counter()
    draw()
    return 1000.0 * (time.perf_counter() - start)


def _row(name: str, times: np.ndarray) -> Row:
    p10, median, p90 = (float(value) for value in np.percentile(times, [10, 50, 90]))
    return {"name": name, "median_ms": median, "p10_ms": p10, "p90_ms": p90}


def pose(x: float, y: float, z: float, yaw: float = 0.0) -> np.ndarray:
    """World-from-visual, (4, 4)."""
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    matrix[:3, 3] = x, y, z
    return matrix


def build(folder: Path, things: int = 10, triangles: int = 0) -> Drawn:
    """A textured floor of 10 x 10 m, a quadrotor at 0.8 m, boxes and cylinders, perhaps a ball of triangles."""
    parts: list[tuple[DrawnShape, Rgba, np.ndarray]] = [
        (Mesh(_floor(folder)), WHITE, np.eye(4)),
        (Box((0.1, 0.1, 0.05)), DARK, pose(0, 0, 0.8)),
        (Sphere((0.04,)), COLOURS[0], pose(0.05, 0, 0.8)),
    ]
    for angle in np.pi * np.array([0.25, 0.75, 1.25, 1.75]):
        x, y = ARM * np.cos(angle), ARM * np.sin(angle)
        parts.append((Box((0.26, 0.02, 0.012)), DARK, pose(x / 2, y / 2, 0.8, angle)))
        parts.append((Cylinder((0.014, 0.03)), DARK, pose(x, y, 0.81)))
        parts.append((Cylinder((0.08, 0.004)), COLOURS[0], pose(x, y, 0.83)))
    random = np.random.RandomState(3)
    for index in range(things):
        x, y, yaw = random.uniform((1.2, -3.2, 0.0), (4.5, 3.2, 3.0))
        width, height = random.uniform((0.3, 0.4), (0.7, 1.3)) * min(1.0, np.sqrt(10.0 / things))
        shape = Box((width, width, height)) if index % 2 else Cylinder((width / 2, height))
        parts.append((shape, COLOURS[index % 4], pose(x, y, height / 2, yaw)))
    if triangles:
        parts.append((Mesh(_ball(folder, triangles)), COLOURS[1], pose(3, 0, 0.8)))
    visuals = [Visual((index, 0), shape, rgba, floor=index == 0) for index, (shape, rgba, _) in enumerate(parts)]
    return visuals, np.array([matrix for _, _, matrix in parts])


def _floor(folder: Path) -> str:
    tile = np.full((256, 256, 3), 170, np.uint8)
    tile[:128, :128] = tile[128:, 128:] = 150
    noise = np.random.RandomState(0).normal(0.0, 8.0, tile.shape[:2])
    cv2.imwrite(str(folder / "tile.png"), np.clip(tile + noise[:, :, None], 0, 255).astype(np.uint8))
    (folder / "floor.mtl").write_text("newmtl tile\nKd 1 1 1\nmap_Kd tile.png\n")
    corners = "v -5 -5 0\nv 5 -5 0\nv 5 5 0\nv -5 5 0\nvt 0 0\nvt 10 0\nvt 10 10\nvt 0 10\n"
    (folder / "floor.obj").write_text(f"mtllib floor.mtl\n{corners}usemtl tile\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")
    return str(folder / "floor.obj")


def _ball(folder: Path, triangles: int) -> str:
    path = folder / f"ball{triangles}.stl"
    around = int(np.sqrt(triangles))
    trimesh.creation.uv_sphere(0.7, count=[max(around // 2, 4), max(around, 8)]).export(str(path))
    return str(path)


class _GivenFiles:
    """Lets PyBullet read meshes as they are, with their materials."""

    def mesh(self, path: str, hull: bool = False) -> str:
        """Return the mesh file itself."""
        return path


def populate(client: int, scene: Drawn) -> None:
    """The same things as PyBullet bodies that only look."""
    for visual, matrix in zip(*scene):
        assert isinstance(visual.shape, (Box, Cylinder, Mesh, Sphere)), "what `build` makes"
        told = visual.shape.for_bullet(cast(Files, _GivenFiles()), moves=False)
        kind = getattr(pybullet, told.type)
        shape = pybullet.createVisualShape(kind, rgbaColor=visual.rgba, physicsClientId=client, **told.visual)
        yaw = np.arctan2(matrix[1, 0], matrix[0, 0])
        turn = pybullet.getQuaternionFromEuler((0.0, 0.0, yaw))
        pybullet.createMultiBody(0, -1, shape, matrix[:3, 3].tolist(), turn, physicsClientId=client)


def bullet_draw(client: int, **options: int) -> Callable[[], Any]:
    """Draw our camera's view by PyBullet; the optical frame's y and z point against those of its eye."""
    turned = np.diag([1.0, -1.0, -1.0, 1.0])
    view = (turned @ np.linalg.inv(AHEAD)).T.ravel().tolist()
    projection = (np.diag([1.0, -1.0, 1.0, 1.0]) @ CAMERA.projection() @ turned).T.ravel().tolist()
    size = CAMERA.width, CAMERA.height
    return lambda: pybullet.getCameraImage(*size, view, projection, physicsClientId=client, **options)


def compare(folder: Path, seconds: float = 2.0) -> list[Row]:
    """Ours beside TinyRenderer and PyBullet's EGL plugin."""
    scene = build(folder)
    rows = _ours(scene, build(folder, things=0), seconds)
    bare = {"shadow": 0, "flags": pybullet.ER_NO_SEGMENTATION_MASK}
    for name, plugin in (("TinyRenderer", False), ("EGL plugin", True)):
        client = pybullet.connect(pybullet.DIRECT)
        try:
            if plugin and not _load_plugin(client):
                continue  # not every wheel of PyBullet has it
            populate(client, scene)
            kind = pybullet.ER_BULLET_HARDWARE_OPENGL if plugin else pybullet.ER_TINY_RENDERER
            rows.append(measure(f"PyBullet {name}, default", bullet_draw(client, renderer=kind), seconds))
            name = f"PyBullet {name}, no shadow, no segmentation"
            rows.append(measure(name, bullet_draw(client, renderer=kind, **bare), seconds))
        finally:
            pybullet.disconnect(client)
    return [{**row, "of_ours": row.get("of_ours", row["median_ms"] / rows[0]["median_ms"])} for row in rows]


def _ours(scene: Drawn, floor: Drawn, seconds: float) -> list[Row]:
    """Our renderer's ways to draw: compared are frames of the same round, for a machine is slower now and then."""
    with drawing(scene) as frames, drawing(scene, samples=4) as smooth_frames, drawing(floor) as floor_frames:
        times = in_turn(
            {
                "drone_sim": frames(CAMERA),
                "drone_sim, 4 samples": smooth_frames(CAMERA),
                "drone_sim, nothing but floor": floor_frames(CAMERA, DOWNWARD),
                "drone_sim, through a lens (plumb_bob)": frames(LENS),
                "drone_sim, through a lens (equidistant)": frames(EQUIDISTANT),
                "drone_sim, through a fisheye of 170 degrees": frames(FISHEYE),
                "drone_sim, with depth and instances": frames(CAMERA, outputs=("color", "depth", "instance")),
            },
            seconds,
        )
    medians = {name: np.median(own, axis=1) for name, own in times.items()}
    ratios = {name: float(np.median(own / medians["drone_sim"])) for name, own in medians.items()}
    return [{**_row(name, own), "of_ours": ratios[name]} for name, own in times.items()]


def _load_plugin(client: int) -> bool:
    spec = importlib.util.find_spec("eglRenderer")
    path = spec.origin if spec else None
    return bool(path) and pybullet.loadPlugin(path, "_eglRendererPlugin", physicsClientId=client) >= 0


@contextmanager
def drawing(scene: Drawn, samples: int = 0) -> Iterator[Callable[..., Callable[[], Any]]]:
    """Make a renderer of a scene; give a function that returns, for a camera, what draws one frame of it."""
    renderer = Renderer(samples=samples)
    visuals, poses = scene
    renderer.set_visuals(visuals)
    numbers = np.arange(1, len(visuals) + 1)

    def frames(camera: Intrinsics, view: np.ndarray = AHEAD, outputs: tuple[str, ...] = ()) -> Callable[[], Any]:
        if outputs:
            return lambda: renderer.render_outputs(outputs, camera, view, poses, instances=numbers)
        return lambda: renderer.render(camera, view, poses)

    try:
        yield frames
    finally:
        renderer.close()


def growth(folder: Path, seconds: float = 1.0) -> list[Row]:
    """Our frame time against picture size, number of bodies and number of triangles."""
    usual, rows = build(folder), []

    def add(name: str, scene: Drawn, camera: Intrinsics = CAMERA, **facts: int) -> None:
        with drawing(scene) as frames:
            rows.append(measure(name, frames(camera), seconds, **facts))

    for width, height in ((160, 120), (320, 240), (640, 480), (1280, 720), (1920, 1080)):
        camera = Intrinsics(width, height, CAMERA.horizontal_fov, CAMERA.near, CAMERA.far)
        add("size", usual, camera, width=width, height=height)
    for things in (1, 10, 100, 1000):
        add("bodies", build(folder, things), bodies=things)
    for triangles in (100, 1000, 10000, 100000):
        add("triangles", build(folder, triangles=triangles), triangles=triangles)
    return rows


def main() -> None:
    """Print all of it."""
    with tempfile.TemporaryDirectory() as name:
        for row in compare(Path(name)) + growth(Path(name)):
            facts = " ".join(f"{key}={row[key]}" for key in row if key in ("width", "height", "bodies", "triangles"))
            print(f"{row['median_ms']:9.2f} ms  [{row['p10_ms']:.2f}, {row['p90_ms']:.2f}]  {row['name']} {facts}")


if __name__ == "__main__":
    main()
