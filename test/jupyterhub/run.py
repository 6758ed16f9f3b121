#!/usr/bin/env python3
"""`./dev.sh jupyterhub`: a real JupyterHub with packaging/jupyterhub/jupyterhub_config.py, and three students.

It needs root. The students are system users in namespaces of this script, with their own /etc and /home, so it leaves
nothing on this machine. Each student opens the simulator, two hand in a script. Then one of them attacks another's:
through the hub, and as a system user. A teacher uses the course's page in Chromium, and grades the scripts. Then hub,
proxy and a simulator are killed. The exit status is 1 if an attack succeeds, if data are lost, or if processes remain
after the end of the hub. It takes one to three minutes. `./dev.sh jupyterhub --load N` measures N students instead;
with `--pictures FOLDER`, the teachers' page is saved as a picture.
"""

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from functools import partial
from pathlib import Path

import requests
from playwright.sync_api import sync_playwright
from websockets.exceptions import InvalidStatus, WebSocketException
from websockets.sync.client import connect

ROOT = Path(__file__).resolve().parents[2]
FOLDER_VARIABLE = "DRONE_SIM_JUPYTERHUB"
NAMESPACES = ["unshare", "--mount", "--net", "--pid", "--fork", "--kill-child", "--mount-proc"]
REAPER = ["sh", "-c", '"$@"; exit $?', "sh"]  # the first process of the namespace, which must reap orphans
HOST = "127.0.0.1:8000"
PATIENCE = 240  # s
WARM_UP, MEASURED = 10, 20  # s, for the measurement of the load
STUDENTS, TEACHER = ("ann", "ben", "cas"), "tea"
SCENE = "wide.yaml"
CLASSROOM = "/srv/drone_sim/classroom"
HANDED_IN = "/srv/drone_sim/handed_in/hover"
SOLUTION = ROOT / "tasks/hover/solution.py"
# The attempts of ATTACK that must succeed if a student attacks herself.
MUST_SUCCEED = {"socket", "home", "environ", "kill", "network", "read-handed-in", "remove-handed-in", "read-report"}
# A script with the attempts of a system user; it prints the names of those that succeed.
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
tries("tell-all", lambda: pathlib.Path(CLASSROOM, "to_all.json").write_text("{}"))
tries("send-scene", lambda: pathlib.Path(CLASSROOM, "scenes", "wide.yaml").write_text("{}"))
tries("replace-room", lambda: os.rename(f"{CLASSROOM}/reports", f"{CLASSROOM}/gone") is None)
tries("list-reports", lambda: os.listdir(f"{CLASSROOM}/reports"))
for name in sys.argv[4].split():
    tries("read-report", lambda: pathlib.Path(CLASSROOM, "reports", name).read_bytes())
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
    parser = argparse.ArgumentParser(prog="./dev.sh jupyterhub")
    parser.add_argument("--load", type=int, metavar="N", help="measure the load of N students")
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="save a picture of the teachers' page there")
    options = parser.parse_args()
    if subprocess.run(["test", "-r", __file__], user="nobody", group="nogroup", extra_groups=[]).returncode:
        return f"jupyterhub: the students cannot read {ROOT}: move it to a folder that all users can open"
    if FOLDER_VARIABLE not in os.environ:
        with tempfile.TemporaryDirectory(dir="/var/tmp") as folder:
            command = [*NAMESPACES, *REAPER, sys.executable, __file__, *sys.argv[1:]]
            return subprocess.run(command, env={**os.environ, FOLDER_VARIABLE: folder}).returncode
    folder = Path(os.environ.pop(FOLDER_VARIABLE))
    folder.chmod(0o755)
    names = [f"student{number}" for number in range(1, options.load + 1)] if options.load else STUDENTS
    make_users(folder, names)
    hub = start_hub(folder)
    if options.load:
        measure_load(names)
        failures = []
    else:
        failures, hub = try_course(hub, folder, options.pictures)
    hub.send_signal(signal.SIGTERM)
    hub.wait(60)
    wait_until(lambda: not any(processes_of(name) for name in (*names, "drone_sim")))
    for failure in failures:
        print(f"jupyterhub: {failure}")
    if not failures and not options.load:
        print("jupyterhub: no student gets at another's simulator, and nothing is left")
    return bool(failures)


