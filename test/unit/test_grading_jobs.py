"""Grading in separate processes: isolation of the flights, Dask workers, and stored results."""

import contextlib
import itertools
import json
import os
import resource
import shutil
import socket
import subprocess
import sys
import threading
import time
import zipfile
from pathlib import Path
from unittest import mock

import pytest

from drone_sim.grading import grade, sweep, tasks
from drone_sim.grading import plan as plans
from drone_sim.grading.jobs import files, judge_server, pool, sandbox, settings
from drone_sim.grading.jobs.flyer import Flyer
from drone_sim.grading.jobs.job import Job, contents_of, key_of
from drone_sim.grading.jobs.pool import FlightOptions, PoolError

SOURCE = Path(__file__).resolve().parents[2] / "src"
SETTINGS = settings.load({"limits": {"seconds": 30.0, "patience": 100.0, "memory": 256}, "batches": {"largest": 1}})
LEFT_BEHIND = f"left-behind-{os.getpid()}"  # tests of another checkout may run on this machine
PLAN = """
name: hold
duration: 0.2
spread: {position: [0.2, 0.2, 0.1]}
criteria:
  - {kind: no_contact}
"""
HOSTILE = {
    "aborts": ("import os; os.abort()", "crashed: its process was ended by SIGABRT"),
    "crashes": ("import ctypes; ctypes.string_at(0)", "crashed: its process was ended by SIGSEGV"),
    "closes": ("import os; os.closerange(0, 1000)", "with status 0, before the flight was over"),
    "hangs up": (
        "import os, time; os.close(3); time.sleep(0.5); os._exit(7)",
        "with status 7, before the flight was over",
    ),
    "leaves": ("import os; os._exit(0)", "with status 0, before the flight was over"),
    "exits": ("import sys; sys.exit(0)", "SystemExit"),
    "grows": ("x = [bytearray(2**26) for _ in range(100)]", "MemoryError"),
    "fills": ("import tempfile; open(tempfile.gettempdir() + '/x', 'wb').write(bytes(2**26) * 5)", "Error"),
    "forges": (
        """
    import json, os
    result = {"plan": "hold", "script": "", "seed": 0, "changes": {}, "passed": True, "points": 1, "of": 1,
              "flown": 1.0, "error": None, "outcomes": [], "digest": ""}
    for number in range(100):
        for said in (result, {"result": result, "table": 0, "is_last": False}):
            try:
                os.write(number, json.dumps(said).encode() + b"\\n")
            except OSError:
                pass
    os._exit(0)""",
        "with status 0, before the flight was over",
    ),
}
SANDBOXED = {
    "kills": "import os, signal; os.kill(os.getppid(), signal.SIGKILL)",
    "stops": "import os, signal; os.kill(os.getppid(), signal.SIGSTOP)",
    "writes": "open({folder!r} + '/written', 'w')",
    "deletes": "import os; os.unlink({folder!r} + '/hold.yaml')",
    "calls": "import socket; socket.create_connection(('127.0.0.1', {port}), 1)",
}
# Each expression returns what it could get, if anything; the error of the flight shows it.
SEARCHES = {
    "other submissions": "(HERE / 'other.py').read_text()",
    "the real folder": "os.listdir({folder!r})",
    "what lies beside it": "sorted(set(os.listdir(HERE)) - {{'looks.py', 'gains.csv'}})",
    "a link out of its folder": "(HERE / 'away.csv').read_text()",
    "solutions": "[str(one) for one in Path({tasks!r}).rglob('*') if one.is_file()]",
    "the checkout": "[one for one in ('.git', 'test', 'docs', 'dev.sh') if Path({root!r}, one).exists()]",
    "temporary files": "[one for one in Path('/tmp').rglob('*') if one.is_file() and not shown(str(one))]",
    "what runs": "os.listdir('/run')",
    "homes": "[one for one in ('/root', '/home') if os.path.exists(one) and not needed(one)]",
    "passwords": "Path('/etc/passwd').read_text()",
    "a UNIX socket": "connected({folder!r} + '/socket')",
    "a socket without a file": "connected({abstract!r})",
    "a FIFO": "os.open({folder!r} + '/fifo', os.O_WRONLY | os.O_NONBLOCK)",
    "another's root": "os.listdir('/proc/1/root')",
    "another's files": "[os.readlink(one) for one in Path('/proc/1/fd').iterdir()]",
    "other processes": "[one for one in os.listdir('/proc') if one.isdigit() and int(one) not in (1, os.getpid())]",
    "descriptors": "[one for one in os.listdir('/proc/self/fd') if open_elsewhere(one)]",
}
SEARCH_SCRIPT = """
import os, socket, stat, sys
from pathlib import Path
from unittest import mock

HERE = Path(__file__).parent

def connected(path):
    with socket.socket(socket.AF_UNIX) as one:
        one.connect(path)
        return "connected"

def needed(folder):
    return any(one.startswith(folder) for one in (sys.prefix, sys.base_prefix, {root!r}, {folder!r}))

def shown(file):
    return file.startswith((sys.prefix, {root!r} + "/"))

def open_elsewhere(number):
    if number == "3":
        return False  # the door
    try:
        mode = os.fstat(int(number)).st_mode
    except OSError:
        return False  # that of the listing
    return stat.S_ISSOCK(mode) or stat.S_ISREG(mode) or stat.S_ISDIR(mode)

def sysCall_init():
    gains, found = open(HERE / "gains.csv").read(), []
    for what, look in LOOKS:
        try:
            if given := look():
                found.append((what, given))
        except OSError:
            pass
    if found or gains != "1,2":
        raise RuntimeError(found)
"""


