"""Flights in processes of their own: what a script does costs its own flight; Dask; results that are kept."""

import contextlib
import itertools
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from drone_sim.grading import grade, sweep
from drone_sim.grading import plan as plans
from drone_sim.grading.jobs import pool, sandbox, settings
from drone_sim.grading.jobs.job import job_of
from drone_sim.grading.jobs.pool import Orders, PoolError
from drone_sim.grading.jobs.process import Warm

SOURCE = Path(__file__).resolve().parents[2] / "src"
SETTINGS = settings.load({"limits": {"seconds": 5.0, "patience": 2.0, "memory": 256}, "batches": {"largest": 1}})
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
IN_A_SANDBOX = {
    "kills": "import os, signal; os.kill(os.getppid(), signal.SIGKILL)",
    "stops": "import os, signal; os.kill(os.getppid(), signal.SIGSTOP)",
    "writes": "open({folder!r} + '/written', 'w')",
    "deletes": "import os; os.unlink({folder!r} + '/hold.yaml')",
    "calls": "import socket; socket.create_connection(('127.0.0.1', {port}), 1)",
}


def no_sandbox():
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
def warm():
    with contextlib.closing(Warm(SETTINGS.limits, sandboxed=not no_sandbox())) as made:
        yield made


@pytest.fixture
def programs(warm, monkeypatch, tmp_path):
    """The programs fly with the warm process that is there, and keep their results in a folder of their own."""

    class Lent:
        def __init__(self, *_):
            self.fly, self.close = warm.fly, lambda: None

    monkeypatch.setattr(pool, "Warm", Lent)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def script(folder, name, body):
    path = folder / f"{name}.py"
    path.write_text(f"def sysCall_init():\n    {body}\n")
    return str(path)


def processes():
    found = set()
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            if b"left-behind" in entry.read_bytes():
                found.add(entry.parent.name)
    return found


# ---- one flight


@pytest.mark.parametrize("name", HOSTILE)
def test_what_a_script_does_costs_its_own_flight(name, warm, plan, folder):
    body, said = HOSTILE[name]
    flight = warm.fly(job_of(plan, script(folder, name, body), 0))
    assert not flight.result.passed
    assert said in flight.result.error and "\n" not in flight.result.error
    assert warm.fly(job_of(plan, "", 0)).result.passed


@pytest.mark.skipif(bool(no_sandbox()), reason=no_sandbox())
@pytest.mark.parametrize("name", IN_A_SANDBOX)
def test_in_the_sandbox_nothing_else_is_in_reach(name, warm, plan, folder):
    import socket

    with socket.create_server(("127.0.0.1", 0)) as server:
        body = IN_A_SANDBOX[name].format(folder=str(folder), port=server.getsockname()[1])
        result = warm.fly(job_of(plan, script(folder, name, body), 0)).result
    assert (result.error is None) == (name in ("kills", "stops"))  # a signal to the first process has no effect
    assert sorted(path.suffix for path in folder.iterdir() if path.stem in ("hold", "written")) == [".yaml"]


def test_a_process_that_a_script_leaves_is_ended(warm, plan, folder):
    waits = "[sys.executable, '-c', 'input()', 'left-behind'], stdin=-1, start_new_session=True"
    body = f"import subprocess, sys; subprocess.Popen({waits})"
    assert warm.fly(job_of(plan, script(folder, "daemon", body), 0)).result.passed
    assert not processes()


def test_a_flight_has_its_time(plan, folder):
    limits = SETTINGS.limits.model_copy(update={"seconds": 2.0, "seconds_per_second": 0.0, "patience": 1.0})
    with contextlib.closing(Warm(limits, sandboxed=False)) as warm:
        job = job_of(plan, script(folder, "sleeps", "import ctypes; ctypes.CDLL(None).sleep(1000)"), 0)
        flight = warm.fly(job)
        assert flight.is_lost and flight.result.error == "the script did not end within 2 s of real time"

        # Without a sandbox a script can end whoever watches it; the next flight is another's.
        killed = warm.fly(job_of(plan, script(folder, "kills", IN_A_SANDBOX["kills"]), 0))
        assert killed.is_lost and killed.result.error == "the script ended the process that watches its flight"
        assert warm.fly(job_of(plan, "", 0)).result.passed
        temporary = warm._folder
        assert os.listdir(temporary) == []
    assert not os.path.exists(temporary)


def test_the_table_is_that_of_fly(warm, plan):
    flight = warm.fly(job_of(plan, "", 0), table=True)
    lines = flight.table.decode().splitlines()
    assert lines[0].startswith("t [s],x [m]") and len(lines) == 1 + 5


# ---- many


def test_the_key_is_of_the_contents(plan, folder):
    (folder / "helper.py").write_text("gain = 1\n")
    path = script(folder, "imports", "import helper")
    key = job_of(plan, path, 0).key
    assert job_of(plan, path, 0).key == key
    assert len({key, job_of(plan, path, 1).key, job_of(plan, path, 0, {"control": {"Kzref": 3}}).key}) == 3
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


