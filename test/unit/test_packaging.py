"""Imports are declared in package.xml (rosdep) and requirements*.txt (pip), and all files are installed."""

import ast
import os
import re
import subprocess
import sys
import sysconfig
from pathlib import Path
from xml.etree import ElementTree as Xml

import pytest
import yaml

from drone_sim.command_line import SEPARATE
from drone_sim.files import resources
from drone_sim.files.resources import package_path, python_path
from drone_sim.ros.cockpit.editor.script_store import ScriptStore

ROOT = package_path()
SOURCE = ROOT / "src"
# Modules whose rosdep key or pip name differs from the name of the module.
KEYS = {
    "PIL": "python3-pil",
    "annotated_types": "python3-pydantic-pip",
    "av": "python3-av-pip",
    "cbor2": "python3-cbor2-pip",
    "cv2": "python3-opencv",
    "distributed": "python3-distributed-pip",
    "greenlet": "python3-greenlet-pip",
    "manifold3d": "python3-manifold3d-pip",
    "moderngl": "python3-moderngl-pip",
    "ompl": "python3-ompl-pip",
    "pybullet": "python3-pybullet-pip",
    "pydantic": "python3-pydantic-pip",
    "tkinter": "python3-tk",
    "ruckig": "python3-ruckig-pip",
    "trimesh": "python3-trimesh-pip",
    "websockets": "python3-websockets-pip",
}
# Imported by name or by trimesh, or started by the launch file.
INDIRECT = {"python3-lupa-pip", "python3-pycollada-pip", "rviz"}
# Used if installed: Debian has no package of the first, and JupyterHub itself starts the code for the others.
OPTIONAL = {"vision_msgs", "jupyterhub", "tornado"}


def imported():
    """Return the third-party modules that the package imports."""
    files = [*(ROOT / "src").rglob("*.py"), *(one for one in (ROOT / "scripts").iterdir() if one.is_file())]
    imports = set()
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [one.name for one in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.level == 0 else []
            imports |= {name.partition(".")[0] for name in names}
    child_scripts = {file.stem for file in (SOURCE / "drone_sim/child_scripts").glob("*.py")}  # they import each other
    return imports - set(sys.stdlib_module_names) - child_scripts - {"drone_sim"} | (imports & {"tkinter"})


def test_every_module_has_its_key_in_package_xml():
    declared = {one.text for one in Xml.parse(ROOT / "package.xml").iter("exec_depend")}
    modules = imported() - OPTIONAL
    candidates = {name: {KEYS.get(name, name), f"python3-{name}"} for name in modules}
    assert {name for name, keys in candidates.items() if not keys & declared} == set()
    assert {key for key in declared if not any(key in keys for keys in candidates.values())} == INDIRECT


def test_rosdep_and_pip_take_the_same_versions():
    listed = "".join((ROOT / name).read_text(encoding="utf-8") for name in ("requirements.txt", "requirements-all.txt"))
    required = re.findall(r"^([a-z0-9]+)([^;\n]*)", listed, re.MULTILINE)
    versions = {name: f"{name}{version.strip()}" for name, version in required}
    rosdep = yaml.safe_load((ROOT / "rosdep.yaml").read_text(encoding="utf-8"))
    for key, systems in rosdep.items():
        name = key.removeprefix("python3-").removesuffix("-pip")
        assert {one["pip"]["packages"][0] for one in systems.values()} == {versions[name]}


def test_the_version_is_the_same_everywhere():
    """package.xml, the changelog's newest section and the citation agree; the last two also in the date."""
    changelog = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8")
    newest = re.search(r"^(\d+\.\d+\.\d+) \((\d{4}-\d\d-\d\d)\)\n-+$", changelog, re.MULTILINE).groups()
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert newest == (citation["version"], str(citation["date-released"]))
    assert newest[0] == Xml.parse(ROOT / "package.xml").findtext("version")


@pytest.mark.ros
def test_the_node_imports_neither_slow_modules_nor_packages_left_out_of_setup():
    program = (
        "import sys, drone_sim.ros.node.node\n"
        "from drone_sim.run import parameters, simulation\n"
        "flown = simulation.Simulation(parameters.load())\n"
        "flown.step()\n"
        "flown.drone.cameras['front'].take()\n"
        "print(*sys.modules)\n"
        "flown.close()\n"
    )
    ours = {"PYTHONPATH": python_path(os.environ.get("PYTHONPATH", ""))}
    result = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | ours,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        timeout=100,
    )
    imported_by_then = {name.partition(".")[0] for name in result.stdout.split()}
    assert "pybullet" in imported_by_then
    slow = {"collada", "lxml", "manifold3d", "trimesh", "cbor2", "zmq"}
    assert not imported_by_then & {*slow, *SEPARATE, "tkinter"}
    assert "drone_sim.importing.scene_folder" not in result.stdout.split()


