"""dev.sh with stubs for python, pip, CMake and apt: interrupted and concurrent runs, moved and read-only checkouts."""

import hashlib
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import pytest

from drone_sim.files.resources import package_path

ROOT = package_path()
# Logs its arguments; if they match STOP_AT, it creates the file `reached` and waits for the file `go`.
PYTHON = """#!/bin/bash
echo "$* [user $PIP_USER]" >>"$STUBS/log"
if [ -n "$STOP_AT" ] && [[ "$*" = *"$STOP_AT"* ]]; then
  touch "$STUBS/reached"
  until [ -e "$STUBS/go" ]; do sleep 0.02; done
fi
case "$*" in
  --version) echo Python 3.11.2 ;;
  -c*) echo cp311 ;;
  *--dry-run*) [ -z "$NO_WHEEL" ] && echo "$WHEEL" ;; # whether the index has one
  *"pip wheel"*) touch "$TMPDIR/pybullet-1-cp311-cp311-linux_$(uname -m).whl" ;;
  "-m venv"*) mkdir -p "${@: -1}/bin"; cp "$0" "${@: -1}/bin/python" ;;
  "-m pytest"*) exit "$STATUS" ;;
esac
"""
PACKAGING = ("packaging/venv.sh", "packaging/pybullet.sh", "packaging/slim_pybullet.sh", "packaging/wheel.sh")
CMAKE = """#!/bin/bash
mkdir devel
touch devel/setup.bash
"""


class Machine:
    """A checkout that has only dev.sh and the files that it reads, and a sourced ROS."""

    def __init__(self, folder):
        self.folder = folder
        self.checkout = folder / "checkout"
        (self.checkout / "test/ros").mkdir(parents=True)
        (self.checkout / "test/ros/flight.test").touch()
        (self.checkout / "packaging").mkdir()
        shutil.copytree(ROOT / "cmake", self.checkout / "cmake")
        for name in ("dev.sh", "CMakeLists.txt", "setup.py", "package.xml", *PACKAGING):
            shutil.copy(ROOT / name, self.checkout / name)
        for name in ("requirements.txt", "requirements-all.txt", "requirements-dev.txt"):
            (self.checkout / name).write_text("pybullet==1\n", encoding="utf-8")
        (folder / "ros/share/catkin/cmake").mkdir(parents=True)
        (folder / "ros/share/catkin/cmake/catkinConfig.cmake").touch()
        for name in ("rosbash", *re.findall(r"_depend>([a-z0-9_]+)<", (ROOT / "package.xml").read_text("utf-8"))):
            (folder / "ros/share" / name).mkdir(exist_ok=True)
        self.stub("ros/bin/python3", PYTHON)
        self.stub("bin/cmake", CMAKE)
        self.stub("bin/make", "#!/bin/bash\n")
        self.stub("bin/sleep", "#!/bin/bash\nexec /usr/bin/sleep 0.02\n")
        self.environment = {
            "PATH": f"{folder}/bin:/usr/bin:/bin",
            "HOME": str(folder),
            "STUBS": str(folder),
            "CMAKE_PREFIX_PATH": str(folder / "ros"),
        }

    def stub(self, name, text):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        path.chmod(0o755)

    def start(self, *command, **how):
        """Start `./dev.sh COMMAND...` with additional environment variables, in its own process group."""
        return subprocess.Popen(
            [str(self.checkout / "dev.sh"), *command],
            env=self.environment | how.pop("env", {}),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
            **how,
        )

    def run(self, *command, **how):
        with self.start(*command, **how) as started:
            output, _ = started.communicate(timeout=60)
        return started.returncode, re.sub(r"\x1b\[\d*m", "", output)

    def count_calls(self, argument):
        """Return how often python was called with `argument` among its arguments."""
        return (self.folder / "log").read_text(encoding="utf-8").count(argument)

    def wait_until_reached(self):
        wait_for((self.folder / "reached").exists)


def wait_for(there):
    end = time.monotonic() + 60
    while not there():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.fixture(name="machine")
def _machine():
    # Not tmp_path, since one test runs as another user, who may not read pytest's folders.
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        yield Machine(Path(folder).resolve())


def test_a_repeated_setup_does_not_create_the_environment_again(machine):
    assert machine.run("setup")[0] == 0
    assert machine.count_calls("install -q --find-links") == 1
    for _ in range(2):
        assert machine.run("setup", "--all")[0] == 0
    assert machine.count_calls("-m venv") == 1
    assert machine.count_calls("install -q --find-links") == machine.count_calls("-c requirements.txt") == 3
    assert machine.run("setup", "-all") == (1, "[dev.sh] setup -all: takes --all or nothing\n")


