"""Workers: one thread each, the same results with any number of them, and none left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor
from functools import partial
from multiprocessing import active_children, popen_fork
from multiprocessing.context import SpawnProcess
from pathlib import Path
from types import SimpleNamespace

import pytest

from calib.workers import Crew, given_to, workers

ROOT = Path(__file__).parents[2]
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def test_no_process_means_in_this_process_one_after_the_other() -> None:
    done: list[int] = []
    with workers(0) as executor:
        assert executor.submit(os.getpid).result() == os.getpid()
        futures = [executor.submit(done.append, i) for i in range(20)]
        assert list(executor.map(abs, [-1, -2])) == [1, 2]
        assert all(f.done() for f in futures)
    assert done == list(range(20))


def test_processes_have_one_thread_each_and_the_environment_is_put_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(THREADS[0], "7")
    monkeypatch.delenv(THREADS[1], raising=False)
    before = dict(os.environ)
    with workers(1) as executor:
        assert executor.submit(os.getpid).result() != os.getpid()
        assert [executor.submit(os.getenv, name).result() for name in THREADS] == ["1"] * 4
    assert dict(os.environ) == before


@pytest.mark.parametrize("processes", [0, 1])
def test_what_goes_wrong_in_a_worker_comes_back(processes: int) -> None:
    with workers(processes) as executor, pytest.raises(ValueError, match="invalid literal"):
        executor.submit(int, "three").result()


def _interrupted(executor: Executor, release: threading.Event, done: list[int]) -> None:
    executor.submit(release.wait)
    executor.submit(done.append, 1)
    raise KeyboardInterrupt


@pytest.mark.parametrize("processes", [0, 1])
def test_work_is_of_what_it_held_when_it_was_given(processes: int) -> None:
    held = list(range(5))
    with workers(processes) as executor:
        wait = executor.submit(time.sleep, 0.2)
        answers = given_to(executor, [partial(sum, held), partial(len, held)])
        held.append(100)
        wait.result()
        assert [answer() for answer in answers] == [10, 5]


def test_a_value_may_be_worked_with_while_workers_are_given_it() -> None:
    """What is kept of it here changes its dictionary, which a thread of the executor must not be pickling."""
    value = SimpleNamespace(**{f"number {n}": n for n in range(20_000)})
    with workers(1) as executor:
        answers = given_to(executor, [partial(vars, value)] * 5)
        for k in range(50_000):
            value.__dict__[f"kept {k}"] = k
        assert [len(answer()) for answer in answers] == [20_000] * 5


def test_an_interrupted_caller_need_not_wait_and_the_rest_is_dropped() -> None:
    release, begin = threading.Event(), time.monotonic()
    done: list[int] = []
    with pytest.raises(KeyboardInterrupt), workers(0) as executor:
        _interrupted(executor, release, done)
    assert time.monotonic() - begin < 5
    release.set()
    time.sleep(0.1)
    assert done == []


SCRIPT = """
import os, sys, time
from calib.workers import Crew, workers
if __name__ == "__main__":
    with workers(2) as executor:
        print(*{executor.submit(os.getpid).result() for _ in range(8)}, flush=True)
        executor.submit(time.sleep, 600).result()
"""


def _alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
def test_a_killed_parent_leaves_no_worker(tmp_path: Path) -> None:
    script = tmp_path / "parent.py"
    script.write_text(SCRIPT, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True, env=environment)
    assert parent.stdout is not None
    pids = [int(word) for word in parent.stdout.readline().split()]
    try:
        assert pids
        assert all(_alive(pid) for pid in pids)
    finally:
        parent.send_signal(signal.SIGKILL)
        parent.wait()
        parent.stdout.close()
    deadline = time.monotonic() + 120
    while any(_alive(pid) for pid in pids) and time.monotonic() < deadline:
        time.sleep(0.05)
    left = [pid for pid in pids if _alive(pid)]
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    assert left == []


def _run_script(folder: Path, code: str) -> subprocess.CompletedProcess[str]:
    script = folder / "script.py"
    script.write_text(code, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run([sys.executable, str(script)], capture_output=True, text=True, env=environment, check=False)


BARE = """
import os
from calib.workers import workers
print("once")
with workers(2) as executor:
    print(os.getpid() in {executor.submit(os.getpid).result() for _ in range(8)})
"""


def test_a_script_is_not_run_again_by_its_workers_and_needs_no_line_for_that(tmp_path: Path) -> None:
    run = _run_script(tmp_path, BARE)
    assert (run.returncode, run.stdout.split()) == (0, ["once", "False"]), run.stderr


OWN = """
from dataclasses import dataclass
from calib.workers import workers

@dataclass(frozen=True)
class Number:
    value: int

def twice(number):
    return Number(2 * number.value)

def main():
    with workers(1) as executor:
        print(executor.submit(twice, Number(3)).result() == Number(6), executor.submit(twice, Number(4)).result())