def start_hub(folder):
    """Start the hub, and wait until it answers."""
    configuration = str(ROOT / "packaging/jupyterhub/jupyterhub_config.py")
    hub = subprocess.Popen([sys.executable, "-m", "jupyterhub", "-f", configuration], cwd=folder)
    wait_until(lambda: hub.poll() is not None or answers(f"http://{HOST}/hub/login"))
    return hub


def try_course(hub, folder, pictures):
    """Fly, attack, grade and kill; return the failures, and the hub that runs at the end."""
    students = ann, ben, cas = [Student(name) for name in STUDENTS]
    for student in students:
        student.open()
        student.fly(student.name)
        print(f"{student.name} flies")
    teacher = Student(TEACHER)
    ann.hand_in(SOLUTION.read_text())
    ben.hand_in("def sysCall_actuation():\n    pass\n")
    failures = attack_through_hub(ben, ann.name)
    with ann.connect(ann.name) as page:
        Page(page)  # while it is open, the simulator reports
        failures += grade_on_teachers_page(teacher, ann, ben)
        failures += use_page_in_browser(students, pictures)
        failures += attack_as_system_user(ben.name, ann.name)
        failures += forge_and_grade(ben.name, ann.name)
        missed = MUST_SUCCEED - set(attack_as_system_user(ann.name, ann.name))
    failures += [f"not tried: {name}" for name in sorted(missed)]  # a student's attack on herself must succeed
    losses, hub = kill(hub, folder, cas, teacher)
    ann.fly(ann.name)
    if not ann.stops(ann.name):
        failures.append("not tried: the end of the server")
    return failures + losses, hub


def make_users(folder, names):
    shutil.copytree("/etc", folder / "etc", symlinks=True)
    run("mount", "--bind", str(folder / "etc"), "/etc")
    run("mount", "-t", "tmpfs", "-o", "mode=755", "tmpfs", "/home")
    run("mount", "-t", "tmpfs", "-o", "mode=1777", "tmpfs", "/tmp")
    run("ip", "link", "set", "lo", "up")
    for group in ("students", "teachers"):
        run("groupadd", group)
    for name, group in [*((name, "students") for name in names), (TEACHER, "teachers")]:
        run("useradd", "--create-home", "-K", "HOME_MODE=0700", "--groups", group, "--shell", "/bin/bash", name)
    run("mount", "-t", "tmpfs", "-o", "mode=755", "tmpfs", "/srv")
    run("mkdir", "-p", os.path.dirname(HANDED_IN))
    run("install", "-d", "-g", "teachers", "-m", "3773", HANDED_IN)
    run("chpasswd", input="".join(f"{name}:{name}\n" for name in (*names, TEACHER)))
    # As in docs/classroom.md.
    run("useradd", "--system", "--create-home", "--groups", "teachers", "drone_sim")
    run("install", "-d", "-o", "drone_sim", "-g", "teachers", "-m", "2750", "/srv/drone_sim/reports")
    run("install", "-d", "-o", "drone_sim", "-m", "755", CLASSROOM)
    run("install", "-d", "-o", "drone_sim", "-g", "teachers", "-m", "3773", f"{CLASSROOM}/reports")


