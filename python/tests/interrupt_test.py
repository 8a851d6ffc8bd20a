"""Ctrl-C: a signal ends what is being computed with KeyboardInterrupt, in a process of its own."""

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
    # The interpreter and the library are as they were.
    assert grapnel.load(THESIS, set={"post_impact.duration": 1}).simulate().status == "completed"
    print("goes on", flush=True)
else:
    print("came to its end", flush=True)
"""
# Each would take minutes.
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
def test_a_signal_ends_it(what):
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
    assert output.split("\n")[:2] == ["interrupted", "goes on"] and child.returncode == 0
