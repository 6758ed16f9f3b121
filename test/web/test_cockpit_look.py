"""The page's layout: contrast, button sizes and room for the scene, light and dark, from phones to large screens."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from cockpit_page import Panel, open_page, ready, switch_camera, wait_until

MIN_CONTRAST = 4.5  # minimum ratio of text to its background: WCAG 2.2, level AA
MIN_HEIGHT = 32  # px, minimum height of buttons and fields
# Return the visible elements around the scene whose contrast is too low, and the controls that are not high enough.
FIND_FLAWS = """([contrast, target]) => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 1, height: 1 });
    const ink = canvas.getContext("2d", { willReadFrequently: true });
    const rgba = (colour) => {
        ink.clearRect(0, 0, 1, 1);
        ink.fillStyle = colour;
        ink.fillRect(0, 0, 1, 1);
        const [r, g, b, a] = ink.getImageData(0, 0, 1, 1).data;
        return [r, g, b, a / 255];
    };
    const over = ([r, g, b, a], under) => [r, g, b].map((one, at) => one * a + under[at] * (1 - a));
    const light = (rgb) => {
        const [r, g, b] = rgb.map((one) => (one /= 255) <= 0.03928 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const ground = (element) => {
        if (!element) return rgba(getComputedStyle(document.body).backgroundColor).slice(0, 3);
        return over(rgba(getComputedStyle(element).backgroundColor), ground(element.parentElement));
    };
    const isSeen = (one) => one.checkVisibility({ visibilityProperty: true }) && one.getBoundingClientRect().height;
    const wrong = [];
    const left = "script, #scene *, canvas, option, optgroup";
    for (const one of document.querySelectorAll(`body *:not(${left})`)) {
        if (!isSeen(one) || one.closest(":disabled, svg, .stick")) continue;
        const name = `${one.tagName}#${one.id}.${one.className} ${one.textContent.slice(0, 30)}`;
        const written = [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
        const text = written || one.matches("input, select");
        const behind = ground(one);
        const [a, b] = [light(over(rgba(getComputedStyle(one).color), behind)), light(behind)];
        const found = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
        if (text && found < contrast) wrong.push(`${name}: contrast ${found.toFixed(2)}`);
        if (!one.matches("button, select, input")) continue;
        const target_ = one.matches("[type=checkbox], [type=radio]") ? one.closest("label") ?? one : one;
        const { height } = target_.getBoundingClientRect();
        const isSmall = height < target - 0.5 && !one.closest(".field, #editor");
        if (isSmall) wrong.push(`${name}: ${height} px high`);
    }
    return wrong;
}"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_has_enough_contrast_and_buttons_are_high_enough(cockpit, browser, scheme):
    with open_page(cockpit, browser, color_scheme=scheme, viewport={"width": 1440, "height": 900}) as page:
        panel = Panel(page)
        for name in ("View", "Cameras", "Plots", "Tune", "Log", "Edit"):
            panel.show(name)
            page.locator(f"#{name.lower()}-panel").wait_for()
            assert page.evaluate(FIND_FLAWS, [MIN_CONTRAST, MIN_HEIGHT]) == []
        panel.press("Stop", "stopped")
        panel.press("Step", "failed")
        assert page.evaluate(FIND_FLAWS, [MIN_CONTRAST, MIN_HEIGHT]) == []
        for opens, closes in (("#home", "#start-close"), ("#help-open", "#help-close")):
            page.click(opens)
            assert page.evaluate(FIND_FLAWS, [MIN_CONTRAST, MIN_HEIGHT]) == []
            page.click(closes)
        panel.press("Start", "started")


@pytest.mark.parametrize("width, height, share", [(1440, 900, 0.55), (1280, 720, 0.55), (1920, 1080, 0.55)])
def test_the_scene_has_room_and_nothing_is_cut_off(cockpit, browser, width, height, share):
    with open_page(cockpit, browser, viewport={"width": width, "height": height}) as page:
        scene = page.locator("#scene")
        assert scene.bounding_box()["width"] >= share * width
        assert page.evaluate(
            "[...document.querySelectorAll('#toolbar > *')].every((one) => one.scrollWidth <= one.clientWidth + 1)"
        )
        assert page.evaluate("document.querySelector('#toolbar').scrollWidth") <= width
        page.click("#toggle")
        wait_until(page, lambda: scene.bounding_box()["width"] == width)


def show_script(page):
    if not page.locator("#editor").is_visible():  # on a small screen
        page.locator("#toggle, [data-place=script]").locator("visible=true").click()
    page.locator("#editor").wait_for()


def visible_lines(page):
    """Return how many lines of code the editor shows."""
    return page.evaluate(
        "document.querySelector('#text').clientHeight / document.querySelector('#text .cm-line').offsetHeight"
    )


@pytest.mark.parametrize(
    "width, height, beside_text, alone", [(1440, 900, 15, 30), (820, 1180, 11, 22), (720, 450, 0, 4), (390, 844, 0, 10)]
)
def test_code_has_room_beside_a_lesson_or_is_hidden_by_it(cockpit, browser, width, height, beside_text, alone):
    with open_page(cockpit, browser, viewport={"width": width, "height": height}) as page:
        show_script(page)
        page.select_option("#lesson", "stage-2-elevation")
        page.locator("#lesson-text").get_by_text("In sensing").wait_for()
        assert page.locator("#text").is_visible() == (beside_text > 0)
        if beside_text:
            assert visible_lines(page) >= beside_text
        page.get_by_role("button", name="Code only").click()
        assert visible_lines(page) >= alone
        page.get_by_role("button", name="Text", exact=True).click()
        assert page.locator("#lesson-body").bounding_box()["height"] > 70
        page.click("#tab-variables")
        assert page.evaluate("document.querySelector('#below').offsetHeight / editor.offsetHeight") >= 0.4 - 0.01


def test_a_reload_restores_the_panels_width_and_side(cockpit, browser):
    with open_page(cockpit, browser) as page:
        Panel(page).show("Tune")
        edge = page.locator("#side-edge")
        before = page.locator("#panel").bounding_box()["width"]
        edge.focus()
        edge.press("ArrowLeft")
        wider = page.locator("#panel").bounding_box()["width"]
        assert wider > before
        page.click("#other-side")
        page.reload()
        page.locator("#tune-panel").wait_for()
        assert page.locator("#panel").bounding_box()["width"] == wider
        assert page.locator("#rail").bounding_box()["x"] < 100
        page.locator("#tune-filter").press("Escape")
        assert not page.locator("#panel").is_visible()


@pytest.mark.parametrize("width, height", [(820, 1180), (390, 844)])
def test_on_touch_screens_thumbs_reach_both_sticks_and_the_scene_is_uncovered(cockpit, browser, width, height):
    size = {"width": width, "height": height}
    with open_page(cockpit, browser, viewport=size, has_touch=True, is_mobile=True) as page:
        for stick, edge_x in (("left", 0), ("right", width)):
            box = page.locator(f"#{stick}").bounding_box()
            middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
            assert abs(middle[0] - edge_x) < 110 and height - middle[1] < 200
        top = page.evaluate(
            "([x, y]) => document.elementFromPoint(x, y).closest('#scene') !== null", [width / 2, height / 2]
        )
        assert top, "the middle of the scene is not covered"
        show_script(page)
        assert page.locator("#editor").bounding_box()["width"] == width
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        page.select_option("#script", "tutorial/1_thrust.py")
        wait_until(page, lambda: page.inner_text("#flying") == "built-in/pilot.py flies")
        assert page.locator("#script").bounding_box()["width"] > 200, "the script's name is readable beside the state"
        page.click("#run")
        wait_until(page, lambda: page.inner_text("#flying") == "flies")
        page.locator("#toggle, [data-place=scene]").locator("visible=true").click()
        page.locator("#deaf").wait_for()
        assert "does not listen to commands" in page.inner_text("#deaf") and page.locator("#left").is_visible()
    cockpit.start_afresh()


# Return whether the tabs stay in the toolbar's first row beside the longest state texts.
TABS_STAY = """() => {
    const at = (id) => document.getElementById(id);
    at("why").hidden = false;
    Object.entries({ why: "2 warnings", status: "Script failed", flown: "mine/a_long_name.py" })
        .forEach(([id, words]) => (at(id).textContent = words));
    return at("places").getBoundingClientRect().top < at("home").getBoundingClientRect().bottom;
}"""


def test_on_an_upright_tablet_scene_script_and_edit_are_tabs(cockpit, browser):
    size = {"width": 768, "height": 1024}
    with open_page(cockpit, browser, viewport=size, has_touch=True, is_mobile=True) as page:
        tabs = page.get_by_role("group", name="What is shown")
        parts_of_tabs = {  # the parts that each tab shows; a strip of the scene is always visible
            "Edit": {"#panel", "#shelf", "#build-bar"},
            "Script": {"#editor"},
            "Scene": {"#rail", "#left", "#right"},
        }
        for name, parts in parts_of_tabs.items():
            tabs.get_by_role("button", name=name).tap()
            for part in set.union(*parts_of_tabs.values()):
                assert page.locator(part).is_visible() == (part in parts), f"{name}: {part}"
            assert tabs.locator("[aria-pressed=true]").all_inner_texts() == [name]
            assert page.locator("#scene").bounding_box()["height"] > 150
            assert page.locator("#toolbar").evaluate("one => one.scrollWidth <= one.clientWidth")
        page.locator("#rail").get_by_role("button", name="Plots").tap()
        assert tabs.locator("[aria-pressed=true]").all_inner_texts() == ["Scene"]
        assert not page.locator("#toggle").is_visible()
        assert page.evaluate(TABS_STAY), "a failure message adds no row to the toolbar"
        switch_camera(page)
        tabs.get_by_role("button", name="Edit").tap()
        title, warning = page.locator(".picture header"), page.locator("#until-stop")
        title.wait_for()
        warning.wait_for()
        box = warning.bounding_box()
        assert title.bounding_box()["y"] >= box["y"] + box["height"], "the buttons of the picture are not covered"
        tabs.get_by_role("button", name="Script").tap()
        scene = page.locator("#scene").bounding_box()
        assert title.bounding_box()["y"] <= scene["y"] + 12, "beside a script, pictures begin at the scene's edge"
        title.get_by_role("button").last.tap()
        title.wait_for(state="detached")


def test_in_a_narrow_window_the_edit_panel_hides_the_script(cockpit, browser):
    with open_page(cockpit, browser, viewport={"width": 1024, "height": 768}) as page:
        bar, script = page.locator("#build-bar"), page.locator("#editor")
        edit = page.locator("#rail").get_by_role("button", name="Edit", exact=True)
        for _ in range(2):
            edit.click()
            assert bar.is_visible() and not script.is_visible()
            box, last = bar.bounding_box(), page.locator("#edit-menu-open").bounding_box()
            for side, size in (("x", "width"), ("y", "height")):
                assert last[side] + last[size] <= box[side] + box[size], "the last button is inside the bar"
            page.reload()
            ready(page)
            assert bar.is_visible() and not script.is_visible(), "the open Edit panel is restored"
            page.click("#toggle")
            assert script.is_visible() and not bar.is_visible()
