"""Inbox for jobs from other threads: order, answers, timeouts. Needs no ROS."""

import threading

import pytest

from drone_sim.ros.core.inbox import Inbox


def ask(inbox, job):
    """Ask in a thread; return the thread, and a list that will hold the answer or the error."""
    outcomes = []

    def run():
        try:
            outcomes.append(inbox.ask(job))
        except Exception as error:
            outcomes.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    return thread, outcomes


def test_jobs_run_in_order_in_the_thread_that_calls_run_jobs():
    inbox, done = Inbox(), []
    for number in range(3):
        inbox.put(lambda number=number: done.append((number, threading.get_ident())))
    assert not done
    inbox.run_jobs()
    assert done == [(number, threading.get_ident()) for number in range(3)]


def test_a_job_added_by_a_running_job_waits_for_the_next_run_jobs():
    inbox, done = Inbox(), []

    def add_itself():
        done.append(1)
        inbox.put(add_itself)

    inbox.put(add_itself)
    inbox.run_jobs()
    assert done == [1]
    inbox.run_jobs()
    assert done == [1, 1]


def test_run_directly_executes_jobs_added_by_a_job_at_once():
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


def test_ask_returns_the_answer_or_raises_the_error_of_the_job():
    inbox = Inbox()
    for job, expected in ((lambda: "done", "done"), (lambda: str(1 / 0), ZeroDivisionError)):
        thread, outcomes = ask(inbox, job)
        inbox.wait(10)
        inbox.run_jobs()
        thread.join(10)
        assert outcomes[0] == expected if expected == "done" else isinstance(outcomes[0], expected)


def test_a_request_that_timed_out_is_not_executed_later():
    inbox, done = Inbox(timeout=0.05), []
    with pytest.raises(TimeoutError, match=r"no answer within 0\.05 s: it will not be executed"):
        inbox.ask(lambda: done.append(1) or "")
    inbox.run_jobs()
    assert not done


def test_a_timeout_during_execution_is_reported_as_still_executing():
    inbox, may_answer = Inbox(timeout=0.5), threading.Event()  # s, long enough to start the job on a busy machine
    thread, outcomes = ask(inbox, lambda: str(may_answer.wait(10)))
    inbox.wait(10)
    worker = threading.Thread(target=inbox.run_jobs)
    worker.start()
    thread.join(10)
    may_answer.set()
    worker.join(10)
    assert "still being executed" in str(outcomes[0])


def test_a_new_job_wakes_the_custom_sleep():
    sleeps, wake_calls = [], []
    inbox = Inbox(sleep=sleeps.append, wake=lambda: wake_calls.append(True))
    inbox.wait(3.0)
    assert sleeps == [3.0]
    inbox.put(lambda: sleeps.append(0.0))
    inbox.run_jobs()
    assert wake_calls == [True] and sleeps == [3.0, 0.0]


def test_a_failing_job_is_logged_and_the_next_job_runs(caplog):
    inbox, done = Inbox(), []
    inbox.put(lambda: done.append(1 / 0))
    inbox.put(lambda: done.append("next"))
    inbox.run_jobs()
    assert done == ["next"]
    assert [one.exc_info[0] for one in caplog.records] == [ZeroDivisionError]