def test_every_file_of_the_package_is_installed():
    """Modules are found automatically; setup.py must name all other files among them."""
    (data,) = (
        ast.literal_eval(one.value)
        for node in ast.walk(ast.parse((ROOT / "setup.py").read_text(encoding="utf-8")))
        for one in getattr(node, "keywords", ())
        if one.arg == "package_data"
    )
    listed_files = {
        path for name, globs in data.items() for one in globs for path in (SOURCE / name.replace(".", "/")).glob(one)
    }
    files = [path for path in (SOURCE / "drone_sim").rglob("*") if path.is_file()]
    other_files = {path for path in files if path.suffix not in (".py", ".pyc")}
    assert other_files and other_files == listed_files


def test_a_pip_installation_flies_without_ros_and_checkout(tmp_path):
    pytest.importorskip("setuptools")
    egg_info, build = ("egg_info", "--egg-base", str(tmp_path)), ("build", "--build-base", str(tmp_path / "build"))
    command = ["setup.py", *egg_info, *build, "install", "--root", str(tmp_path / "root"), "--prefix", "/usr"]
    install = f"import runpy, sys; sys.modules['catkin_pkg'] = None; sys.argv = {command}; runpy.run_path('setup.py')"
    subprocess.run([sys.executable, "-c", install], cwd=ROOT, stdout=subprocess.DEVNULL, check=True, timeout=100)
    (module,) = (tmp_path / "root").rglob("drone_sim/__init__.py")
    program = (
        "import runpy, sys\n"
        "sys.modules.update(dict.fromkeys(('rospy', 'roslib', 'rospkg')))\n"  # so that their import fails
        "import drone_sim\n"
        "from drone_sim.run import parameters, simulation\n"
        "flown = simulation.Simulation(parameters.load({'scene_file': 'package://drone_sim/config/scenes/gates.yaml'}))\n"
        "flown.step()\n"
        "flown.close()\n"
        "print(drone_sim.__file__, flush=True)\n"
        "sys.argv[1:] = ['fly', '--duration', '0.1']\n"
        "runpy.run_module('drone_sim', run_name='__main__')\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(module.parents[1])},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        timeout=100,
    )
    place, summary = result.stdout.splitlines()
    assert place == str(module) and summary.startswith("flew 0.10 s")


def test_an_unknown_command_of_the_module_gives_a_one_line_error():
    command = [sys.executable, "-m", "drone_sim", "flyy"]
    result = subprocess.run(command, env=os.environ | {"PYTHONPATH": python_path()}, capture_output=True, timeout=100)
    assert result.returncode == 1
    assert result.stderr.count(b"\n") == 1 and b"fly, grade, sweep, import_scene" in result.stderr


def test_every_script_that_the_editor_offers_is_installed(tmp_path):
    listed = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    folders = {ROOT / one for names in re.findall(r"install\(DIRECTORY ([\w/ ]+)", listed) for one in names.split()}
    folders.add(SOURCE / "drone_sim")  # by catkin_python_setup
    offered = [book.path for book in ScriptStore(tmp_path).scripts()]
    assert [path for path in offered if not folders & set(path.parents)] == [] != offered


def test_other_processes_find_our_environment_before_the_system():
    """Debian's typing_extensions, which lies beside the installed package, is too old for our pydantic."""
    first, second, others = python_path("/others").split(":")
    assert (first, second, others) == (sysconfig.get_path("purelib"), str(SOURCE), "/others")


def test_the_error_for_a_missing_package_folder_names_the_searched_folder(monkeypatch):
    """The checkout may be directly below /, without a share/ above it."""
    monkeypatch.setattr(resources, "_HERE", Path("/no_drone_sim/src/drone_sim/files/resources.py"))
    with pytest.raises(FileNotFoundError, match="near /no_drone_sim/src/drone_sim/files"):
        package_path()
