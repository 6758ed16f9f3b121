#!/usr/bin/env python3
"""`./dev.sh jupyterhub`: a real JupyterHub with packaging/jupyterhub/jupyterhub_config.py, and two students.

It needs root. The students are system users of namespaces of this script, with /etc and /home of their own: nothing of
it is left on this machine. Each opens the simulator, and hands in a script. Then one of them tries to get at the
other's: through the hub, and as a system user. A teacher grades what was handed in. Exit status 1 if anything is let
through, or is left after the end of the hub. It takes a minute.
"""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import requests
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

ROOT = Path(__file__).resolve().parents[2]
INSIDE = "DRONE_SIM_JUPYTERHUB"
NAMESPACES = ["unshare", "--mount", "--net", "--pid", "--fork", "--kill-child", "--mount-proc"]
HOST = "127.0.0.1:8000"
PATIENCE = 240  # s
STUDENTS, TEACHER = ("ann", "ben"), "tea"
HANDED_IN = "/srv/drone_sim/handed_in/hover"
SOLUTION = ROOT / "tasks/hover/solution.py"
NEEDED = {"socket", "home", "environ", "kill", "network", "read-handed-in", "remove-handed-in"}  # of what is below
# What a system user tries; it prints the names of what succeeds.
ATTACK = """
import glob, http.client, os, pathlib, signal, socket, subprocess, sys
victim, pids = sys.argv[1], sys.argv[2].split()
def tries(name, act):
    try:
        if act(): print(name, end=" ")
    except (OSError, http.client.HTTPException): pass
def get(port):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", f"/user/{victim}/drone_sim/")
    return connection.getresponse().status == 200
rows = [line.split() for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]]
ports = {int(row[1].rpartition(":")[2], 16) for row in rows if row[3] == "0A"}
assert ports
for port in ports: tries(f"port-{port}", lambda: get(port))
for folder in glob.glob("/tmp/jupyter-server-proxy-*"):
    if pathlib.Path(folder).owner() == victim:
        tries("socket", lambda: socket.socket(socket.AF_UNIX).connect(f"{folder}/socket") is None)
tries("home", lambda: os.listdir(f"/home/{victim}"))
tries("list-handed-in", lambda: os.listdir(HANDED_IN))
for name in sys.argv[3].split():
    tries("read-handed-in", lambda: pathlib.Path(HANDED_IN, name).read_bytes())
    tries("remove-handed-in", lambda: os.rename(f"{HANDED_IN}/{name}", f"{HANDED_IN}/gone") is None)
for pid in pids:
    tries("environ", lambda: pathlib.Path(f"/proc/{pid}/environ").read_bytes())
    tries("root", lambda: os.listdir(f"/proc/{pid}/root/home/{victim}"))
    tries("kill", lambda: os.kill(int(pid), signal.SIGCONT) is None)
    enter = ["nsenter", "--target", pid, "--user", "--net", "--preserve-credentials", "true"]
    tries("network", lambda: not subprocess.run(enter, stderr=subprocess.DEVNULL).returncode)
tries("master", lambda: socket.create_connection(("127.0.0.1", 11311), 5))
print("end")
"""


def main():
    if os.geteuid() != 0:
        return "jupyterhub: only root can be several users"
    if INSIDE not in os.environ:
        with tempfile.TemporaryDirectory(dir="/var/tmp") as folder:
            return subprocess.run(
                [*NAMESPACES, sys.executable, __file__], env={**os.environ, INSIDE: folder}
            ).returncode
    folder = Path(os.environ.pop(INSIDE))
    folder.chmod(0o755)
    make_users(folder)
    hub = subprocess.Popen(
        [sys.executable, "-m", "jupyterhub", "-f", str(ROOT / "packaging/jupyterhub/jupyterhub_config.py")], cwd=folder
    )
    until(lambda: hub.poll() is not None or answers(f"http://{HOST}/hub/login"))
    ann, ben = (Student(name) for name in STUDENTS)
    for student in (ann, ben):
        student.open()
        student.fly(student.name)
        print(f"{student.name} flies")
    ann.hand_in(SOLUTION.read_text())
    ben.hand_in("def sysCall_actuation():\n    pass\n")
    failures = through_the_hub(ben, ann.name) + as_system_user(ben.name, ann.name)
    failures += forge_and_grade(ben.name, ann.name)
    failures += teachers_page(Student(TEACHER), ann, ben)
    missed = NEEDED - set(as_system_user(ann.name, ann.name))
    failures += [f"not tried: {name}" for name in sorted(missed)]  # the attack succeeds for the student herself
    ann.fly(ann.name)
    if not ann.stops(ann.name):
        failures.append("not tried: the end of the server")
    hub.send_signal(signal.SIGTERM)
    hub.wait(60)
    until(lambda: not any(processes_of(name) for name in (*STUDENTS, "drone_sim")))
    for failure in failures:
        print(f"jupyterhub: {failure}")
    print("jupyterhub: " + ("failed" if failures else "neither gets at the other's simulator, and nothing is left"))
    return bool(failures)


