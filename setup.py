"""catkin reads this (catkin_python_setup); do not call it yourself."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import find_packages, setup

setup(
    **generate_distutils_setup(
        packages=find_packages("src"),
        package_dir={"": "src"},
        package_data={
            "drone_sim.grading.autograder": ["files/*"],
            "drone_sim.grading.outputs.html": ["templates/*", "files/*"],
            "drone_sim.ros.cockpit": ["page/*.html", "page/*.css", "page/*.js"],
            "drone_sim.scripting.lua": ["*.lua"],
            "drone_sim.child_scripts": ["*.lua"],
        },
    )
)
