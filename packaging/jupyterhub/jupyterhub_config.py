"""JupyterHub for a course on one machine, each student with an own system user: docs/classroom.md. Run it as root."""

import functools
import os
import pwd
import sys
from pathlib import Path

import jupyterhub.utils

c = get_config()  # noqa: F821 # of JupyterHub

# Who may come in: the system users of these groups, with their passwords (PAM).
c.LocalAuthenticator.allowed_groups = {"students", "teachers"}
c.LocalAuthenticator.admin_groups = {"teachers"}

# The hub's page. Put HTTPS in front of it, or set c.JupyterHub.ssl_key and c.JupyterHub.ssl_cert.
c.JupyterHub.bind_url = "http://:8000"

# Each server runs as its student. With systemd (pip install jupyterhub-systemdspawner) it also has limits.
if Path("/run/systemd/system").exists():
    c.JupyterHub.spawner_class = "systemd"
    c.Spawner.mem_limit = "2G"
    c.Spawner.cpu_limit = 1.0  # cores
c.Spawner.notebook_dir = "~"
# A package that checks international addresses in schemas takes half of a server's start.
server = [
    "import sys",
    "sys.path[:] = filter(None, sys.path)  # without the student's home",
    "sys.modules['rfc3987_syntax'] = None",
    "from jupyterhub.singleuser import main",
    "main()",
]
c.Spawner.cmd = [sys.executable, "-c", "\n".join(server)]
c.Spawner.default_url = "/lab"  # "/drone_sim/" opens the simulator at once
# The hub looks for a new server ever more seldom: a student would wait up to 5 s for one that is there.
jupyterhub.utils.exponential_backoff = functools.partial(jupyterhub.utils.exponential_backoff, max_wait=0.5)
c.Spawner.start_timeout = c.Spawner.http_timeout = 120  # s, for many that start at once

# The simulator finds ROS as the shell does in which the hub was started.
ros = ("CMAKE_PREFIX_PATH", "ROS_DISTRO", "ROS_ETC_DIR", "ROS_PACKAGE_PATH", "ROS_ROOT")
environment = {name: os.environ[name] for name in ros if name in os.environ}
# The course's own tasks. And where students hand in: a task with a folder there has the button *Hand in*.
environment["DRONE_SIM_TASKS"] = "/srv/drone_sim/tasks"
environment["DRONE_SIM_HAND_IN"] = "/srv/drone_sim/handed_in"
environment["DRONE_SIM_CLASSROOM"] = "/srv/drone_sim/classroom"  # what the teachers' page shows, and tells all
# Each simulator draws, and converts its pictures, in one thread of its own: all of them need the cores.
environment["LP_NUM_THREADS"], environment["OPENCV_FOR_THREADS_NUM"] = "0", "1"
environment["DRONE_SIM_NICENESS"] = "10"  # flying simulators give way to those that start, and to the hub
c.Spawner.environment = environment

# The teachers' page, http://THE-MACHINE:8000/services/course/, if there is a system user for it.
if any(user.pw_name == "drone_sim" for user in pwd.getpwall()):
    c.JupyterHub.services = [
        {
            "name": "course",
            "url": "http://127.0.0.1:10108",
            "user": "drone_sim",
            "command": [sys.executable, "-m", "drone_sim.grading.teacher_page", "/srv/drone_sim/reports"],
            "environment": {**environment, "PYTHONPATH": os.environ.get("PYTHONPATH", "")},
            "oauth_no_confirm": True,
        }
    ]
    c.JupyterHub.load_roles = [{"name": "course", "services": ["course"], "scopes": ["list:users", "read:users"]}]

# A server whose pages have been closed for an hour ends, with its simulator. Files stay.
c.Spawner.args = ["--ServerApp.shutdown_no_activity_timeout=3600", "--MappingKernelManager.cull_idle_timeout=3600"]
# Language servers are not looked for, since that starts Node.js: without this line, those that you install are found.
c.Spawner.args += ["--LanguageServerManager.autodetect=False"]