def make_users(folder):
    shutil.copytree("/etc", folder / "etc", symlinks=True)
    run("mount", "--bind", str(folder / "etc"), "/etc")
    run("mount", "-t", "tmpfs", "-o", "mode=755", "tmpfs", "/home")
    run("mount", "-t", "tmpfs", "-o", "mode=1777", "tmpfs", "/tmp")
    run("ip", "link", "set", "lo", "up")
    for group in ("students", "teachers"):
        run("groupadd", group)
    for name, group in [*((name, "students") for name in STUDENTS), (TEACHER, "teachers")]:
        run("useradd", "--create-home", "-K", "HOME_MODE=0700", "--groups", group, "--shell", "/bin/bash", name)
    run("mount", "-t", "tmpfs", "-o", "mode=755", "tmpfs", "/srv")
    run("mkdir", "-p", os.path.dirname(HANDED_IN))
    run("install", "-d", "-g", "teachers", "-m", "3773", HANDED_IN)
    run("chpasswd", input="".join(f"{name}:{name}\n" for name in (*STUDENTS, TEACHER)))
    # As in docs/classroom.md.
    run("useradd", "--system", "--create-home", "--groups", "teachers", "drone_sim")
    run("install", "-d", "-o", "drone_sim", "-g", "teachers", "-m", "2750", "/srv/drone_sim/reports")


class Student:
    """A browser of a student."""

    def __init__(self, name):
        self.name, self.session = name, requests.Session()

    def open(self):
        """Log in, and open the simulator."""
        self.log_in()
        self.session.get(f"http://{HOST}/hub/spawn/{self.name}")
        until(lambda: self.sees(self.name))

    def log_in(self):
        """Log in at the hub."""
        login = self.session.get(f"http://{HOST}/hub/login")
        token = re.search(r'name="_xsrf" value="([^"]+)"', login.text)[1]
        form = {"username": self.name, "password": self.name, "_xsrf": token}
        self.session.post(f"http://{HOST}/hub/login", data=form)

    def sees(self, name):
        """Return whether a student's simulator opens."""
        answer = self.session.get(f"http://{HOST}/user/{name}/drone_sim/", timeout=PATIENCE)
        return (
            answer.status_code == 200
            and answer.url.endswith(f"/user/{name}/drone_sim/")
            and "cockpit.js" in answer.text
        )

    @property
    def cookies(self):
        """All cookies, whatever their paths are."""
        return "; ".join(f"{one.name}={one.value}" for one in self.session.cookies)

    def stops(self, name):
        """Return whether the hub stops a student's server."""
        headers = {"X-XSRFToken": self.session.cookies.get("_xsrf", path="/hub/")}
        return self.session.delete(f"http://{HOST}/hub/api/users/{name}/server", headers=headers).ok

    def fly(self, name):
        """Wait until a student's simulator says that its drone flies. Raises InvalidStatus if it is refused."""
        with self.connect(name) as socket:
            until(lambda: '"flying"' in str(socket.recv(timeout=PATIENCE)))

    def hand_in(self, text):
        """Write a text over the script of the task hover, and hand it in."""
        with self.connect(self.name) as socket:
            version = ask(socket, "open", script="tasks/hover.py")["version"]
            saved = ask(socket, "save", script="tasks/hover.py", text=text, version=version)["script"]
            print(f"{self.name} hands in {saved}:", ask(socket, "hand in", script=saved, lesson="tasks/hover"))

    def connect(self, name):
        address = f"ws://{HOST}/user/{name}/drone_sim/socket"
        headers = {"Cookie": self.cookies}
        return connect(address, subprotocols=["drone_sim"], origin=f"http://{HOST}", additional_headers=headers)


def ask(socket, question, **more):
    """Return the cockpit's answer."""
    socket.send(json.dumps({"id": 1, "ask": question, **more}))
    while True:
        message = socket.recv(timeout=PATIENCE)
        answer = json.loads(message) if isinstance(message, str) else {}
        if answer.get("id") == 1:
            return answer


