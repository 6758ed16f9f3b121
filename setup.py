"""catkin reads this (catkin_python_setup); do not call it yourself."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

PACKAGES = [
    "drone_sim",
    "drone_sim.camera",
    "drone_sim.child_scripts",
    "drone_sim.offline",
    "drone_sim.ros",
    "drone_sim.scripting",
    "drone_sim.world",
]

setup(**generate_distutils_setup(packages=PACKAGES, package_dir={"": "src"}))
