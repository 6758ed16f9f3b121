"""The tile in Jupyter: a real server starts the simulator, its page flies and edits, all processes end with it."""

import os
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_page import WAIT, ready, wait_for, wait_until
from launched import free_port
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from drone_sim.ros import jupyter

BASE = "/user/a/"
PAGE = f"{BASE}drone_sim/"
STARTED = f"localStorage['drone_sim{PAGE}started'] = 'true';"  # the start page has been answered
DRONE_X = "() => scene.tree.byName.get('base_link').position.x"


@pytest.fixture(name="server", scope="module")
def _server(tmp_path_factory):
    """A Jupyter server below a prefix, as JupyterHub starts it for each user, with a home of its own."""
    try:
        jupyter.server()
    except OSError as error:
        if "namespace" not in str(error):
            raise
        pytest.skip(f"there is no tile where users may not isolate a process: {error}")
    home, port = tmp_path_factory.mktemp("home"), free_port()
    environment = {key: value for key, value in os.environ.items() if not key.startswith("JUPYTER")}
    extensions = "{'jupyter_server_proxy': True, 'jupyterlab': False, 'jupyter_lsp': False}"
    options = [
        f"--ServerApp.jpserver_extensions={extensions}",
        f"--ServerApp.base_url={BASE}",
        f"--ServerApp.port={port}",
        "--IdentityProvider.token=secret",
    ]
    with (home / "log").open("w") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "jupyter_server", "--no-browser", "--allow-root", *options],
            env={**environment, "HOME": str(home), "ROS_HOME": f"{home}/.ros"},
            cwd=home,
            stdout=log,
            stderr=log,
        )
    jupyter_server = SimpleNamespace(home=home, port=port, process=process, address=f"http://127.0.0.1:{port}")
    try:
        wait_for_condition(lambda: status(f"{jupyter_server.address}{BASE}api") == 200)
        yield jupyter_server
    finally:
        process.kill()
        process.wait()
        print((home / "log").read_text())


def wait_for_condition(condition):
    end = time.monotonic() + WAIT / 1000
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.1)


def status(address, **headers):
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers), timeout=60) as answer:
            return answer.status if answer.url == address else 302  # redirected to the login
    except urllib.error.HTTPError as error:
        return error.code
    except OSError:
        return 0


def opens_socket(server, cookie, origin):
    address = f"ws://127.0.0.1:{server.port}{PAGE}socket"
    try:
        with connect(address, subprotocols=["drone_sim"], origin=origin, additional_headers={"Cookie": cookie}) as one:
            return one.recv(timeout=60) is not None
    except InvalidStatus as refused:
        assert refused.response.status_code == 403
        return False


def processes_of(home):
    """Return the command lines of all processes that have this home, by their folders in /proc."""
    command_lines = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if f"HOME={home}\0".encode() in (folder / "environ").read_bytes():
                command_lines[folder] = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:  # the process has ended
            continue
    return command_lines


def namespace_of(folder):
    """Return the network namespace of a process."""
    return os.readlink(folder / "ns/net")


def test_a_container_for_one_user_needs_no_namespaces(monkeypatch):
    monkeypatch.setenv("DRONE_SIM_SINGLE_USER_CONTAINER", "yes")
    assert jupyter.server()["command"][0] == "sh"


def test_without_such_a_container_the_simulator_gets_namespaces(monkeypatch):
    monkeypatch.setenv("DRONE_SIM_SINGLE_USER_CONTAINER", "")
    try:
        command = jupyter.server()["command"]
    except OSError as error:
        pytest.skip(f"this machine allows no namespaces: {error}")
    assert command[0] == "bwrap"


def test_the_tile_starts_the_simulator_and_the_server_ends_it(server, browser):
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    context.add_init_script(STARTED)
    page = context.new_page()
    page.set_default_timeout(WAIT)
    tiles = context.request.get(f"{server.address}{BASE}server-proxy/servers-info?token=secret").json()
    (tile,) = [one["launcher_entry"] for one in tiles["server_processes"] if one["name"] == "drone_sim"]
    assert tile["enabled"] and tile["title"] == "Drone simulator"
    assert b"<svg" in context.request.get(f"{server.address}{tile['icon_url']}").body()
    requested_urls, troubles = [], []
    page.on("request", lambda request: requested_urls.append(request.url))
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("console", lambda message: message.type == "error" and troubles.append(message.text))
    page.goto(f"{server.address}{BASE}{tile['path_info']}", wait_until="commit")
    ready(page)

    wait_for(page, "scene.tree.byName.has('base_link')")  # the scene's frames arrive separately
    before = page.evaluate(DRONE_X)
    page.locator("#command").click()
    page.keyboard.down("w")
    wait_for(page, f"{DRONE_X[6:]} > {before} + 0.3")
    page.keyboard.up("w")

    page.select_option("#script", "tutorial/2_elevation.py")
    wait_for(page, "document.querySelector('.cm-content').innerText.includes('Stage 2 of')")
    page.locator(".cm-line").first.click()
    page.keyboard.press("Control+Home")
    page.keyboard.type("print('from', 'Jupyter')\n")
    page.click("#run")
    wait_until(page, lambda: "from Jupyter" in page.inner_text("#console"))
    assert (server.home / "drone_scripts/2_elevation.py").read_text().startswith("print('from', 'Jupyter')\n")

    page.locator("#lesson-body img").first.wait_for()
    wait_for(page, "[...document.querySelectorAll('#lesson-body img')].every(one => one.complete && one.naturalWidth)")
    page.locator("#rail").get_by_role("button", name="Edit").click()
    wait_for(page, "document.querySelectorAll('#models img').length > 5")
    wait_for(page, "[...document.querySelectorAll('#models img')].every(one => one.complete && one.naturalWidth)")
    assert page.url == f"{server.address}{PAGE}"
    assert [url for url in requested_urls if not url.startswith((page.url, "data:", "blob:"))] == []
    assert any("/mesh/" in url for url in requested_urls) and troubles == []
    running = processes_of(server.home)
    nodes = [folder for folder, command in running.items() if "__log:=" in command]
    assert len(nodes) > 3 and len(running) > len(nodes)
    assert namespace_of(Path("/proc/self")) not in map(namespace_of, nodes), "only the proxy reaches the nodes"

    for path in (PAGE, f"{PAGE}cockpit.js", f"{PAGE}socket"):
        assert status(f"{server.address}{path}", Cookie=f"drone_sim_{server.port}=secret") in (302, 403)
    cookie = "; ".join(f"{one['name']}={one['value']}" for one in context.cookies())
    assert opens_socket(server, cookie, server.address)
    assert not opens_socket(server, cookie, "http://127.0.0.1:1"), "a page of another origin is refused"
    assert not opens_socket(server, "", server.address), "a browser without a login is refused"
    context.close()

    server.process.send_signal(signal.SIGTERM)
    server.process.wait(60)
    wait_for_condition(lambda: not processes_of(server.home))
