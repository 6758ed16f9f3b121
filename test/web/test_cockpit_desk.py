"""Tools for writing a script: completion, errors while typing, a console, variables, breakpoints, files."""

import contextlib
import re

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_page import initial_state_restored, let_time_pass, open_page, requests_held, wait_until

COUNTS = """\
import helper


def sysCall_init():
    self.count = 0
    self.gains = {"p": 1.5}


def sysCall_actuation():
    twice = 2 * self.count
    self.count += 1
    print("counted")
    helper.check(self.count)
"""
HELPER = "def check(count):\n    if count > LIMIT:\n        raise ValueError('too many')\n"


@pytest.fixture(name="desk", scope="module")
def _desk(cockpit, browser):
    """A page that the tests of this module share."""
    with initial_state_restored(cockpit), open_page(cockpit, browser) as page:
        yield page


def text(page):
    return page.inner_text("#text .cm-content")


def choose_menu_item(page, item):
    page.click("#more")
    page.get_by_role("menuitem", name=item).click()


def create_script(page, name, item="New Python script"):
    """Create a script with the menu."""
    choose_menu_item(page, item)
    page.keyboard.type(name)
    page.keyboard.press("Enter")
    ending = "lua" if "Lua" in item else "py"
    wait_until(page, lambda: page.input_value("#script") == f"mine/{name}.{ending}")
    wait_until(page, lambda: "sysCall_cleanup" in text(page))


def replace_text(page, words):
    """Replace the whole text of the editor."""
    page.locator("#text .cm-content").click()
    page.keyboard.press("Control+a")
    page.keyboard.insert_text(words)


def write_at_the_end(page, words):
    page.locator("#text .cm-content").click()
    page.keyboard.press("Control+End")
    page.keyboard.type(words)


def open_file(cockpit, page, name, content):
    """Write a file as another program does, and open it."""
    cockpit.scripts.mkdir(exist_ok=True)  # the cockpit creates it when it first saves a script
    (cockpit.scripts / name).write_text(content)
    wait_until(page, lambda: page.locator(f"#script option[value='mine/{name}']").count())
    page.select_option("#script", f"mine/{name}")
    wait_until(page, lambda: content.split("\n")[0] in text(page))


def open_counts(cockpit, page, name):
    """Open the script COUNTS, in the folder of the module that it imports."""
    cockpit.scripts.mkdir(exist_ok=True)
    (cockpit.scripts / "helper.py").write_text("def check(count):\n    return count\n")
    open_file(cockpit, page, name, COUNTS)


def accept_completion(page):
    """Accept a completion; in its first 75 ms, Enter starts a new line, for users who have not noticed it yet."""
    let_time_pass(page, 100)
    page.keyboard.press("Enter")


def run(page):
    page.click("#run")
    wait_until(page, lambda: page.inner_text("#said").startswith(("started", "paused at")))


def underlined(page):
    return page.locator("#text .cm-lintRange-error").all_inner_texts()


# ---- completion and hover


def test_a_new_script_has_a_template_completion_and_help(cockpit, desk):
    create_script(desk, "mine")
    assert "def sysCall_actuation" in text(desk)
    write_at_the_end(desk, "\nx = sim.getObjectVel")
    card = desk.locator(".cm-completionInfo")
    wait_until(desk, lambda: card.count() and "sim.getObjectVelocity(" in card.inner_text())
    assert card.locator("a").get_attribute("href").endswith("/regularApi/simGetObjectVelocity.htm")
    accept_completion(desk)
    desk.keyboard.type("(sim.getObject('Quadricopter_b")
    options = desk.locator(".cm-tooltip-autocomplete li")
    wait_until(desk, lambda: options.count() and options.first.inner_text().startswith("Quadricopter_base"))
    accept_completion(desk)
    wait_until(desk, lambda: "x = sim.getObjectVelocity(sim.getObject('Quadricopter_base'))" in text(desk))
    desk.keyboard.press("End")
    desk.keyboard.type("\nself.dro")
    wait_until(desk, lambda: options.count() and options.first.inner_text() == "drone")
    desk.keyboard.press("Escape")
    desk.locator("#text .cm-line", has_text="self.position = ").get_by_text("getObjectPosition").hover()
    hover = desk.locator(".cm-tooltip-hover")
    wait_until(desk, lambda: hover.count() and "Return the position of an object" in hover.inner_text())


