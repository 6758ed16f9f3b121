"""Who the cockpit lets in, asked by a real browser."""

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


def test_a_page_of_another_origin_opens_no_socket_though_it_is_of_the_same_host(cockpit, browser):
    """Browsers send cookies to all ports of a host, from pages of all ports."""
    context, host = browser.new_context(), urlsplit(cockpit.address).netloc
    context.route("**/*", lambda route: route.fulfill(content_type="text/html", body="<p>a page"))
    page = context.new_page()
    context.request.get(cockpit.address)
    assert [cookie["name"] for cookie in context.cookies()] == [f"drone_sim_{host.rpartition(':')[2]}"]
    for origin, outcome in ((host, "open"), (f"{host.rpartition(':')[0]}:9999", "refused")):
        page.goto(f"http://{origin}/")
        for path, protocol in ((f"{host}/wire", "drone_sim"), (f"{host}/scene/", "viser-v1.1.0")):
            assert page.evaluate(SOCKET, [path, protocol]) == outcome, (origin, path)
    context.close()
