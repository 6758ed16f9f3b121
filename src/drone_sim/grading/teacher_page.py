"""A page for a course's teachers: `python -m drone_sim.grading.teacher_page FOLDER`, a service of JupyterHub.

It shows the students' drones, with links to their simulators, and what they handed in. It tells all students something,
grades a task with one button, and shows the report. JupyterHub decides who may open the page (scope access:services).
The service runs as a user who can read what was handed in, and writes reports below FOLDER. docs/classroom.md has the
configuration.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import jinja2
from jupyterhub.services.auth import HubOAuthCallbackHandler, HubOAuthenticated
from tornado import web
from tornado.httpclient import AsyncHTTPClient, HTTPRequest

from drone_sim.grading import classroom, tasks
from drone_sim.grading.submissions import handed_in

_TEMPLATE = Path(__file__).parent / "outputs" / "html" / "templates" / "teacher.html.j2"
_PREFIX = os.environ.get("JUPYTERHUB_SERVICE_PREFIX", "/")
_PERIOD = 0.5  # s between two checks that the hub is there
_NICENESS = 10  # the students' flights have priority


class Course:
    """What was handed in below $DRONE_SIM_HAND_IN, and the runs of `grade`."""

    def __init__(self, reports: Path):
        """Write the report of each run into a folder below `reports`."""
        self._handed_in, self.reports = Path(os.environ[handed_in.VARIABLE]), reports
        self._runs: dict[str, tuple[subprocess.Popen[bytes], Path]] = {}

    def tasks(self) -> list[dict[str, Any]]:
        """Return name, times of the hand-ins by student, and state of the last run of each task with a folder."""
        names = [name for name in tasks.names() if (self._handed_in / name).is_dir()]
        return [
            {
                "name": name,
                "times": dict(sorted(handed_in.times_in(self._handed_in / name).items())),
                **self._state(name),
            }
            for name in names
        ]

    def grade(self, task: str) -> None:
        """Begin to grade what was handed in for a task, unless that is being done. Raises ValueError."""
        if task not in [listed["name"] for listed in self.tasks()]:
            raise ValueError(f"{task[:80]!r}: cannot be handed in, so there is nothing to grade")
        if task in self._runs and self._runs[task][0].poll() is None:
            return
        folder = self.reports / task / time.strftime("%Y-%m-%dT%H.%M.%S")
        folder.mkdir(parents=True)
        command = ["nice", "-n", str(_NICENESS), sys.executable, "-m", "drone_sim.grading.grade", task]
        command += [str(self._handed_in / task), "--html", str(folder / "report"), "--marks", str(folder / "marks.csv")]
        with (folder / "log.txt").open("wb") as log:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)
        self._runs[task] = process, folder

    def close(self) -> None:
        for process, _ in self._runs.values():
            process.terminate()

    def _state(self, task: str) -> dict[str, Any]:
        """Return whether the task is being graded, the last line of `grade`, and the folder of report and marks."""
        if task not in self._runs:
            return {"runs": False, "line": "", "folder": ""}
        process, folder = self._runs[task]
        lines = (folder / "log.txt").read_text(encoding="utf-8", errors="replace").split("\n")
        line = next((line for line in reversed(lines) if line.strip()), "")
        has_report = process.poll() is not None and (folder / "report" / "index.html").is_file()
        return {
            "runs": process.poll() is None,
            "line": line,
            "folder": str(folder.relative_to(self.reports)) if has_report else "",
        }


class TeacherPage(HubOAuthenticated, web.RequestHandler):  # type: ignore[misc]
    """The page. A POST with `grade` grades that task, one with `text`, `task` and `scene` shows these to all."""

    @web.authenticated
    async def get(self) -> None:
        course: Course = self.settings["course"]
        template = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(
            _TEMPLATE.read_text(encoding="utf-8")
        )
        headers = {"Authorization": f"token {os.environ['JUPYTERHUB_API_TOKEN']}"}
        request = HTTPRequest(f"{os.environ['JUPYTERHUB_API_URL']}/users", headers=headers)
        users: list[dict[str, Any]] = json.loads((await AsyncHTTPClient().fetch(request)).body)
        students = sorted((user for user in users if not user.get("admin")), key=lambda user: str(user["name"]))
        room = classroom.folder()
        self.finish(
            template.render(
                students=students,
                reports=classroom.reports(room) if room else {},
                tasks=course.tasks(),
                can_tell=room is not None,
                told=classroom.message_to_all(room) if room else None,
                names=tasks.names(),
                form=self.xsrf_form_html(),
                token=self.xsrf_token.decode(),
                prefix=_PREFIX,
            )
        )

    @web.authenticated
    async def post(self) -> None:
        try:
            if self.get_body_argument("grade", ""):
                self.settings["course"].grade(self.get_body_argument("grade"))
            else:
                self._tell(self.get_body_argument("text", ""), self.get_body_argument("task", ""))
        except (OSError, ValueError) as error:
            self.set_status(400)
            self.set_header("Content-Type", "text/plain; charset=utf-8")
            self.finish(str(error))
        else:
            self.redirect(_PREFIX)

    def _tell(self, text: str, task: str) -> None:
        """Raises OSError, and ValueError for a task that does not exist, or a scene that cannot be opened."""
        if task and task not in tasks.names():
            raise ValueError(f"{task[:80]!r}: there is no such task")
        room = classroom.folder()
        if room is None:
            raise ValueError(f"{classroom.VARIABLE} has no folder that the teachers' page can write to")
        scene = self.request.files.get("scene")
        if scene:
            classroom.keep_scene(room, scene[0].filename, scene[0].body)
        classroom.tell_all(room, text, task, scene[0].filename if scene else "")


class Reports(HubOAuthenticated, web.StaticFileHandler):  # type: ignore[misc]
    """Reports and marks. A report shows what students wrote, so it may run only scripts of its own."""

    def set_extra_headers(self, path: str) -> None:
        reports = f"{self.request.protocol}://{self.request.host}{_PREFIX}reports/"
        policy = f"default-src {reports} data: blob:; script-src {reports}; style-src {reports} 'unsafe-inline'"
        self.set_header("Content-Security-Policy", f"{policy}; base-uri 'none'; form-action 'none'")

    @web.authenticated
    async def get(self, path: str, include_body: bool = True) -> None:  # type: ignore[override]
        await super().get(path, include_body)


async def main() -> None:
    """Serve until JupyterHub ends the service, or itself ends: the next one starts a page of its own at this port."""
    hub = os.getppid()
    reports = Path(sys.argv[1])
    reports.mkdir(parents=True, exist_ok=True)
    course = Course(reports)
    application = web.Application(
        [
            (_PREFIX, TeacherPage),
            (f"{_PREFIX}oauth_callback", HubOAuthCallbackHandler),
            (f"{_PREFIX}reports/(.*)", Reports, {"path": str(reports)}),
        ],
        cookie_secret=os.urandom(32),
        course=course,
        xsrf_cookies=True,
    )
    address = urlsplit(os.environ["JUPYTERHUB_SERVICE_URL"])
    application.listen(address.port or 0, address.hostname or "", xheaders=True)
    try:
        while os.getppid() == hub:
            await asyncio.sleep(_PERIOD)
    finally:
        course.close()


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):  # by which JupyterHub ends it
        asyncio.run(main())