"""


def test_what_a_script_defines_itself_can_be_given_to_workers(tmp_path: Path) -> None:
    run = _run_script(tmp_path, f'{OWN}\nif __name__ == "__main__":\n    main()\n')
    assert (run.returncode, run.stdout.strip()) == (0, "True Number(value=8)"), run.stderr


def test_a_script_that_gives_workers_what_it_defines_is_told_which_line_it_needs(tmp_path: Path) -> None:
    run = _run_script(tmp_path, f"{OWN}\nmain()\n")
    assert run.returncode == 1
    assert 'needs `if __name__ == "__main__":`' in run.stderr


def _interrupted_at_work(executor: Executor) -> None:
    running = executor.submit(time.sleep, 600)
    while not running.running():
        time.sleep(0.01)
    raise KeyboardInterrupt


def test_a_block_that_is_interrupted_waits_for_no_process_and_leaves_none() -> None:
    before, begin = set(active_children()), time.monotonic()
    with pytest.raises(KeyboardInterrupt), workers(1) as executor:
        _interrupted_at_work(executor)
    assert time.monotonic() - begin < 20
    # For a moment the executor's own thread may be about to say that it has ended.
    while set(active_children()) - before and time.monotonic() - begin < 30:
        time.sleep(0.05)
    assert set(active_children()) <= before


GROUP = """
import os, signal, time
from calib.workers import Crew, workers
if __name__ == "__main__":
    signum = int(os.environ["SIGNAL"])
    signal.signal(signum, lambda *_: None)
    with workers(2) as executor:
        for k in range(int(os.environ["EARLY"])):
            futures = [executor.submit(time.sleep, 0.1) for _ in range(2)]
            os.kill(0, signum)
            [f.result() for f in futures]
        futures = [executor.submit(time.sleep, 0.3) for _ in range(2)]
        time.sleep(0.1)
        os.kill(0, signum)
        [f.result() for f in futures]
    print("done")
"""


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="signals of process groups")
@pytest.mark.parametrize("early", [0, 1], ids=["while they work", "while they start"])
@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGHUP])
def test_what_a_terminal_sends_to_all_is_left_to_the_parent(tmp_path: Path, early: int, signum: signal.Signals) -> None:
    script = tmp_path / "parent.py"
    script.write_text(GROUP, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "EARLY": str(early), "SIGNAL": str(int(signum))}
    command = [sys.executable, str(script)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=600, start_new_session=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "done\n", "")


# --- a crew -------------------------------------------------------------------------------------------------------------


def test_a_crew_that_nobody_needs_is_never_begun() -> None:
    before = active_children()
    with Crew(2) as crew:
        crew.drop()
        assert active_children() == before


def test_what_a_crew_is_at_can_be_dropped_and_others_go_on(tmp_path: Path) -> None:
    with Crew(1) as crew:
        first = crew.submit(os.getpid).result()
        crew.submit(time.sleep, 600)
        begin = time.monotonic()
        crew.drop()
        assert crew.submit(os.getpid).result() != first
        assert time.monotonic() - begin < 60
    assert active_children() == []


def _failing(crew: Executor) -> None:
    crew.submit(time.sleep, 600)
    raise KeyError("here")


def test_a_crew_ends_with_a_block_that_fails_and_the_failure_is_told() -> None:
    with pytest.raises(KeyError, match="here"), Crew(1) as crew:
        _failing(crew)
    assert active_children() == []


def test_workers_of_a_block_that_fails_have_ended_whoever_hears_of_it_first(monkeypatch: pytest.MonkeyPatch) -> None:
    def slow(self: popen_fork.Popen, flag: int = os.WNOHANG) -> int | None:
        """As the original, but the executor's thread asks first and tells late."""
        late = threading.current_thread() is not threading.main_thread()
        if self.returncode is None:
            time.sleep(0.0 if late else 0.05)
            try:
                pid, status = os.waitpid(self.pid, flag)
            except ChildProcessError:
                return None
            if pid == self.pid:
                time.sleep(0.3 if late else 0.0)
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    monkeypatch.setattr(popen_fork.Popen, "poll", slow)
    with pytest.raises(KeyError, match="here"), Crew(1) as crew:
        _failing(crew)
    assert active_children() == []


def test_a_crew_of_no_process_works_in_this_one() -> None:
    with Crew(0) as crew:
        crew.load("calib.sampling.sampler")  # there is nobody to load it
        assert crew.submit(os.getpid).result() == os.getpid()
        assert list(crew.map(abs, [-1, -2])) == [1, 2]


@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="signals of threads")
def test_a_signal_while_a_worker_is_started_is_heard_when_it_has_been(monkeypatch: pytest.MonkeyPatch) -> None:
    start, whole, before = SpawnProcess.start, [], signal.getsignal(signal.SIGINT)
    release = threading.Event()
    other = threading.Thread(target=release.wait)
    other.start()

    def disturbed(process: SpawnProcess) -> None:
        signal.pthread_kill(other.ident or 0, signal.SIGINT)
        time.sleep(0.1)
        start(process)
        whole.append(process)

    monkeypatch.setattr(SpawnProcess, "start", disturbed)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), workers(1) as executor:
            executor.submit(os.getpid)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
        release.set()
        other.join()
    assert len(whole) == 1
