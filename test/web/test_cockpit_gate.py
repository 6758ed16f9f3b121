"""Who the cockpit lets in, asked by a real browser."""

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlsplit

import pytest

pytest.importorskip("rospy", reason="needs ROS")

SOCKET = """([path, protocol]) => new Promise(said => {
    const socket = new WebSocket(`ws://${path}`, protocol);
    socket.onopen = () => said("open");
    socket.onerror = () => said("refused");
})"""


@pytest.mark.parametrize("query", ["", "?token=", "?token=wrong"])
def test_an_address_without_the_right_token_is_refused(cockpit, browser, query):
    with_nothing = browser.new_context()
    for path in ("", "scene/", "cockpit.js"):
        answer = with_nothing.request.get(f"{cockpit.address.partition('?')[0]}{path}{query}")
        assert answer.status == 403 and "token" in answer.text()
    with_nothing.close()


@pytest.fixture(name="stranger")
def _stranger():
    """Serve a page of somebody else's on this machine; give its address."""
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


def test_a_page_of_another_origin_opens_no_socket_though_the_browser_has_the_cookie(cockpit, browser, stranger):
    """Browsers send a host's cookies to all its ports, from pages of all ports."""
    context, host = browser.new_context(), urlsplit(cockpit.address).netloc
    context.request.get(cockpit.address)
    assert [cookie["name"] for cookie in context.cookies()] == [f"drone_sim_{host.rpartition(':')[2]}"]
    page = context.new_page()
    for address, outcome in ((f"http://{host}/cockpit.css", "open"), (stranger, "refused")):
        page.goto(address)
        for path, protocol in ((f"{host}/wire", "drone_sim"), (f"{host}/scene/", "viser-v1.1.0")):
            assert page.evaluate(SOCKET, [path, protocol]) == outcome, (address, path)
    context.close()