@pytest.mark.parametrize("moment", ["-m venv", "-r requirements.txt", "-r requirements-dev.txt"])
def test_an_interrupted_environment_is_created_again(machine, moment):
    with machine.start("setup", "--all", env={"STOP_AT": moment}) as killed:
        machine.wait_until_reached()
        os.killpg(killed.pid, signal.SIGKILL)
    code, output = machine.run("setup", "--all")
    assert code == 0, output
    assert machine.count_calls("-m venv") == 2
    assert machine.count_calls("-r requirements.txt") >= machine.count_calls("-r requirements-dev.txt") >= 1


def test_setup_ends_with_the_status_of_a_failed_pip(machine):
    """pip runs in parallel with apt; its status must not be lost."""
    fails = 'case "$*" in\n  *"-r requirements.txt") exit 3 ;;'
    machine.stub("ros/bin/python3", PYTHON.replace('case "$*" in', fails, 1))
    code, output = machine.run("setup")
    assert code == 3 and "ready" not in output and not (machine.checkout / "devel").exists()


def test_changed_requirements_are_installed_into_the_same_environment(machine):
    assert machine.run("setup", "--all")[0] == 0
    (machine.checkout / "requirements.txt").write_text("pybullet==2\n", encoding="utf-8")
    assert machine.run("setup", "--all")[0] == 0
    assert (machine.count_calls("-m venv"), machine.count_calls("-r requirements.txt")) == (1, 2)
    assert machine.count_calls("-r requirements-dev.txt") == 1


def test_a_second_setup_waits_for_the_first_and_says_so(machine):
    with machine.start("setup", env={"STOP_AT": "-r requirements.txt"}) as first:
        machine.wait_until_reached()
        with machine.start("setup") as second:
            output = second.stdout.readline() + second.stdout.readline()  # the first line names the ROS that is used
            (machine.folder / "go").touch()
            assert first.communicate(timeout=60) and first.returncode == 0
            assert second.communicate(timeout=60) and second.returncode == 0
    assert f"another dev.sh is at work in {machine.checkout}: waiting for it" in output
    assert machine.count_calls("-m venv") == 1


def test_a_moved_checkout_creates_its_environment_again(machine):
    assert machine.run("setup")[0] == 0
    machine.checkout = machine.checkout.rename(machine.folder / "moved")
    assert machine.run("setup")[0] == 0
    assert machine.count_calls(f"-m venv --system-site-packages {machine.checkout}/.venv") == 1


@pytest.mark.parametrize("name", ["a checkout", "check+out", "check:out", "check#out"])
def test_a_path_with_characters_unsupported_by_ros_is_refused(machine, name):
    machine.checkout = machine.checkout.rename(machine.folder / name)
    code, output = machine.run("setup")
    assert code == 1
    assert str(machine.checkout) in output and output.count("\n") == 1


def test_a_path_with_non_ascii_letters_is_accepted(machine):
    machine.checkout = machine.checkout.rename(machine.folder / "Prüf-stand_2.0")
    assert machine.run("setup")[0] == 0


@pytest.mark.parametrize("command", ["setup", "test", "lint", "deb"])
def test_a_read_only_checkout_is_reported(machine, command):
    for folder in (machine.checkout, machine.checkout / "test"):
        folder.chmod(0o555)
    machine.environment["HOME"] = str(machine.folder / "home")
    (machine.folder / "home").mkdir()
    other = {"user": 65534} if os.geteuid() == 0 else {}  # nobody: root may write everywhere
    (machine.folder / "log").touch()
    (machine.folder / "log").chmod(0o666)
    (machine.folder / "home").chmod(0o777)
    code, output = machine.run(command, **other)
    machine.checkout.chmod(0o755)
    assert code == 1
    assert f"{machine.checkout} is read-only" in output.splitlines()[-1]
    assert machine.count_calls("pip") == 0


def test_pip_never_installs_into_the_users_own_packages(machine):
    assert machine.run("setup", env={"PIP_USER": "1"})[0] == 0
    assert machine.count_calls("[user 0]") > 2 and machine.count_calls("[user 1]") == 0