class Student:
    def __init__(self, name):
        self.name, self.session = name, requests.Session()

    def open(self):
        """Log in, and open the simulator."""
        self.start_server()
        wait_until(lambda: self.sees(self.name))

    def start_server(self):
        """Log in, and wait for the server that the hub starts."""
        self.log_in()
        self.session.get(f"http://{HOST}/hub/spawn/{self.name}")
        address = f"http://{HOST}/user/{self.name}/api"
        wait_until(lambda: self.session.get(address, timeout=PATIENCE).url == address)

    def log_in(self):
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
        """The cookies of all paths, as a header."""
        return "; ".join(f"{one.name}={one.value}" for one in self.session.cookies)

    def stops(self, name):
        """Return whether the hub stops a student's server."""
        headers = {"X-XSRFToken": self.session.cookies.get("_xsrf", path="/hub/")}
        return self.session.delete(f"http://{HOST}/hub/api/users/{name}/server", headers=headers).ok

    def fly(self, name):
        """Wait until a student's simulator reports a flying drone. Raises InvalidStatus if refused."""
        with self.connect(name) as socket:
            while '"flying"' not in str(socket.recv(timeout=PATIENCE)):
                pass

    def hand_in(self, text):
        """Replace the script of the task hover by a text, and hand it in."""
        with self.connect(self.name) as socket:
            version = ask(socket, "open", script="tasks/hover.py")["version"]
            saved = ask(socket, "save", script="tasks/hover.py", text=text, version=version)["script"]
            print(f"{self.name} hands in {saved}:", ask(socket, "hand in", script=saved, lesson="tasks/hover"))

    def reaches(self, name):
        """Return whether the student's simulator can be reached and flies."""
        try:
            with self.connect(name) as socket:
                panel = ask(socket, "panel")["panel"]
        except (OSError, WebSocketException, TimeoutError):
            return False
        return panel.get("status") == "flying"

    def shows(self, *texts):
        """Wait until the cockpit shows all texts of the teacher; return True."""
        with self.connect(self.name) as socket:
            wait_until(lambda: all(text in str(ask(socket, "panel")["panel"].get("to_all")) for text in texts))
        return True

    def opens(self, scene):
        """Return whether the simulation starts in the given scene."""
        with self.connect(self.name) as socket:
            return ask(socket, "scene", scene=scene)["done"]

    def saved_text(self):
        """Save a script, and return its text as the cockpit reads it."""
        with self.connect(self.name) as socket:
            opened = ask(socket, "open", script="tasks/hover.py")
            saved = ask(socket, "save", script="tasks/hover.py", text="# mine\n", version=opened["version"])
            return ask(socket, "open", script=saved.get("script", "mine/hover.py"))["text"]

    def connect(self, name):
        address = f"ws://{HOST}/user/{name}/drone_sim/socket"
        headers = {"Cookie": self.cookies}
        return connect(address, subprotocols=["drone_sim"], origin=f"http://{HOST}", additional_headers=headers)


def ask(socket, question, **arguments):
    """Send a request to the cockpit, and return its answer."""
    socket.send(json.dumps({"id": 1, "ask": question, **arguments}))
    while True:
        message = socket.recv(timeout=PATIENCE)
        answer = json.loads(message) if isinstance(message, str) else {}
        if answer.get("id") == 1:
            return answer


def forge_and_grade(forger, victim):
    """Hand in a script under the name of another student; return the errors in the teacher's grades."""
    forged = f"{HANDED_IN}/{victim}+2099-01-01T00.00.00Z+000000000000.py"
    run("touch", forged, user=forger, group=forger, extra_groups=[])
    report = f"/home/{TEACHER}/grades.json"
    grade = [sys.executable, "-m", "drone_sim.grading.grade", "hover", HANDED_IN, "--seeds", "1", "--json", report]
    as_teacher = {"user": TEACHER, "group": TEACHER, "extra_groups": ["teachers"], "cwd": f"/home/{TEACHER}"}
    subprocess.run(grade, env={**os.environ, "HOME": f"/home/{TEACHER}", "ROS_HOME": f"/home/{TEACHER}"}, **as_teacher)
    passed = {one["name"]: one["passed"] for one in json.loads(Path(report).read_text())["scripts"]}
    return [] if passed == {victim: 1, forger: 0} else [f"passed flights: {passed}"]


def grade_on_teachers_page(teacher, student, other):
    """Grade with the button of the teachers' page; return the failures of the page and of its access control."""
    address = f"http://{HOST}/services/course/"
    failures = ["the teachers' page"] if student.session.get(address).status_code != 403 else []
    teacher.log_in()
    page = teacher.session.get(address)
    failures += [f"not on the teachers' page: {one.name}" for one in (student, other) if one.name not in page.text]
    token = re.search(r'name="_xsrf" value="([^"]+)"', page.text)[1]
    if student.session.post(address, data={"grade": "hover", "_xsrf": token}).status_code != 403:
        failures.append("a student can grade")
    teacher.session.post(address, data={"grade": "hover", "_xsrf": token}).raise_for_status()
    wait_until(lambda: "marks.csv" in teacher.session.get(address).text)
    page = teacher.session.get(address).text
    report, marks = (re.search(rf'href="([^"]+{end})"', page)[1] for end in ("index.html", "marks.csv"))
    print(teacher.session.get(f"http://{HOST}{marks}").text)
    if student.name not in teacher.session.get(f"http://{HOST}{report}").text:
        failures.append("no report")
    if student.session.get(f"http://{HOST}{report}").status_code != 403:
        failures.append("a student can read the report")
    return failures


