"""Work from other threads: in order, answered, and never after its time. Needs no ROS."""

import threading

import pytest

from drone_sim.ros.core.inbox import Inbox


def ask(inbox, job):
    """Ask in a thread; return the thread, and what will hold the answer or the error."""
    said = []

    def run():
        try:
            said.append(inbox.ask(job))
        except Exception as error:
            said.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    return thread, said


def test_jobs_are_done_in_order_by_who_empties():
    inbox, done = Inbox(), []
    for number in range(3):
        inbox.put(lambda number=number: done.append((number, threading.get_ident())))
    assert not done
    inbox.run_jobs()
    assert done == [(number, threading.get_ident()) for number in range(3)]


def test_what_comes_while_it_empties_waits_for_the_next_time():
    inbox, done = Inbox(), []

    def again():
        done.append(1)
        inbox.put(again)

    inbox.put(again)
    inbox.run_jobs()
    assert done == [1]
    inbox.run_jobs()
    assert done == [1, 1]


def test_a_job_may_have_its_own_jobs_executed_at_once():
    inbox, done = Inbox(), []

    def first():
        with inbox.run_directly():
            inbox.put(lambda: done.append("inside"))
        inbox.put(lambda: done.append("later"))
        done.append("first")

    inbox.put(first)
    inbox.run_jobs()
    assert done == ["inside", "first"]
    inbox.run_jobs()
    assert done == ["inside", "first", "later"]


def test_who_asks_gets_the_answer_or_the_error():
    inbox = Inbox()
    for job, expected in ((lambda: "done", "done"), (lambda: str(1 / 0), ZeroDivisionError)):
        thread, said = ask(inbox, job)
        inbox.wait(10)
        inbox.run_jobs()
        thread.join(10)
        assert said[0] == expected if expected == "done" else isinstance(said[0], expected)


def test_a_request_that_timed_out_is_not_carried_out_later():
    inbox, done = Inbox(timeout=0.05), []
    with pytest.raises(TimeoutError, match=r"no answer within 0\.05 s: it will not be executed"):
        inbox.ask(lambda: done.append(1) or "")
    inbox.run_jobs()
    assert not done


def test_a_request_that_has_begun_is_said_to_be_under_way():
    inbox, answered = Inbox(timeout=0.5), threading.Event()  # enough for a busy machine to begin the job
    thread, said = ask(inbox, lambda: str(answered.wait(10)))
    inbox.wait(10)
    worker = threading.Thread(target=inbox.run_jobs)
    worker.start()
    thread.join(10)
    answered.set()
    worker.join(10)
    assert "still being executed" in str(said[0])


def test_where_others_are_heard_meanwhile_a_job_wakes_their_sleep():
    slept, woken = [], []
    inbox = Inbox(sleep=slept.append, wake=lambda: woken.append(True))
    inbox.wait(3.0)
    assert slept == [3.0]
    inbox.put(lambda: slept.append(0.0))
    inbox.run_jobs()
    assert woken == [True] and slept == [3.0, 0.0]


def test_a_job_that_fails_ends_nothing_and_leaves_a_traceback(caplog):
    inbox, done = Inbox(), []
    inbox.put(lambda: done.append(1 / 0))
    inbox.put(lambda: done.append("next"))
    inbox.run_jobs()
    assert done == ["next"]
    assert [one.exc_info[0] for one in caplog.records] == [ZeroDivisionError]