def job_of(plan, path, seed, changes=None):
    changes = changes or {}
    return Job(str(plan.path), path, seed, changes, key_of(contents_of(plan, path), seed, changes))


def sandbox_error():
    try:
        sandbox.command(1)
    except sandbox.NoSandbox as why:
        return str(why)
    return ""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("grading")
    (made / "hold.yaml").write_text(PLAN)
    return made


@pytest.fixture(scope="module")
def plan(folder):
    return plans.read(folder / "hold.yaml")


@pytest.fixture(scope="module")
def server():
    with contextlib.closing(Flyer(SETTINGS.limits, sandboxed=not sandbox_error())) as made:
        yield made


@pytest.fixture
def programs(server, monkeypatch, tmp_path):
    """Let the programs use the fork server of `server`, and keep their results in `tmp_path`."""

    class SharedFlyer:
        def __init__(self, *_):
            self.fly, self.close = server.fly, lambda: None

    monkeypatch.setattr(pool, "Flyer", SharedFlyer)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def script(folder, name, body):
    path = folder / f"{name}.py"
    path.write_text(f"def sysCall_init():\n    {body}\n")
    return str(path)


def processes():
    found = set()
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            if LEFT_BEHIND.encode() in entry.read_bytes():
                found.add(entry.parent.name)
    return found


# ---- one flight


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_script_fails_its_own_flight_and_no_other(name, server, plan, folder):
    body, said = HOSTILE[name]
    flight = server.fly(job_of(plan, script(folder, name, body), 0))
    assert not flight.result.passed
    assert said in flight.result.error and "\n" not in flight.result.error
    assert server.fly(job_of(plan, "", 0)).result.passed


@pytest.mark.skipif(bool(sandbox_error()), reason=sandbox_error())
@pytest.mark.parametrize("name", SANDBOXED)
def test_the_sandbox_blocks_signals_writes_and_network_connections(name, server, plan, folder):
    import socket

    with socket.create_server(("127.0.0.1", 0)) as listener:
        body = SANDBOXED[name].format(folder=str(folder), port=listener.getsockname()[1])
        result = server.fly(job_of(plan, script(folder, name, body), 0)).result
    assert (result.error is None) == (name in ("kills", "stops"))  # a signal to process 1 of the sandbox has no effect
    assert sorted(path.suffix for path in folder.iterdir() if path.stem in ("hold", "written")) == [".yaml"]


@pytest.mark.skipif(bool(sandbox_error()), reason=sandbox_error())
@pytest.mark.parametrize("of", ["plan", "script"])
def test_a_folder_in_pythonpath_that_holds_plan_or_submission_is_refused(server, plan, tmp_path, monkeypatch, of):
    flown = tmp_path / "flies.py"
    flown.write_text("def sysCall_init():\n    pass\n")
    folder = (plan.path if of == "plan" else flown).parent
    monkeypatch.setenv("PYTHONPATH", f"/usr/lib{os.pathsep}{folder}")
    with pytest.raises(sandbox.NoSandbox, match=f"PYTHONPATH has {folder}, so that every script could read") as raised:
        server.fly(job_of(plan, str(flown), 0))
    assert "\n" not in str(raised.value)