def use_page_in_browser(students, pictures):
    """Use the teachers' page in Chromium: see the drones, watch one, send a text to all; return the failures."""
    chromium = shutil.which("chromium")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_context(viewport={"width": 1100, "height": 800}).new_page()
        page.goto(f"http://{HOST}/hub/login?next=/services/course/")
        page.fill("input[name=username]", TEACHER)
        page.fill("input[name=password]", TEACHER)
        page.click("input[type=submit]")
        page.get_by_alt_text(f"Camera of {students[0].name}").wait_for(timeout=PATIENCE * 1000)
        page.fill("input[name=text]", "Now everybody hovers.")
        page.select_option("select[name=task]", "hover")
        page.set_input_files("input[name=scene]", {"name": SCENE, "mimeType": "", "buffer": b"floor: {size: 31}"})
        page.click("text=Show")
        page.get_by_text("Shown now").wait_for()
        page.evaluate("document.querySelector('main').dataset.old = true")
        page.locator("main:not([data-old])").wait_for()  # the page refreshes it
        if pictures:
            pictures.mkdir(parents=True, exist_ok=True)
            page.screenshot(path=pictures / "teachers_page.png")
        with page.expect_popup() as opened:
            page.locator("li", has_text=students[0].name).get_by_text("watch").click()
        opened.value.get_by_role("button", name="Authorize").click()  # JupyterHub asks once per student
        opened.value.get_by_text("watching only").wait_for()
        opened.value.locator("#scene canvas").wait_for()
        if pictures:
            opened.value.screenshot(path=pictures / "watching.png")
        browser.close()
    all_shown = [student.shows("Now everybody hovers.", SCENE) for student in students]
    failures = [] if all(all_shown) else ["not all students are told what the teacher tells all"]
    return failures + [f"no scene: {one.name}" for one in students[1:] if not one.opens(f"course/{SCENE}")]


def kill(hub, folder, student, teacher):
    """Kill hub, proxy and simulator with SIGKILL; return the failures, and the new hub."""
    failures = []
    saved = student.saved_text()
    with student.connect(student.name) as page:
        os.kill(hub.pid, signal.SIGKILL)
        hub.wait()
        if not still_flies(page):
            failures.append("the flight ended with the hub")
    hub = start_hub(folder)
    student.fly(student.name)
    for pid in processes_of("root", "configurable-http-proxy"):
        os.kill(pid, signal.SIGKILL)
    wait_until(lambda: student.reaches(student.name))
    killed = set(processes_of(student.name, "drone_sim/simulator"))
    for pid in killed:
        os.kill(pid, signal.SIGKILL)
    wait_until(lambda: set(processes_of(student.name, "drone_sim/simulator")) - killed)
    wait_until(lambda: student.reaches(student.name))
    wait_until(lambda: teacher.session.get(f"http://{HOST}/services/course/").ok)
    if student.saved_text() != saved:
        failures.append("a saved script is lost")
    return failures, hub


def still_flies(page):
    """Return whether pulses of the simulator arrive during the next 10 s."""
    end = time.monotonic() + 10
    pulses = 0
    while time.monotonic() < end:
        message = page.recv(timeout=PATIENCE)
        pulses += isinstance(message, str) and '"pulse"' in message
    return pulses > 5


def attack_through_hub(attacker, victim):
    """Return the pages and actions of another student's server that a student can reach."""
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