def test_completion_in_lua_offers_callbacks_and_old_function_names(desk):
    create_script(desk, "mine", "New Lua script")
    replace_text(desk, "sysCall_act")
    options = desk.locator(".cm-tooltip-autocomplete li")
    desk.keyboard.type("u")
    wait_until(desk, lambda: options.count() and options.first.inner_text().startswith("sysCall_actuation"))
    accept_completion(desk)
    wait_until(desk, lambda: text(desk).startswith("function sysCall_actuation()"))
    desk.keyboard.type("simGetObjectPosi")
    wait_until(desk, lambda: options.count() and options.first.inner_text().startswith("simGetObjectPosition"))
    desk.keyboard.press("Escape")


# ---- errors


@pytest.mark.parametrize(
    ("item", "good", "ending", "unknown"),
    [
        ("New Python script", "def sysCall_init():\n    sim.getObject('.')\n", "x = ", "\nsim.getObjct('.')"),
        (
            "New Lua script",
            "function sysCall_init()\n  simGetObjectHandle('.')\nend\n",
            "if x",
            "\nsimGetObjctHandle('.')",
        ),
    ],
)
def test_errors_are_underlined_while_typing_until_they_are_fixed(desk, item, good, ending, unknown):
    create_script(desk, "wrong", item)
    replace_text(desk, good)
    write_at_the_end(desk, ending)
    wait_until(desk, lambda: underlined(desk))
    replace_text(desk, good)
    wait_until(desk, lambda: not underlined(desk))
    desk.keyboard.press("Control+End")
    desk.keyboard.insert_text(unknown)
    wait_until(desk, lambda: underlined(desk) in (["getObjct"], ["simGetObjctHandle"]))
    desk.locator("#text .cm-lintRange-error").hover()
    message = desk.locator(".cm-tooltip-lint")
    wait_until(desk, lambda: message.count() and "near names are" in message.inner_text())
    replace_text(desk, good)
    wait_until(desk, lambda: not underlined(desk))
    choose_menu_item(desk, "Delete")
    wait_until(desk, lambda: desk.is_visible("#question"))
    desk.get_by_role("button", name="OK").click()


def test_a_script_with_a_syntax_error_does_not_replace_the_flying_one(cockpit, desk):
    cockpit.start_afresh()
    open_file(cockpit, desk, "unreadable.py", "def sysCall_init(:\n    pass\n")
    wait_until(desk, lambda: desk.inner_text("#flying") == "built-in/pilot.py flies")
    desk.click("#run")
    wait_until(desk, lambda: "unreadable.py:1: SyntaxError" in desk.inner_text("#console"))
    assert "line 1: SyntaxError" in desk.inner_text("#said") and underlined(desk)
    assert rospy.get_param("/drone_sim/script") == "pilot" and desk.inner_text("#flying") == "built-in/pilot.py flies"


# ---- console


def test_the_console_counts_and_filters_messages_and_opens_their_lines(cockpit, desk):
    log = "def sysCall_init():\n    sim.addLog(sim.verbosity_scriptwarnings, 'step late by 3 ms')\n\n\nLIMIT = 3\n"
    (cockpit.scripts / "helper.py").write_text(HELPER.replace("LIMIT", "3"))
    open_file(cockpit, desk, "counts.py", COUNTS + log.replace("def sysCall_init():\n    ", ""))
    desk.click("#run")
    wait_until(desk, lambda: "counted  (4 times)" in desk.inner_text("#console"))
    wait_until(desk, lambda: "helper.py:3" in desk.inner_text("#console"))
    assert "late by 3 ms" not in desk.inner_text("#console")
    desk.get_by_label("late steps").check()
    assert "late by 3 ms" in desk.inner_text("#console")
    desk.get_by_label("late steps").uncheck()
    desk.get_by_role("button", name="helper.py:3").click()
    wait_until(desk, lambda: desk.input_value("#script") == "mine/helper.py")
    desk.keyboard.type("# here")
    wait_until(desk, lambda: text(desk).split("\n")[2].startswith("# here"))
    desk.get_by_role("button", name="Clear").click()
    assert desk.inner_text("#console") == ""