def test_missing_packages_of_a_sourced_ros_are_named_with_the_install_command(machine):
    (machine.folder / "ros/share/cv_bridge").rmdir()
    for environment, command in (
        ({"ROS_DISTRO": "one"}, "sudo apt install ros-one-cv-bridge"),
        ({"ROS_DISTRO": "noetic", "CONDA_PREFIX": str(machine.folder / "ros")}, "conda install ros-noetic-cv-bridge"),
    ):
        code, output = machine.run("setup", env=environment)
        assert code == 1 and f"'{command}'" in output.splitlines()[-1]
    overlay = machine.folder / "devel"
    (overlay / "share/cv_bridge").mkdir(parents=True)
    prefixes = f"{overlay}:{machine.environment['CMAKE_PREFIX_PATH']}"
    assert machine.run("setup", env={"CMAKE_PREFIX_PATH": prefixes})[0] == 0


def test_a_conda_environment_with_ros_needs_no_cmake_prefix_path(machine):
    prefix = machine.environment.pop("CMAKE_PREFIX_PATH")
    code, output = machine.run("setup", env={"CONDA_PREFIX": prefix})
    assert code == 0 and f"using the ROS in {prefix}" in output


@pytest.mark.parametrize("interrupted", ["python3-tf2 is half configured", ""])
def test_an_interrupted_dpkg_is_reported_with_its_remedy(machine, interrupted):
    del machine.environment["CMAKE_PREFIX_PATH"]
    machine.stub("bin/sudo", '#!/bin/bash\nexec "$@"\n')
    machine.stub("bin/dpkg-query", "#!/bin/bash\nexit 1\n")
    machine.stub("bin/dpkg", f"#!/bin/bash\necho -n '{interrupted}'\n")
    machine.stub("bin/find", "#!/bin/bash\n")  # hides dpkg's journal of the real machine
    machine.stub("bin/apt-get", '#!/bin/bash\n[ "$1" = update ]\n')
    code, output = machine.run("setup")
    assert code == 1
    assert ("'sudo dpkg --configure -a' mends that" in output) == bool(interrupted)
    assert interrupted or "cannot install: python3-venv" in output


@pytest.mark.parametrize("checksum", ["of the wheel", "of another", "none"])
def test_a_pybullet_wheel_is_used_only_if_its_checksum_matches(machine, checksum):
    wheel = machine.checkout / f"wheels/pybullet-1-cp311-cp311-linux_{os.uname().machine}.whl"
    wheel.parent.mkdir()
    wheel.write_text("ours", encoding="utf-8")
    if checksum != "none":
        summed = hashlib.sha256(b"ours" if checksum == "of the wheel" else b"theirs").hexdigest()
        (wheel.parent / "SHA256SUMS").write_text(f"{summed}  {wheel.name}\n", encoding="utf-8")
    code, output = machine.run("setup", env={"NO_WHEEL": "1"})
    assert code == 0, output
    there = machine.folder / ".cache/drone_sim/wheels" / wheel.name
    if checksum == "of the wheel":
        assert f"taking PyBullet from {wheel}, whose checksum" in output
        assert machine.count_calls("pip wheel") == 0 and there.read_text(encoding="utf-8") == "ours"
    else:
        assert f"not taking {wheel}: its checksum is not in {wheel.parent}/SHA256SUMS" in output
        assert machine.count_calls("pip wheel") == 1 and there.read_text(encoding="utf-8") == ""


def test_dev_sh_wheel_repacks_an_existing_wheel(machine):
    wheel = machine.checkout / f"wheels/pybullet-1-cp311-cp311-linux_{os.uname().machine}.whl"
    wheel.parent.mkdir()
    wheel.write_text("ours", encoding="utf-8")
    summed = f"{hashlib.sha256(b'ours').hexdigest()}  {wheel.name}\n"
    (wheel.parent / "SHA256SUMS").write_text(summed, encoding="utf-8")
    code, output = machine.run("wheel", env={"NO_WHEEL": "1"})
    assert code == 0 and summed in output and machine.count_calls("pip wheel") == 0
    log = (machine.folder / "log").read_text(encoding="utf-8")
    assert 0 < log.index("install -q wheel") < log.index("-m wheel unpack") < log.index("-m wheel pack")


