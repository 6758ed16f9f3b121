"""`./dev.sh setup` installs what is missing, and goes on where there is no rviz to install."""

import os
import re
import subprocess

import pytest

from drone_sim.files.resources import package_path

PLAN = """0 upgraded, 377 newly installed, 0 to remove and 2 not upgraded.
Need to get 12.3 MB/285 MB of archives.
After this operation, 1189 MB of additional disk space will be used."""
PROGRAMS = {  # Debian's packages, by the ROS packages whose programs docs run
    "dynamic_reconfigure": "python3-dynamic-reconfigure",
    "image_transport": "image-transport-tools",
    "image_view": "ros-image-view",
    "tf2_tools": "tf2-tools",
}
ELSEWHERE = {"demo_teleop", "drone_sim", "my_package", "stereo_image_proc", "tf"}  # docs say what these need
FAKES = {
    "dpkg-query": 'for one in "${@:4}"; do grep -qx "$one" "$FOLDER/installed" && echo "installed $one"; done',
    "apt-cache": 'grep -qx "$2" "$FOLDER/known" && printf "%s:\\n  Candidate: 1.2\\n" "$2" || true',
    "apt-get": 'case "$LC_ALL $*" in *--assume-no*) [ "$LC_ALL" = C ] && echo "$PLAN" ;; *) echo "$1 ${@:6}" ;; esac',
    "sudo": '"$@"',
}


@pytest.fixture(name="installed")
def _installed(tmp_path):
    """Return what tells what is done where some packages are installed, and apt knows some."""
    for name, does in FAKES.items():
        (tmp_path / name).write_text(f"#!/bin/bash\n{does}\n")
        (tmp_path / name).chmod(0o755)
    surroundings = {"PATH": f"{tmp_path}:/usr/bin:/bin", "FOLDER": str(tmp_path), "HOME": os.environ["HOME"]}
    surroundings["PLAN"] = PLAN

    def run(installed, known):
        (tmp_path / "installed").write_text("\n".join(installed))
        (tmp_path / "known").write_text("\n".join(known))
        program = "source ./dev.sh help >/dev/null; install_packages catkin rviz"
        done = subprocess.run(
            ["bash", "-c", program, "./dev.sh"],
            cwd=package_path(),
            env=surroundings,
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert done.returncode == 0, done.stderr
        return done.stderr

    return run


def test_what_is_missing_is_installed(installed):
    said = installed([], ["catkin", "rviz"])
    assert "install catkin rviz\n" in said and "no rviz" not in said


def test_how_much_is_installed_is_what_apt_says(installed):
    said = installed([], ["catkin", "rviz"])
    assert "377 packages, 12.3 MB/285 MB to fetch, 1189 MB on disk" in said
    order = [said.index(one) for one in ("missing packages: catkin rviz", "update", "377 packages", "install catkin")]
    assert order == sorted(order)


def test_without_an_rviz_to_install_setup_goes_on(installed):
    said = installed([], ["catkin"])
    assert "this Debian has no rviz" in said and "./dev.sh run web:=true" in said
    assert said.endswith("install catkin\n")


def test_once_all_else_is_there_nothing_is_done(installed):
    assert installed(["catkin"], ["catkin"]) == ""
    assert installed(["catkin", "rviz"], []) == ""


def test_setup_all_installs_the_programs_that_docs_run():
    root = package_path()
    text = "".join(one.read_text(encoding="utf-8") for one in (root / "README.md", *(root / "docs").glob("*.md")))
    assert set(re.findall(r"rosrun (\w+)", text)) - ELSEWHERE == set(PROGRAMS)
    program = 'source ./dev.sh help >/dev/null; packages; echo "${TESTS[@]}" "${DOCS[@]}"'
    listed = subprocess.check_output(["bash", "-c", program, "./dev.sh"], cwd=root, text=True)
    assert set(PROGRAMS.values()) - set(listed.split()) == set()