# ---- variables and breakpoints


def line_number(page, line):
    numbers = page.locator("#text .cm-lineNumbers .cm-gutterElement")
    return numbers.filter(has_text=re.compile(rf"^{line}$")).locator("visible=true")


def shown_value(page, name):
    """Return the value of a variable in the table."""
    row = page.locator("#variables tr", has=page.locator("th", has_text=re.compile(rf"^[▸▾]?{name}$")))
    return row.locator("td").first.inner_text()


def resume(cockpit, page):
    """Resume, and return whether the pause has ended: a removed breakpoint may pause the script once more."""
    cockpit.call("pause", False)
    return not page.locator("#text .cm-paused").count()


def test_a_breakpoint_pauses_with_the_variables_of_its_line(cockpit, desk):
    open_counts(cockpit, desk, "breaks.py")
    line_number(desk, 8).click()  # an empty line before a function: the breakpoint goes to the function's first line
    run(desk)
    wait_until(desk, lambda: "Paused at line 10 of breaks.py, t = 0.00 s" in desk.inner_text("#variables-of"))
    assert desk.inner_text("#said") == "paused at line 10, t = 0.00 s"
    assert "twice = 2" in desk.inner_text("#text .cm-paused") and shown_value(desk, "count") == "0"
    desk.locator("#text .cm-line", has_text="self.count += 1").click()
    desk.keyboard.press("F9")
    line_number(desk, 10).click()
    while "line 11" not in desk.inner_text("#variables-of"):  # the simulation receives the change with a delay
        cockpit.call("step")
        with contextlib.suppress(AssertionError):
            wait_until(desk, lambda: "line 11" in desk.inner_text("#variables-of"), seconds=5)
    count = int(shown_value(desk, "count"))
    assert shown_value(desk, "twice") == str(2 * count), "the value at that line"
    cockpit.call("step")
    wait_until(desk, lambda: shown_value(desk, "count") == str(count + 1))
    assert shown_value(desk, "twice") == str(2 * count + 2)
    assert desk.locator("#variables tr.changed").count() == 2
    desk.get_by_role("button", name="gains").click()
    assert shown_value(desk, "'p'") == "1.5"
    line_number(desk, 11).click()
    wait_until(desk, lambda: not desk.locator("#text .cm-breakpoint").count())
    wait_until(desk, lambda: resume(cockpit, desk))
    desk.get_by_label("live").check()
    wait_until(desk, lambda: "breaks.py: flying" in desk.inner_text("#variables-of"))
    before = int(shown_value(desk, "count"))
    wait_until(desk, lambda: int(shown_value(desk, "count")) > before)
    desk.get_by_label("live").uncheck()
    desk.get_by_role("tab", name="Console").click()


def test_a_breakpoint_stays_with_its_line(cockpit, browser):
    with open_page(cockpit, browser) as page:
        open_counts(cockpit, page, "stays.py")
        line_number(page, 11).click()
        page.locator("#text .cm-content").click()
        page.keyboard.press("Control+Home")
        page.keyboard.type("# one more line\n")
        assert page.locator("#text .cm-breakpoint").count() == 1
        run(page)
        wait_until(page, lambda: "line 12" in page.inner_text("#variables-of"))
        page.keyboard.press("Control+End")
        line_number(page, 12).click()
        wait_until(page, lambda: not page.locator("#text .cm-breakpoint").count())
        wait_until(page, lambda: resume(cockpit, page))


