"""Access control of the cockpit, tested with a real browser."""

import shutil
import stat
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlsplit

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_page import Panel, open_page, wait_until
from scene_builder import Builder

SOCKET = """path => new Promise(said => {
    const socket = new WebSocket(`ws://${path}`, "drone_sim");
    socket.onopen = () => said("open");
    socket.onerror = () => said("refused");
})"""


@pytest.mark.parametrize("query", ["", "?token=", "?token=wrong"])
def test_an_address_without_the_right_token_is_refused(cockpit, browser, query):
    fresh_context = browser.new_context()
    for path in ("", "mesh/a.glb", "cockpit.js"):
        answer = fresh_context.request.get(f"{cockpit.address.partition('?')[0]}{path}{query}")
        assert answer.status == 403 and "token" in answer.text()
    fresh_context.close()


@pytest.fixture(name="stranger")
def _stranger():
    """Serve a page of another origin on this machine; yield its address."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), _Stranger)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()


class _Stranger(BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(200)
        self.end_headers()

    def log_message(self, *_):
        pass


def test_a_page_of_another_origin_opens_no_socket_despite_the_cookie(cockpit, browser, stranger):
    """Browsers send a host's cookies to all its ports, from pages of all ports."""
    context, host = browser.new_context(), urlsplit(cockpit.address).netloc
    context.request.get(cockpit.address)
    assert [cookie["name"] for cookie in context.cookies()] == [f"drone_sim_{host.rpartition(':')[2]}"]
    page = context.new_page()
    for address, outcome in ((f"http://{host}/cockpit.css", "open"), (stranger, "refused")):
        page.goto(address)
        assert page.evaluate(SOCKET, f"{host}/socket") == outcome, address
    context.close()


def test_the_token_is_in_a_private_file_and_in_no_log(cockpit):
    """All users can read the logs of roslaunch and of the nodes in ~/.ros; rosout has the messages of all nodes."""
    token, home = cockpit.address.partition("?token=")[2], cockpit.scripts.parent
    logs = [file for file in (home / ".ros" / "log").rglob("*") if file.is_file()]
    assert any("the cockpit listens at" in file.read_text() for file in logs)
    assert [file for file in logs if token in file.read_text()] == []
    (token_file,) = (home / ".ros" / "drone_sim").glob("cockpit_*.txt")
    assert token_file.read_text() == f"{cockpit.address}\n" and stat.S_IMODE(token_file.stat().st_mode) == 0o600


@pytest.fixture(name="rebound")
def _rebound(browser):
    """A browser that resolves evil.example to this machine, as after DNS rebinding."""
    rules = "--host-resolver-rules=MAP evil.example 127.0.0.1"
    chromium = browser.browser_type.launch(executable_path=shutil.which("chromium"), args=[rules])
    yield chromium
    chromium.close()


def test_requests_under_a_foreign_host_name_are_refused(cockpit, rebound):
    port = urlsplit(cockpit.address).port
    context = rebound.new_context()
    page = context.new_page()
    page.goto(cockpit.address)  # the browser now has the cookie, for this machine's name
    foreign = f"http://evil.example:{port}"
    for path in ("/", "/mesh/a.glb", "/cockpit.js"):
        answer = page.goto(foreign + path)
        assert answer.status == 403 and "token" in page.inner_text("body")
    host = f"evil.example:{port}"
    assert page.evaluate(SOCKET, f"{host}/socket") == "refused"
    # From the foreign page to this machine's name: the browser would send the cookie if both were the same site.
    assert page.evaluate(SOCKET, f"127.0.0.1:{port}/socket") == "refused"
    context.close()


def test_a_page_of_another_origin_cannot_frame_the_cockpit(cockpit, browser, stranger):
    context = browser.new_context()
    context.request.get(cockpit.address)
    page = context.new_page()
    console_lines = []
    page.on("console", lambda message: console_lines.append(message.text))
    page.goto(stranger)
    cockpit_url = cockpit.address.partition("?")[0]
    page.evaluate('there => { document.body.innerHTML = `<iframe src="${there}"></iframe>` }', cockpit_url)
    wait_until(page, lambda: any("frame" in line and "ancestors" in line for line in console_lines))
    assert not any(frame.url.startswith(cockpit_url) for frame in page.frames)
    context.close()


def test_the_page_cannot_contact_other_origins_or_run_inline_scripts(cockpit, opened, stranger):
    send = "there => fetch(there, { mode: 'no-cors' }).then(() => 'told', () => 'refused')"
    load = """there => new Promise(said => {
        const script = document.createElement("script");
        script.src = there;
        script.onload = () => said("loaded");
        script.onerror = () => said("refused");
        document.head.append(script);
    })"""
    assert opened.evaluate(send, stranger) == opened.evaluate(load, stranger) == "refused"
    assert (
        opened.evaluate(
            "new Promise(said => { const s = document.createElement('script'); "
            "s.textContent = 'window.ran = 1'; document.head.append(s); said(window.ran) })"
        )
        is None
    )
    opened.troubles.clear()


# It is also part of file names, so it has no slash.
MARKUP = "<img src=x onerror=alert(1)>"
WEDGE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
FAILS = f"print({MARKUP!r})\ndef sysCall_init():\n    raise ValueError({MARKUP!r})\n"


def test_markup_in_names_of_scripts_models_objects_and_scenes_is_text(cockpit, browser):
    """Markup must not become an element: the page's policy would block its script, but not its picture."""
    cockpit.start_afresh()
    cockpit.scripts.mkdir(exist_ok=True)
    content = {".py": FAILS, ".lua": f"print('{MARKUP}')", ".obj": WEDGE, ".yaml": "objects: []\n"}
    files = [cockpit.scripts / f"{MARKUP}{ending}" for ending in content]
    for file in files:
        file.write_text(content[file.suffix])
    box = {"name": MARKUP, "shape": "box", "size": [0.2] * 3}
    with open_page(cockpit, browser) as page:
        builder, panel = Builder(page), Panel(page)
        edit = {"edit": [{"do": "add", "objects": [box], "position": [2, 0, 1]}]}
        assert page.evaluate("edit => scene.editing.ask('edit', edit)", edit)["handles"]
        builder.select(MARKUP)
        page.select_option("#script", f"mine/{MARKUP}.py")
        wait_until(page, lambda: "raise ValueError" in page.inner_text("#text .cm-content"))
        page.click("#run")
        wait_until(page, lambda: MARKUP in page.inner_text("#said"))
        for name in ("View", "Cameras", "Plots", "Tune", "Log", "Edit"):
            panel.show(name)
        assert page.evaluate("name => document.body.textContent.split(name).length", MARKUP) > 5
        assert page.locator("img[src=x]").count() == 0
    for file in files:
        file.unlink()
    cockpit.start_afresh()