@pytest.mark.skipif(bool(sandbox_error()), reason=sandbox_error())
def test_a_sandboxed_script_cannot_access_foreign_files_sockets_or_processes(server, plan, tmp_path, monkeypatch):
    (tmp_path / "other.py").write_text("def sysCall_init():\n    pass\n")
    (tmp_path / "unnamed.csv").write_text("3")
    (tmp_path / "gains.csv").write_text("1,2")
    (tmp_path / "away.csv").symlink_to("/etc/passwd")
    os.mkfifo(tmp_path / "fifo")
    abstract = f"\0{tmp_path}"
    values = {"folder": str(tmp_path), "abstract": abstract, "root": str(SOURCE.parent), "tasks": str(tasks.folder())}
    search_script = tmp_path / "looks.py"
    searches = "".join(f"    ({what!r}, lambda: {search}),\n" for what, search in SEARCHES.items())
    search_script.write_text(f"{SEARCH_SCRIPT}\nLOOKS = [\n{searches}]\n".format(**values))
    with contextlib.ExitStack() as open_here:
        open_here.callback(os.close, os.open(tmp_path / "fifo", os.O_RDONLY | os.O_NONBLOCK))
        monkeypatch.chdir(tmp_path)  # a UNIX socket's whole path may be too long
        for address in ("socket", abstract):
            listener = open_here.enter_context(socket.socket(socket.AF_UNIX))
            listener.bind(address)
            listener.listen()
        result = server.fly(job_of(plan, str(search_script), 0)).result
    assert result.error is None, result.error


def test_a_process_left_by_a_script_is_ended(server, plan, folder):
    waits = f"[sys.executable, '-c', 'input()', {LEFT_BEHIND!r}], stdin=-1, start_new_session=True"
    body = f"import subprocess, sys; subprocess.Popen({waits})"
    assert server.fly(job_of(plan, script(folder, "daemon", body), 0)).result.passed
    assert not processes()


def test_a_script_that_forks_is_graded_once(server, plan, folder):
    alone = server.fly(job_of(plan, script(folder, "alone", "pass"), 0)).result
    forked = server.fly(job_of(plan, script(folder, "forks", "import os; os.fork()"), 0)).result
    assert forked.passed and forked.digest == alone.digest


def test_a_flight_beyond_its_time_limit_is_ended(plan, folder):
    limits = SETTINGS.limits.model_copy(update={"seconds": 1.5, "seconds_per_second": 0.0, "patience": 1.0})
    with contextlib.closing(Flyer(limits, sandboxed=False)) as server:
        job = job_of(plan, script(folder, "sleeps", "import ctypes; ctypes.CDLL(None).sleep(1000)"), 0)
        flight = server.fly(job)
    assert flight.is_lost and flight.result.error == "the script did not end within 1.5 s of real time"


def test_without_a_sandbox_the_next_flight_survives_a_killed_watch_process(plan, folder):
    with contextlib.closing(Flyer(SETTINGS.limits, sandboxed=False)) as server:
        killed = server.fly(job_of(plan, script(folder, "kills", SANDBOXED["kills"]), 0))
        assert killed.is_lost and killed.result.error == "the script ended the process that watches its flight"
        assert server.fly(job_of(plan, "", 0)).result.passed
        temporary = server.folder
        assert os.listdir(temporary) == []
    assert not os.path.exists(temporary)


def test_a_flight_returns_the_table_of_fly(server, plan):
    flight = server.fly(job_of(plan, "", 0), table=True)
    lines = flight.table.decode().splitlines()
    assert lines[0].startswith("t [s],x [m]") and len(lines) == 1 + 5


def test_a_failing_warm_up_flight_logs_a_traceback_and_keeps_the_plan(folder, monkeypatch, caplog):
    def fail(*_):
        raise KeyError("ours")

    monkeypatch.setattr(judge_server, "grade", fail)
    for name in ("permissions", "gc"):
        monkeypatch.setattr(judge_server, name, mock.Mock())
    monkeypatch.setattr(judge_server, "connect_ahead", mock.Mock())
    read = judge_server._read_plan(str(folder / "hold.yaml"))
    assert read.value.name == "hold" and "warm-up" in caplog.text and "KeyError: 'ours'" in caplog.text