def attack_as_system_user(attacker, victim):
    """Return the names of the attempts on another user's processes, files and ports that succeed."""
    pids = " ".join(map(str, processes_of(victim)))
    names = " ".join(name for name in os.listdir(HANDED_IN) if name.startswith(f"{victim}+"))
    attack = f"HANDED_IN, CLASSROOM = {HANDED_IN!r}, {CLASSROOM!r}\n{ATTACK}"
    reports = " ".join(path.name for path in Path(CLASSROOM, "reports").iterdir() if path.owner() == victim)
    command = [sys.executable, "-S", "-c", attack, victim, pids, names, reports]
    attempts = subprocess.run(
        command, user=attacker, group=attacker, extra_groups=[], cwd="/", capture_output=True, text=True
    )
    *succeeded, last = attempts.stdout.split() or [attempts.stderr]
    return succeeded if last == "end" else [*succeeded, last]


def processes_of(name, command=""):
    """Return the ids of a user's processes whose command lines contain `command`."""
    listing = subprocess.run(["ps", "-ww", "-o", "pid=,stat=,args=", "-u", name], capture_output=True, text=True).stdout
    rows = [line.split(maxsplit=2) for line in listing.splitlines()]
    return [int(pid) for pid, state, args in rows if not state.startswith("Z") and command in args]


def measure_load(names):
    """Open a simulator with a page for each student, and print the processor time and memory that they use."""
    pages = []
    for student in map(Student, names):
        began = time.monotonic()
        student.start_server()
        served = time.monotonic()
        wait_until(partial(student.sees, student.name))
        student.fly(student.name)
        flies = time.monotonic() - served
        print(f"{student.name}: server after {served - began:.1f} s, flies {flies:.1f} s later", flush=True)
        pages.append(Page(student.connect(student.name)))
    time.sleep(WARM_UP)
    drawn = [page.pictures for page in pages]
    busy = measure_usage(names)
    rates = [(page.pictures - before) / MEASURED for page, before in zip(pages, drawn)]
    paces = [float(page.pace or 0) for page in pages]
    for page in pages:
        page.socket.close()
    time.sleep(WARM_UP)
    idle = measure_usage(names)
    each = 1 / len(names)
    print(f"{len(names)} students fly with open pages: {busy[0] * each:.2f} cores and {busy[1] * each:.0f} MB each,")
    print(f"at {min(paces):.2f} to {max(paces):.2f} times real time; {min(rates):.0f} to {max(rates):.0f} pictures/s;")
    print(f"with closed pages {idle[0] * each:.3f} cores each")


class Page(threading.Thread):
    """A simulated page, which acknowledges the scene and the pictures of one camera at once."""

    def __init__(self, socket):
        super().__init__(daemon=True)
        self.socket, self.pace, self.pictures = socket, "", 0
        socket.send(json.dumps({"id": 1, "ask": "camera", "topic": "/drone/front", "on": True}))
        socket.send(json.dumps({"id": 2, "ask": "panel"}))
        self.start()

    def run(self):
        try:
            for message in self.socket:
                if isinstance(message, bytes):
                    head = json.loads(message[: message.index(b"\n")])
                    self.pictures += "picture" in head
                    self.socket.send(json.dumps({"shown": head.get("picture", "scene")}))
                else:
                    self.pace = json.loads(message).get("panel", {}).get("pace", self.pace)
        except WebSocketException:  # the socket is closed
            pass


def measure_usage(names):
    """Return the cores that the students' processes use, on average over MEASURED, and their memory (PSS) in MB."""
    before, began = processor_time(names), time.monotonic()
    time.sleep(MEASURED)
    cores = (processor_time(names) - before) / (time.monotonic() - began)
    sizes = (Path(f"/proc/{pid}/smaps_rollup").read_text() for name in names for pid in processes_of(name))
    return cores, sum(int(re.search(r"^Pss:\s+(\d+)", text, re.MULTILINE)[1]) for text in sizes) / 1000


def processor_time(names):
    """Return the processor time of the students' processes, s."""
    total = 0
    for name in names:
        for pid in processes_of(name):
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
            total += int(fields[11]) + int(fields[12])
    return total / os.sysconf("SC_CLK_TCK")


def answers(address):
    try:
        return requests.get(address, timeout=10).ok
    except requests.ConnectionError:
        return False


def wait_until(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            sys.exit("jupyterhub: it took too long")
        time.sleep(0.2)


def run(*command, **options):
    subprocess.run(command, check=True, text=True, **options)


if __name__ == "__main__":
    sys.exit(main())
