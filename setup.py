"""Build script of the Python package, for catkin (catkin_python_setup) and for pip. package.xml has the metadata."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

root = Path(__file__).resolve().parent
package = ElementTree.parse(root / "package.xml")
maintainer = package.find("maintainer")
# What package_path() finds: catkin installs it, too, at the same place.
DATA = ("config", "urdf", "tasks", "docs/tutorial")


def requirements(name):
    lines = (root / name).read_text(encoding="utf-8").splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def data_files():
    files = [root / "package.xml"]
    files += [path for folder in DATA for path in (root / folder).rglob("*") if "__pycache__" not in path.parts]
    names = [path.relative_to(root) for path in files if path.is_file()]
    return [(f"share/drone_sim/{name.parent.as_posix()}", [name.as_posix()]) for name in names]


setup(
    name=package.findtext("name"),
    version=package.findtext("version"),
    description=package.findtext("description"),
    license=package.findtext("license"),
    maintainer=maintainer.text,
    maintainer_email=maintainer.get("email"),
    python_requires=">=3.10",
    install_requires=requirements("requirements.txt"),
    extras_require={
        "all": requirements("requirements-all.txt"),
        "jupyter": ["jupyterlab>=4,<5", "jupyter-server-proxy>=4.4,<5"],
    },
    # CMakeLists.txt has it, too.
    entry_points={"jupyter_serverproxy_servers": ["drone_sim = drone_sim.ros.jupyter:server"]},
    packages=find_packages("src"),
    package_dir={"": "src"},
    package_data={
        "drone_sim.grading.autograder": ["files/*"],
        "drone_sim.grading.outputs.html": ["templates/*", "files/*"],
        "drone_sim.ros": ["jupyter.svg"],
        "drone_sim.ros.cockpit": ["page/*.html", "page/*.css", "page/*.js"],
        "drone_sim.scripting.lua": ["*.lua"],
        "drone_sim.child_scripts": ["*.lua"],
    },
    data_files=data_files(),
    options={"build": {"build_base": "build/pip"}},  # catkin names its own
)