def test_a_replaced_plan_is_read_again(server, folder, tmp_path):
    path = tmp_path / "changed.yaml"
    for duration, steps in (("0.2", 5), ("0.4", 9)):
        (tmp_path / "new.yaml").write_text(PLAN.replace("0.2\n", f"{duration}\nscene: room{duration}.yaml\n", 1))
        (tmp_path / f"room{duration}.yaml").write_text("objects: []\n")
        os.replace(tmp_path / "new.yaml", path)
        flight = server.fly(job_of(plans.read(path), "", 0), table=True)
        assert flight.result.error is None and len(flight.table.splitlines()) == 1 + steps


# ---- unreadable submissions

ODD = {  # how to create the submission, and a part of the error message
    "a FIFO": (os.mkfifo, "is not a regular file"),
    "a folder": (os.mkdir, "is not a regular file"),
    "a link to nothing": (lambda path: path.symlink_to("nowhere.py"), "nor a link to one"),
    "a link in a circle": (lambda path: path.symlink_to(path.name), "nor a link to one"),
    "a link to a password": (lambda path: path.symlink_to("/etc/shadow"), "a link that leads out of its folder"),
    "a link to a device": (lambda path: path.symlink_to("/dev/zero"), "is not a regular file"),
    "5 GB": (lambda path: path.touch() or os.truncate(path, 5 * 10**9), "larger than 64 MiB"),
    "2 MB": (lambda path: path.write_bytes(b"#" * 2 * 10**6), "larger than 1 MiB"),
    "no UTF-8": (lambda path: path.write_bytes(b"x = '\xff'"), "can't decode byte"),
    "a NUL": (lambda path: path.write_bytes(b"x = '\0'"), "null bytes"),
}
NAMES = ["new\nline.py", "bell\a\33[2J.py", "-rf.py", "--html=.py", os.fsdecode(b"latin\xe9.py"), "\u202eyp.py"]
# Paths that must not be read although a comment in the script names them.
NAMED_PATHS = [
    "/proc/self/mem",
    "/proc/kmsg",
    "../../../../../proc/kmsg",
    "fifo",
    "away/mem",
    "away",
    "/dev/zero",
    "huge.bin",
]


def test_an_unreadable_script_fails_and_the_other_scripts_are_graded(programs, folder, tmp_path, capsys):
    made = {what: tmp_path / f"odd{number}.py" for number, what in enumerate(ODD)}
    for what, path in made.items():
        ODD[what][0](path)
    good = script(tmp_path, "good", "pass")
    report = tmp_path / "o.json"
    scripts = [*map(str, made.values()), good]
    assert grade.main([str(folder / "hold.yaml"), *scripts, "--jobs", "1", "--json", str(report)]) == 1
    capsys.readouterr()
    errors = {one["script"]: one["error"] for one in json.loads(report.read_text())["results"]}
    assert list(errors) == scripts and errors[good] is None
    for what, path in made.items():
        assert ODD[what][1] in errors[str(path)] and str(path) in errors[str(path)] and "\n" not in errors[str(path)]


def test_file_names_in_a_script_do_not_open_devices_links_or_huge_files(server, plan, tmp_path):
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "away").symlink_to("/proc/self")
    (tmp_path / "huge.bin").touch()
    os.truncate(tmp_path / "huge.bin", 5 * 10**9)
    (tmp_path / "helper.py").write_text(f"# {' '.join(NAMED_PATHS)}\nx = 1\n")
    named = Path(script(tmp_path, "named", "import helper"))
    named.write_text(f"# {' '.join(NAMED_PATHS)} helper\n{named.read_text()}")
    assert files.of_script(plan, str(named)) == [named, tmp_path / "helper.py"]
    assert server.fly(job_of(plan, str(named), 0)).result.passed


def test_a_script_gets_the_files_it_names_but_no_other_submission(plan, tmp_path):
    kept = ["helper.py", "gains.csv", "more/__init__.py", "more/deep/one.py", "lib/inner.py"]
    left = ["other.py", "others/my.py", "others/helper.py", "unnamed.py"]
    for name in (*kept, *left):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("" if name not in ("other.py", "others/my.py") else "def sysCall_init(): pass\n")
    own = Path(
        script(tmp_path, "own", "import helper, more.deep, other, others; open('gains.csv'); from lib import inner")
    )
    assert {str(one.relative_to(tmp_path)) for one in files.of_script(plan, str(own))} == {"own.py", *kept}


