"""Ctrl-C: a signal ends a computation with KeyboardInterrupt, tested in a separate process."""

import os
import signal
import subprocess
import sys
import time

import pytest
from conftest import SOURCE, SPATIAL, THESIS

HEAD = """
import numpy, sys, warnings
import grapnel
warnings.simplefilter("ignore")
def begun():
    print("begun", flush=True)
try:
"""
TAIL = """
except KeyboardInterrupt:
    print("interrupted", flush=True)
    # The interpreter and the library still work.
    assert grapnel.load(THESIS, set={"post_impact.duration": 1}).simulate().status == "completed"
    print("continues", flush=True)
else:
    print("completed", flush=True)
"""
# Each takes minutes without an interrupt.
WORK = {
    "simulate": """
    problem = grapnel.load(THESIS, set={"post_impact.duration": 1e6, "output.interval": 10, "approach.tracking.mode": "pd"})
    begun()
    problem.simulate()
""",
    "simulate_many": """
    problem = grapnel.load(THESIS, set={"post_impact.duration": 1e5, "output.interval": 10})
    begun()
    grapnel.simulate_many([problem.copy() for _ in range(100)])
""",
    "rollout": """
    robot = grapnel.Robot(SPATIAL)
    start = numpy.tile(numpy.concatenate(robot.zero_state()), (8, 1))
    begun()
    grapnel.rollout(robot, start, step=1e-4, steps=1000, substeps=1_000_000 // 1000 * 1000, last_only=True)
""",
    "batch": """
    robot = grapnel.Robot(SPATIAL)
    q = numpy.tile(robot.zero_state()[0], (3_000_000, 1))
    begun()
    robot.generalized_inertia(q)
""",
    "campaign": """
    import tempfile
    begun()
    with tempfile.TemporaryDirectory() as folder:
        grapnel.campaign(SOURCE + "/studies/thesis-uncertain-target.yaml", out=folder)
""",
}


@pytest.mark.parametrize("what", WORK)
def test_a_signal_ends_the_computation(what):
    names = f"THESIS, SPATIAL, SOURCE = {str(THESIS)!r}, {str(SPATIAL)!r}, {str(SOURCE)!r}\n"
    child = subprocess.Popen([sys.executable, "-c", names + HEAD + WORK[what] + TAIL], stdout=subprocess.PIPE, text=True,
                             env=os.environ)
    try:
        assert child.stdout.readline() == "begun\n"
        time.sleep(1.0)
        assert child.poll() is None
        child.send_signal(signal.SIGINT)
        output, _ = child.communicate(timeout=120)
    finally:
        child.kill()
        child.wait()
    assert output.split("\n")[:2] == ["interrupted", "continues"] and child.returncode == 0


@pytest.mark.parametrize("what", ["simulate", "rollout", "batch"])
def test_the_interpreter_may_end_during_a_daemon_thread(what):
    """As in notebooks: the thread is abandoned, and the process ends normally."""
    work = "\n".join(line for line in WORK[what].splitlines() if "begun()" not in line)
    code = f"""
import numpy, threading, time
import grapnel
THESIS, SPATIAL = {str(THESIS)!r}, {str(SPATIAL)!r}
def work():{work}
threading.Thread(target=work, daemon=True).start()
time.sleep(1.0)
print("ends", flush=True)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=os.environ, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "ends\n", "")


def test_a_waiting_second_campaign_can_be_stopped(tmp_path):
    code = f"""
import signal, threading, time, warnings
import grapnel
warnings.simplefilter("ignore")
file = {str(SOURCE / "studies/thesis-uncertain-target.yaml")!r}
def first():
    grapnel.campaign(file, out={str(tmp_path / "first")!r}, threads=1)
threading.Thread(target=first, daemon=True).start()
time.sleep(0.5)
print("begun", flush=True)
try:
    grapnel.campaign(file, out={str(tmp_path / "second")!r}, threads=1)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=os.environ)
    try:
        assert child.stdout.readline() == "begun\n"
        time.sleep(1.0)
        assert child.poll() is None
        begin = time.monotonic()
        child.send_signal(signal.SIGINT)
        output, _ = child.communicate(timeout=60)
    finally:
        child.kill()
        child.wait()
    assert output == "interrupted\n" and child.returncode == 0
    assert not (tmp_path / "second" / "campaign.json").exists() and time.monotonic() - begin < 60