def forge_and_grade(forger, victim):
    """Hand a script in under another's name; return what is wrong with the teacher's grades."""
    forged = f"{HANDED_IN}/{victim}+2099-01-01T00.00.00Z+000000000000.py"
    run("touch", forged, user=forger, group=forger, extra_groups=[])
    report = f"/home/{TEACHER}/grades.json"
    grade = [sys.executable, "-m", "drone_sim.grading.grade", "hover", HANDED_IN, "--seeds", "1", "--json", report]
    as_teacher = {"user": TEACHER, "group": TEACHER, "extra_groups": ["teachers"], "cwd": f"/home/{TEACHER}"}
    subprocess.run(grade, env={**os.environ, "HOME": f"/home/{TEACHER}", "ROS_HOME": f"/home/{TEACHER}"}, **as_teacher)
    passed = {one["name"]: one["passed"] for one in json.loads(Path(report).read_text())["scripts"]}
    return [] if passed == {victim: 1, forger: 0} else [f"passed flights: {passed}"]


def teachers_page(teacher, student, other):
    """Grade by the button of the teachers' page; return what is wrong with it, or with who may open it."""
    address = f"http://{HOST}/services/course/"
    failures = ["the teachers' page"] if student.session.get(address).status_code != 403 else []
    teacher.log_in()
    page = teacher.session.get(address)
    failures += [f"not on the teachers' page: {one.name}" for one in (student, other) if one.name not in page.text]
    token = re.search(r'name="_xsrf" value="([^"]+)"', page.text)[1]
    if student.session.post(address, data={"task": "hover", "_xsrf": token}).status_code != 403:
        failures.append("a student can grade")
    teacher.session.post(address, data={"task": "hover", "_xsrf": token}).raise_for_status()
    until(lambda: "marks.csv" in teacher.session.get(address).text)
    page = teacher.session.get(address).text
    report, marks = (re.search(rf'href="([^"]+{end})"', page)[1] for end in ("index.html", "marks.csv"))
    print(teacher.session.get(f"http://{HOST}{marks}").text)
    if student.name not in teacher.session.get(f"http://{HOST}{report}").text:
        failures.append("no report")
    if student.session.get(f"http://{HOST}{report}").status_code != 403:
        failures.append("a student can read the report")
    return failures


def through_the_hub(attacker, victim):
    """Return what a student gets from another's server."""
    failures = ["the page"] if attacker.sees(victim) else []
    for path in ("drone_sim/", "drone_sim/cockpit.js", "drone_sim/socket", "lab", "api/contents", "proxy/11311/"):
        address, headers = f"http://{HOST}/user/{victim}/{path}", {"Cookie": attacker.cookies}
        if requests.get(address, headers=headers, allow_redirects=False).status_code == 200:
            failures.append(path)
    try:
        attacker.fly(victim)
        failures.append("the socket")
    except InvalidStatus:
        pass
    return failures + (["the end of the server"] if attacker.stops(victim) else [])


def as_system_user(attacker, victim):
    """Return what a system user reaches of another's processes, files and ports."""
    pids = " ".join(map(str, processes_of(victim)))
    names = " ".join(name for name in os.listdir(HANDED_IN) if name.startswith(f"{victim}+"))
    attack = f"HANDED_IN = {HANDED_IN!r}\n{ATTACK}"
    command = [sys.executable, "-S", "-c", attack, victim, pids, names]
    tried = subprocess.run(
        command, user=attacker, group=attacker, extra_groups=[], cwd="/", capture_output=True, text=True
    )
    *succeeded, last = tried.stdout.split() or [tried.stderr]
    return succeeded if last == "end" else [*succeeded, last]


def processes_of(name):
    listed = subprocess.run(["ps", "-o", "pid=,stat=", "-u", name], capture_output=True, text=True).stdout
    rows = [line.split() for line in listed.splitlines()]
    return [int(pid) for pid, state in rows if not state.startswith("Z")]  # nobody reaps them in this namespace


def answers(address):
    try:
        return requests.get(address, timeout=10).ok
    except requests.ConnectionError:
        return False


def until(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            sys.exit("jupyterhub: it took too long")
        time.sleep(0.2)


def run(*command, **options):
    subprocess.run(command, check=True, text=True, **options)


if __name__ == "__main__":
    sys.exit(main())