def test_scripts_with_unusual_names_are_flown_and_reported(programs, folder, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in NAMES:
        Path(name).write_text("def sysCall_init():\n    pass\n")
    outputs = ["--json", "o.json", "--junit", "o.xml", "--html", "report"]
    assert grade.main([*outputs, "--jobs", "1", str(folder / "hold.yaml"), "--", *NAMES]) == 0
    said = capsys.readouterr()
    assert "7 of" not in said.out and f"{len(NAMES)} of {len(NAMES)} scripts passed" in said.out
    assert all(letter.isprintable() or letter in "\n\r" for letter in said.out + said.err)
    assert len(json.loads(Path("o.json").read_text())["results"]) == len(NAMES)


# ---- many flights


def test_the_key_depends_on_file_contents_and_not_on_their_location(plan, folder, tmp_path):
    (folder / "helper.py").write_text("gain = 1\n")
    path = script(folder, "imports", "import helper")
    key = job_of(plan, path, 0).key
    assert job_of(plan, path, 0).key == key
    assert len({key, job_of(plan, path, 1).key, job_of(plan, path, 0, {"control": {"Kzref": 3}}).key}) == 3
    moved = shutil.copytree(folder, tmp_path / "moved")
    assert job_of(plan, str(moved / "imports.py"), 0).key == key
    (folder / "helper.py").write_text("gain = 2\n")
    assert job_of(plan, path, 0).key != key


@contextlib.contextmanager
def two_workers():
    from distributed import LocalCluster

    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(SOURCE), os.environ.get("PYTHONPATH", "")])}
    with LocalCluster(n_workers=0, dashboard_address=None, silence_logs=50) as cluster:
        arguments = ["-m", "dask", "worker", "--no-dashboard", "--no-nanny", "--nthreads", "1"]
        workers = [
            subprocess.Popen(
                [sys.executable, *arguments, cluster.scheduler_address], env=environment, stderr=subprocess.DEVNULL
            )
            for _ in range(2)
        ]
        try:
            yield cluster.scheduler_address, workers
        finally:
            for one in workers:
                one.terminate()
                one.wait(60)


def test_a_killed_worker_loses_no_flight_and_results_are_equal_everywhere(plan, server):
    from distributed import Client

    jobs = [job_of(plan, "", seed) for seed in range(8)]
    alone = {job.seed: server.fly(job).result for job in jobs}
    options = FlightOptions(SETTINGS.limits, SETTINGS.batches, sandboxed=False)
    with two_workers() as (address, workers):
        with Client(address) as client:
            client.wait_for_workers(2, timeout=60)
        with pool.open_pool(options, scheduler=address) as fly:
            flights = []
            for flight in fly(jobs):
                flights.append(flight)
                workers[0].kill()  # each worker has more than one flight left
    assert len({one.digest for one in alone.values()}) == 8
    assert sorted(one.job.seed for one in flights) == list(range(8))
    assert {one.job.seed: one.result for one in flights} == alone


def test_two_local_workers_agree_and_refuse_files_that_differ(plan, server):
    jobs = [job_of(plan, "", seed) for seed in range(4)]
    other = [*jobs, type(jobs[0])(jobs[0].plan, "", 9, {}, "another key")]
    with pool.open_pool(FlightOptions(SETTINGS.limits, SETTINGS.batches, not sandbox_error()), workers=2) as fly:
        flights = list(fly(jobs))
        with pytest.raises(
            PoolError, match=r"worker on .*: .*hold\.yaml, the built-in script, .* not the same as here"
        ):
            list(fly(other))
    assert {one.job: one.result for one in flights} == {job: server.fly(job).result for job in jobs}


def test_a_lost_scheduler_raises_a_one_line_error(plan):
    import dask
    from distributed import Client, LocalCluster

    job, options = job_of(plan, "", 0), FlightOptions(SETTINGS.limits, SETTINGS.batches, sandboxed=False)

    def close_once_it_waits():
        while not client.futures:
            time.sleep(0.05)
        cluster.close()

    with (
        dask.config.set({"distributed.comm.timeouts.connect": "1s"}),
        LocalCluster(n_workers=0, processes=False, dashboard_address=None, silence_logs=50) as cluster,
        Client(cluster.scheduler_address) as client,
    ):
        closing = threading.Thread(target=close_once_it_waits)
        closing.start()
        with pytest.raises(PoolError, match="the connection to the scheduler is lost"):
            list(pool._fly_with_dask([job], options, client))
        closing.join()