def test_a_wheel_of_another_python_in_the_given_folder_is_ignored(machine):
    name = f"pybullet-1-cp312-cp312-linux_{os.uname().machine}.whl"
    (machine.folder / "lab").mkdir()
    (machine.folder / "lab" / name).write_text("ours", encoding="utf-8")
    code, output = machine.run("setup", env={"NO_WHEEL": "1", "DRONE_SIM_WHEELS": f"{machine.folder}/lab"})
    assert code == 0 and name not in output and machine.count_calls("pip wheel") == 1


def test_a_wheel_found_by_pip_is_used_and_named(machine):
    found = "Looking in links: /lab\nProcessing /lab/pybullet-1-cp313-cp313-linux_x86_64.whl (90 MB)"
    code, output = machine.run("setup", env={"WHEEL": found})
    assert code == 0 and machine.count_calls("pip wheel") == 0
    assert "PyBullet from /lab/pybullet-1-cp313-cp313-linux_x86_64.whl," in output


def compile_pybullet(machine, pip):
    """Start packaging/pybullet.sh with a stub for pip: the bash commands `pip`."""
    machine.stub("python", f"#!/bin/bash\ncase $1 in --version) echo Python 3.13.0 ;; *) {pip} ;; esac\n")
    (machine.folder / "wheels").mkdir()
    script = machine.checkout / "packaging/pybullet.sh"
    return subprocess.Popen(
        [script, machine.folder / "python", "pybullet==1", machine.folder / "wheels"],
        env=machine.environment,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def test_the_number_of_compilers_is_limited_by_memory(machine):
    machine.stub("bin/nproc", "#!/bin/bash\necho 100000\n")
    with compile_pybullet(machine, 'cp "$PYTHONPATH/sitecustomize.py" "$STUBS"; touch "$TMPDIR/pybullet.whl"') as one:
        one.communicate(timeout=60)
    assert one.returncode == 0
    jobs = int(re.search(r"threads\((\d+)\)", (machine.folder / "sitecustomize.py").read_text(encoding="utf-8"))[1])
    assert 1 <= jobs <= os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 500e6
    assert sorted(path.name for path in (machine.folder / "wheels").iterdir()) == ["pybullet.log", "pybullet.whl"]


def test_the_compilation_shows_its_progress_and_the_remaining_time(machine):
    date = 'now=$(cat "$STUBS/time"); [ -e "$STUBS/began" ] && touch "$STUBS/go"; touch "$STUBS/began"; echo "$now"'
    machine.stub("bin/date", f"#!/bin/bash\n{date}\n")
    machine.stub("bin/find", '#!/bin/bash\n/usr/bin/find "$@"; exit 1\n')  # as while pip removes a folder
    (machine.folder / "time").write_text("1000", encoding="utf-8")
    compiler = """
    mkdir "$STUBS/objects"; touch "$STUBS/objects/"{1..100}.o; echo 1600 >"$STUBS/time"; mv "$STUBS/objects" "$TMPDIR"
    for ((i = 0; i < 500; i++)); do [ -e "$STUBS/go" ] && break; sleep 0.02; done
    touch "$TMPDIR/pybullet.whl" """
    with compile_pybullet(machine, f"until [ -e $STUBS/began ]; do sleep 0.02; done; {compiler}") as one:
        output = one.communicate(timeout=60)[1]
    assert one.returncode == 0 and "100 of 267 files, about 17 minutes left" in output


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupted_compilation_leaves_no_files_and_no_process(machine, how):
    compiler = 'touch "$TMPDIR/a.o"; echo $$ >"$STUBS/pid"; touch "$STUBS/reached"; while :; do sleep 0.02; done'
    with compile_pybullet(machine, compiler) as interrupted:
        machine.wait_until_reached()
        os.killpg(interrupted.pid, how)
        interrupted.communicate(timeout=60)
    assert [path.name for path in (machine.folder / "wheels").iterdir()] == ["pybullet.log"]
    with pytest.raises(ProcessLookupError):
        os.kill(int((machine.folder / "pid").read_text(encoding="utf-8")), 0)


@pytest.mark.parametrize("status", [0, 1])
def test_the_browser_tests_run_once_and_return_their_status(machine, status):
    (machine.checkout / "requirements-web.txt").write_text("playwright==1\n", encoding="utf-8")
    ended, _ = machine.run("test-web", "-k", "page", env={"STATUS": str(status)})
    assert (ended, machine.count_calls("-m pytest test/web -n 2 --dist worksteal -k page")) == (status, 1)


MAKE = """#!/bin/bash
[[ "$* " == *" test "* ]] || exit 0
echo "$*" >>"$STUBS/made"
mkdir -p build/Testing/Temporary
for name in $FAILED; do echo "1:$name"; done >build/Testing/Temporary/LastTestsFailed.log
[ -z "$FAILED" ]
"""


@pytest.mark.parametrize("failed", ["", "flight.test", "flight.test fleet.test"])
def test_failed_suites_are_named_and_not_run_again(machine, failed):
    machine.stub("bin/make", MAKE)
    ended, output = machine.run("test", env={"FAILED": failed})
    assert ended == bool(failed), output
    assert len((machine.folder / "made").read_text(encoding="utf-8").splitlines()) == 1
    log = machine.checkout / "build/Testing/Temporary/LastTest.log"
    assert (" ".join(output.split()).endswith(f"the output is in {log}: {failed}")) == bool(failed)


def test_ci_runs_every_suite(machine):
    (machine.checkout / ".ci").mkdir()
    shutil.copy(ROOT / ".ci/run", machine.checkout / ".ci/run")
    machine.stub("checkout/dev.sh", '#!/bin/bash\necho "$1"\n')
    ran = subprocess.run([machine.checkout / ".ci/run"], stdout=subprocess.PIPE, text=True, check=True)
    assert ran.stdout.split() == ["lint", "docs", "test", "test-web", "docs-commands", "pythons", "bench"]


# ---- installation of packages


PLAN = """0 upgraded, 377 newly installed, 0 to remove and 2 not upgraded.
Need to get 12.3 MB/285 MB of archives.
After this operation, 1189 MB of additional disk space will be used."""
PROGRAMS = {  # Debian's packages, by the ROS packages whose programs docs run
    "dynamic_reconfigure": "python3-dynamic-reconfigure",
    "image_transport": "image-transport-tools",
    "image_view": "ros-image-view",
    "tf2_tools": "tf2-tools",
}
ELSEWHERE = {"demo_teleop", "drone_sim", "my_package", "stereo_image_proc", "tf"}  # docs say how to install these
FAKES = {
    "dpkg-query": 'for one in "${@:4}"; do grep -qx "$one" "$FOLDER/installed" && echo "installed $one"; done',
    "apt-cache": 'grep -qx "$2" "$FOLDER/known" && printf "%s:\\n  Candidate: 1.2\\n" "$2" || true',
    "apt-get": 'case "$LC_ALL $*" in *--assume-no*) [ "$LC_ALL" = C ] && echo "$PLAN" ;; *) echo "$1 ${@:6}" ;; esac',
    "sudo": '"$@"',
}


@pytest.fixture(name="installed")
def _installed(tmp_path):
    """Return a function that runs install_packages with given installed and available packages; it returns the log."""
    for name, script_text in FAKES.items():
        (tmp_path / name).write_text(f"#!/bin/bash\n{script_text}\n")
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


def test_missing_packages_are_installed(installed):
    output = installed([], ["catkin", "rviz"])
    assert "install catkin rviz\n" in output and "no rviz" not in output


def test_the_size_of_an_installation_is_reported_as_given_by_apt(installed):
    output = installed([], ["catkin", "rviz"])
    assert "377 packages, 12.3 MB/285 MB to fetch, 1189 MB on disk" in output
    order = [output.index(one) for one in ("missing packages: catkin rviz", "update", "377 packages", "install catkin")]
    assert order == sorted(order)


def test_setup_continues_if_rviz_is_not_available(installed):
    output = installed([], ["catkin"])
    assert "this Debian has no rviz" in output and "./dev.sh run web:=true" in output
    assert output.endswith("install catkin\n")


def test_nothing_is_installed_if_at_most_an_unavailable_rviz_is_missing(installed):
    assert installed(["catkin"], ["catkin"]) == ""
    assert installed(["catkin", "rviz"], []) == ""


def test_setup_all_installs_the_programs_that_docs_run():
    root = package_path()
    text = "".join(one.read_text(encoding="utf-8") for one in (root / "README.md", *(root / "docs").glob("*.md")))
    assert set(re.findall(r"rosrun (\w+)", text)) - ELSEWHERE == set(PROGRAMS)
    program = 'source ./dev.sh help >/dev/null; packages; echo "${TESTS[@]}" "${DOCS[@]}"'
    package_list = subprocess.check_output(["bash", "-c", program, "./dev.sh"], cwd=root, text=True)
    assert set(PROGRAMS.values()) - set(package_list.split()) == set()