# ---- files


def test_files_are_renamed_duplicated_deleted_and_restored(cockpit, desk):
    open_file(cockpit, desk, "first.py", "# the first\n")
    (cockpit.scripts / "taken.py").write_text("# taken\n")
    choose_menu_item(desk, "Rename")
    desk.keyboard.type("taken")
    desk.keyboard.press("Enter")
    wait_until(desk, lambda: "mine/taken.py: is there already" in desk.inner_text("#name-said"))
    desk.keyboard.type("second")
    desk.keyboard.press("Enter")
    wait_until(desk, lambda: desk.input_value("#script") == "mine/second.py")
    assert (cockpit.scripts / "second.py").read_text() == "# the first\n"
    assert not (cockpit.scripts / "first.py").exists() and not desk.is_visible("#name")
    choose_menu_item(desk, "Duplicate")
    wait_until(desk, lambda: desk.input_value("#script") == "mine/second_2.py")
    choose_menu_item(desk, "Delete")
    wait_until(desk, lambda: "mine/second_2.py is deleted" in desk.inner_text("#question"))
    assert not (cockpit.scripts / "second_2.py").exists()
    desk.get_by_role("button", name="Undo").click()
    wait_until(desk, lambda: desk.input_value("#script") == "mine/second_2.py")
    wait_until(desk, lambda: text(desk).startswith("# the first"))
    desk.select_option("#script", "built-in/pilot.py")
    wait_until(desk, lambda: "stops the propellers" in text(desk))
    desk.click("#more")
    assert desk.get_by_role("menuitem", name="Delete").is_disabled()
    desk.keyboard.press("Escape")
    assert not desk.is_visible("#menu")


@pytest.mark.parametrize("name", ["typed.py", "typed.lua"])
def test_text_typed_during_a_rename_is_saved_under_the_new_name(cockpit, desk, name):
    open_file(cockpit, desk, "renamed.py", "# renamed\n")
    choose_menu_item(desk, "Rename")
    desk.keyboard.type(name)
    with requests_held(desk, "rename") as wait_for_request:
        desk.keyboard.press("Enter")
        wait_for_request()
        write_at_the_end(desk, "# typed")
    wait_until(desk, lambda: desk.input_value("#script") == f"mine/{name}")
    wait_until(desk, lambda: (cockpit.scripts / name).read_text() == "# renamed\n# typed")
    assert not (cockpit.scripts / "renamed.py").exists() and text(desk).endswith("# typed")


def test_files_can_be_downloaded_and_dropped_into_the_editor(cockpit, desk):
    open_file(cockpit, desk, "down.py", "# down\n")
    with desk.expect_download() as download:
        choose_menu_item(desk, "Download")
    assert download.value.suggested_filename == "down.py" and download.value.path().read_text() == "# down\n"
    for name, content in (("up.py", "# up\r\n"), ("up.txt", "no script"), ("down.py", "# another\n")):
        data_transfer = desk.evaluate_handle(
            """([name, text]) => {
                const data = new DataTransfer();
                data.items.add(new File([text], name));
                return data;
            }""",
            [name, content],
        )
        desk.dispatch_event("#text .cm-content", "drop", {"dataTransfer": data_transfer})
        if name == "up.py":
            wait_until(desk, lambda: desk.input_value("#script") == "mine/up.py")
        elif name == "up.txt":
            wait_until(desk, lambda: "ends in .py or .lua" in desk.inner_text("#said"))
    wait_until(desk, lambda: "is there already" in desk.inner_text("#name-said"))
    desk.keyboard.type("other")
    desk.keyboard.press("Enter")
    wait_until(desk, lambda: desk.input_value("#script") == "mine/other.py")
    assert (cockpit.scripts / "up.py").read_text() == "# up\n"
    assert (cockpit.scripts / "other.py").read_text() == "# another\n"