# ---- the programs


def test_good_and_hostile_scripts_are_graded_in_one_run(programs, folder, tmp_path, capsys):
    scripts = [script(folder, f"good{number}", "pass") for number in range(5)]
    scripts += [script(folder, name, HOSTILE[name][0]) for name in ("aborts", "closes", "forges")]
    arguments = [str(folder / "hold.yaml"), *scripts, "--jobs", "1", "--seeds", "2", "--json", str(tmp_path / "o.json")]
    assert grade.main(arguments) == 1
    said = capsys.readouterr()
    assert said.err.count("2 of 2 flights passed") == 5 and said.err.count("0 of 2 flights passed") == 3
    results = json.loads((tmp_path / "o.json").read_text())["results"]
    assert [(one["script"], one["seed"]) for one in results] == [(one, seed) for one in scripts for seed in (0, 1)]


def test_finished_flights_are_not_flown_again(programs, folder, tmp_path, capsys, monkeypatch):
    arguments = [str(folder / "hold.yaml"), "--jobs", "1", "--seeds", "3"]

    whole = grade.Runner.fly

    def interrupted(self, jobs):
        yield from itertools.islice(whole(self, jobs), 2)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(grade.Runner, "fly", interrupted)
        assert grade.main(arguments) == 130
    assert "2 of 3 flights were flown, and are kept" in capsys.readouterr().err
    (file,) = (tmp_path / "drone_sim" / "grading").glob("hold-*.jsonl")
    file.write_bytes(file.read_bytes() + b'{"key": "half a li')  # as after a crash of the machine
    assert grade.main(arguments) == 0
    assert "2 of 3 flights are known" in capsys.readouterr().err
    assert grade.main(arguments) == 0
    assert "3 of 3 flights are known" in capsys.readouterr().err
    assert grade.main([*arguments, "--fresh"]) == 0
    assert "known" not in capsys.readouterr().err


def test_a_class_is_graded_to_the_same_marks_after_a_kill(programs, folder, tmp_path, capsys):
    scripts = {"Good": "pass", "Ends": HOSTILE["leaves"][0], "Pushes": "sim.addForce(0, [0] * 3, [0] * 3)"}
    with zipfile.ZipFile(tmp_path / "class.zip", "w") as file:
        for number, (name, body) in enumerate(scripts.items()):
            file.writestr(f"{name}_{number}_assignsubmission_file_/my.py", f"def sysCall_init():\n    {body}\n")
        file.writestr("None_9_assignsubmission_file_/notes.txt", "")
    arguments = [str(folder / "hold.yaml"), str(tmp_path / "class.zip"), "--jobs", "1", "--seeds", "2"]
    assert grade.main([*arguments, "--results", str(tmp_path / "whole"), "--marks", str(tmp_path / "whole.csv")]) == 1
    killed = tmp_path / "killed"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(SOURCE), os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, "-m", "drone_sim.grading.grade", *arguments, "--results", str(killed)]
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while process.poll() is None and not any(b"key" in one.read_bytes() for one in killed.glob("*.jsonl")):
            time.sleep(0.01)
        process.kill()
    capsys.readouterr()
    outputs = ["--results", str(killed), "--marks", str(tmp_path / "again.csv"), "--json", str(tmp_path / "o.json")]
    assert grade.main([*arguments, *outputs]) == 1
    assert " flights are known" in capsys.readouterr().err
    marks = (tmp_path / "again.csv").read_text()
    assert marks == (tmp_path / "whole.csv").read_text()
    assert "Participant 0,Good,,,1,1,-,2 of 2 flights passed\n" in marks
    assert "Participant 9,None,,,0,1,-,not flown: 'None_9_assignsubmission_file_': holds no child script" in marks
    assert "tried to push" in marks
    assert grade.main(["--verify", str(tmp_path / "o.json"), "--jobs", "1"]) == 0
    assert "8 of 8 flights are what the file says" in capsys.readouterr().out