def test_a_worker_that_is_killed_loses_no_flight_and_results_are_the_same_everywhere(plan, warm):
    from distributed import Client

    jobs = [job_of(plan, "", seed) for seed in range(8)]
    alone = {job.seed: warm.fly(job).result for job in jobs}
    orders = Orders(SETTINGS.limits, SETTINGS.batches, sandboxed=False)
    with two_workers() as (address, workers):
        with Client(address) as client:
            client.wait_for_workers(2, timeout=60)
        with pool.opened(orders, scheduler=address) as fly:
            flights = []
            for flight in fly(jobs):
                flights.append(flight)
                workers[0].kill()  # each has more than one flight left
    assert len({one.digest for one in alone.values()}) == 8
    assert sorted(one.job.seed for one in flights) == list(range(8))
    assert {one.job.seed: one.result for one in flights} == alone


def test_two_workers_here_and_files_that_are_others(plan, warm):
    jobs = [job_of(plan, "", seed) for seed in range(4)]
    other = [*jobs, type(jobs[0])(jobs[0].plan, "", 9, {}, "another key")]
    with pool.opened(Orders(SETTINGS.limits, SETTINGS.batches, not no_sandbox()), workers=2) as fly:
        flights = list(fly(jobs))
        with pytest.raises(
            PoolError, match=r"worker on .*: .*hold\.yaml, the built-in script, .* not the same as here"
        ):
            list(fly(other))
    assert {one.job: one.result for one in flights} == {job: warm.fly(job).result for job in jobs}


# ---- the programs


def test_a_report_of_good_and_hostile_scripts(programs, folder, tmp_path, capsys):
    scripts = [script(folder, f"good{number}", "pass") for number in range(5)]
    scripts += [script(folder, name, HOSTILE[name][0]) for name in ("aborts", "closes", "forges")]
    arguments = [str(folder / "hold.yaml"), *scripts, "--jobs", "1", "--seeds", "2", "--json", str(tmp_path / "o.json")]
    assert grade.main(arguments) == 1
    said = capsys.readouterr()
    assert said.err.count("2 of 2 flights passed") == 5 and said.err.count("0 of 2 flights passed") == 3
    results = json.loads((tmp_path / "o.json").read_text())["results"]
    assert [(one["script"], one["seed"]) for one in results] == [(one, seed) for one in scripts for seed in (0, 1)]


def test_what_was_flown_is_not_flown_again(programs, folder, tmp_path, capsys, monkeypatch):
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
    file.write_bytes(file.read_bytes() + b'{"key": "half a li')  # as a machine that fails leaves it
    assert grade.main(arguments) == 0
    assert "2 of 3 flights are known" in capsys.readouterr().err
    assert grade.main(arguments) == 0
    assert "3 of 3 flights are known" in capsys.readouterr().err
    assert grade.main([*arguments, "--fresh"]) == 0
    assert "known" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere.yaml"], "nowhere.yaml"),
        (["{plan}", "nowhere.py"], "no such file"),
        (["{plan}", "pillot"], "near names are pilot"),
        (["{plan}", "--gradescope", "/nowhere/results.json"], "no such folder"),
        (["{plan}", "--scheduler", "tcp://127.0.0.1:1", "--fresh"], "no scheduler answers there"),
    ],
)
def test_a_mistake_gets_one_line_and_status_2(programs, folder, capsys, monkeypatch, arguments, said):
    monkeypatch.setattr(pool, "_CONNECTING", 0.2)
    assert grade.main([one.format(plan=folder / "hold.yaml") for one in arguments]) == 2
    error = capsys.readouterr().err
    assert said in error.splitlines()[-1] and error.startswith("grade: ") and "Traceback" not in error


def test_a_sweep_has_a_row_for_every_combination(programs, folder, tmp_path, capsys):
    arguments = [str(folder / "hold.yaml"), "--jobs", "1", "--param", "Kzref=1:3:3", "--param", "weather.wind=[1]"]
    assert sweep.main(arguments) == 2
    assert "weather" in capsys.readouterr().err
    arguments[-1] = "control.Dyaw=0.1,0.2"
    assert sweep.main([*arguments, "--csv", str(tmp_path / "o.csv"), "--plot", str(tmp_path / "o.png")]) == 0
    rows = [line.split(",")[:3] for line in (tmp_path / "o.csv").read_text().splitlines()]
    assert rows[0] == ["control.Kzref", "control.Dyaw", "passed"]
    assert sorted(rows[1:]) == [[f"{k}.0", d, "1"] for k in (1, 2, 3) for d in ("0.1", "0.2")]
    assert (tmp_path / "o.png").read_bytes().startswith(b"\x89PNG")
    capsys.readouterr()
    searched = [*arguments[:-1], "control.Dyaw=0.1:0.5:2", "--optimize", "--evaluations", "10"]
    assert sweep.main(searched) == 0
    first = capsys.readouterr().out
    assert sweep.main([*searched, "--fresh"]) == 0
    assert capsys.readouterr().out == first and len(first.splitlines()) == 11