@contextlib.contextmanager
def full_disk():
    """Limit files to 100 bytes, which has the effect of a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_full_disk_is_reported_per_file_and_no_result_is_lost(programs, folder, tmp_path, capsys):
    named = {"--json": "o.json", "--junit": "o.xml", "--gradescope": "results.json", "--html": "report"}
    outputs = {option: str(tmp_path / name) for option, name in named.items()}
    written = [word for pair in outputs.items() for word in pair]
    arguments = [str(folder / "hold.yaml"), "--jobs", "1", "--seeds", "2", "--results", str(tmp_path / "kept")]
    with full_disk():
        assert grade.main([*arguments, *written]) == 2
    said = capsys.readouterr()
    assert "2/2" in said.out and "Traceback" not in said.err
    for name in (*outputs.values(), str(tmp_path / "kept")):
        lines = [line for line in said.err.splitlines() if f" {name}" in line]
        assert len(lines) == 1 and "File too large" in lines[0], (name, said.err)
    assert grade.main([*arguments, *written]) == 0  # appends after the half line that is there
    assert grade.main(arguments) == 0
    assert "2 of 2 flights are known" in capsys.readouterr().err
    assert len(json.loads((tmp_path / "o.json").read_text())["results"]) == 2
    with contextlib.suppress(OSError), open("/dev/full", "w") as full, contextlib.redirect_stdout(full):
        assert grade.main([*arguments, "--json", str(tmp_path / "again.json")]) == 2
    assert "grade: standard output: No space left on device" in capsys.readouterr().err
    assert (tmp_path / "again.json").is_file()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere.yaml"], "nowhere.yaml"),
        (["{plan}", "nowhere.py"], "no such file"),
        (["{plan}", "pillot"], "near names are pilot"),
        (["{plan}", "--gradescope", "/nowhere/results.json"], "no such folder"),
        (["{plan}", "--secret", "nowhere"], "nowhere: No such file or directory"),
        (["{plan}", "--scheduler", "tcp://127.0.0.1:1", "--fresh"], "no scheduler answers there"),
    ],
)
def test_a_wrong_argument_gives_one_line_and_status_2(programs, folder, capsys, monkeypatch, arguments, said):
    monkeypatch.setattr(pool, "_CONNECT_TIMEOUT", 0.2)
    assert grade.main([one.format(plan=folder / "hold.yaml") for one in arguments]) == 2
    error = capsys.readouterr().err
    assert said in error.splitlines()[-1] and error.startswith("grade: ") and "Traceback" not in error


def test_seeds_are_derived_from_the_secret(tmp_path):
    for name, content in (("first", b"a" * 16), ("same", b"a" * 16), ("other", b"b" * 16), ("short", b"a" * 15)):
        (tmp_path / name).write_bytes(content)
    first, same, other = (grade.seeds_of(500, str(tmp_path / name)) for name in ("first", "same", "other"))
    assert first == same
    assert first[:20] == grade.seeds_of(20, str(tmp_path / "first"))
    assert len(set(first) | set(other)) == 1000
    assert min(first) > 1000 and max(first) <= 10**12
    assert grade.seeds_of(3, None) == [0, 1, 2]
    with pytest.raises(ValueError, match=r"--secret .*short': holds 15 bytes; it must hold at least 16"):
        grade.seeds_of(1, str(tmp_path / "short"))


def test_a_sweep_has_a_row_for_every_combination(programs, folder, tmp_path, capsys):
    arguments = [str(folder / "hold.yaml"), "--jobs", "1", "--param", "Kzref=1:3:2", "--param", "weather.wind=[1]"]
    assert sweep.main(arguments) == 2
    assert "weather" in capsys.readouterr().err
    arguments[-1] = "control.Dyaw=0.1,0.2"
    assert sweep.main([*arguments, "--csv", str(tmp_path / "o.csv"), "--plot", str(tmp_path / "o.png")]) == 0
    rows = [line.split(",")[:3] for line in (tmp_path / "o.csv").read_text().splitlines()]
    assert rows[0] == ["control.Kzref", "control.Dyaw", "passed"]
    assert sorted(rows[1:]) == [[f"{k}.0", d, "1"] for k in (1, 3) for d in ("0.1", "0.2")]
    assert (tmp_path / "o.png").read_bytes().startswith(b"\x89PNG")
    capsys.readouterr()
    searched = [*arguments[:-1], "control.Dyaw=0.1:0.5:2", "--optimize", "--evaluations", "10"]
    assert sweep.main(searched) == 0
    first = capsys.readouterr().out
    assert sweep.main([*searched, "--fresh"]) == 0
    assert capsys.readouterr().out == first and len(first.splitlines()) == 11
