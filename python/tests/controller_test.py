"""Controllers in Python."""

import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

import numpy
import pytest
from conftest import SOURCE

import grapnel

SCENARIO = SOURCE / "examples" / "controllers" / "own-controller.yaml"
CONTROL = {"period": "10 ms", "delay": "10 ms", "external": True, "base_torque": True,
           "parameters": {"kp": 20, "kd": 60, "base_kd": 100}}


def own(**more):
    return grapnel.load(SCENARIO, set={"control": {**CONTROL, **more}, "post_impact.duration": 3})


class OwnPd:
    def create(self, setup):
        self.setup = setup

    def reset(self, time):
        self.begin, self.calls = time, 0

    def update(self, input, access, output):
        own = self.setup.parameters
        output.effort = own["kp"] * (input.desired_position - input.position) + own["kd"] * (input.desired_rate - input.rate)
        output.base_torque = -own["base_kd"] * input.base_angular_velocity
        self.calls += 1
        self.last = input


def controller_with(update):
    return type("Custom", (), {"update": update})()


def test_results_have_the_bits_of_the_same_controller_in_c():
    plugins = sorted(pathlib.Path(os.environ["GRAPNEL_BUILD_DIR"]).glob("examples/controllers/libown_pd.*"))
    if not plugins:
        pytest.skip("the examples are not built")
    control = {key: value for key, value in CONTROL.items() if key != "external"}
    in_c = grapnel.load(SCENARIO, set={"control": {**control, "plugin": str(plugins[0])}, "post_impact.duration": 3}).simulate()
    pd = OwnPd()
    in_python = own().simulate(controller=pd)
    assert in_python.status == in_c.status == "completed" and in_python.ledger.passed
    for name in in_c:
        assert numpy.array_equal(in_c[name], in_python[name], equal_nan=True), name
    assert numpy.abs(in_c["joints/effort"]).max() > 1
    # It received the expected input, and the result has its name and a digest of its source.
    assert pd.begin == pytest.approx(20) and pd.calls == 300 and pd.last.joints == 6
    assert pd.last.time == pytest.approx(22.99) and pd.setup.period == 0.01 and pd.setup.base_torque
    assert [joint["name"] for joint in pd.setup.model["joints"]] == in_python.components["joints/position"]
    report = in_python.summary["control"]
    assert report["plugin"] == "OwnPd" and len(report["plugin_sha256"]) == 64


def test_it_can_query_the_true_model():
    asked = {}

    def update(self, input, access, output):
        if input.time < 22:
            return
        asked.update(n=access.velocities(), H=access.mass_matrix(), C=access.bias(), p=access.momentum(),
                     J=access.generalized_jacobian("tip-1"), access=access)
        with pytest.raises(KeyError, match="the robot has no end-effector 'tip-9'"):
            access.generalized_jacobian("tip-9")

    result = own().simulate(controller=controller_with(update))
    assert result.status == "completed", result.failure
    n = asked["n"]
    assert asked["H"].shape == (n, n) and asked["C"].shape == (n,) and asked["J"].shape == (6, n - 6)
    assert numpy.abs(asked["H"] - asked["H"].T).max() < 1e-9 and numpy.linalg.eigvalsh(asked["H"]).min() > 0
    # The momentum of the run, which the impact transferred from the target.
    assert numpy.linalg.norm(asked["p"]) > 1e-3
    with pytest.raises(RuntimeError, match="during update"):
        asked["access"].mass_matrix()


@pytest.mark.parametrize(("update", "text"), [
    (lambda self, input, access, output: 1 // 0, "ZeroDivisionError: integer division or modulo by zero (controller_test.py, line "),
    (lambda self, input, access, output: setattr(output, "effort", [1, 2, 3]),
     "output.effort has shape (3,), expected (6,)"),
    (lambda self, input, access, output: setattr(output, "base_torque", 1.0), "output.base_torque has shape ()"),
    (lambda self, input, access, output: setattr(output, "effort", input.rate * numpy.nan), "says an effort of nan at joint 'arm-1-joint-1'"),
    (lambda self, input, access, output: [1, 2, 3], "update() returned <class 'list'>; expected None"),
])
def test_an_error_ends_the_run_with_a_message(update, text):
    result = own().simulate(controller=controller_with(update))
    assert result.status == "failed" and text in result.failure, result.failure
    assert "at t = 20 s" in result.failure and "the Python controller 'Custom'" in result.failure
    assert result.time[-1] == pytest.approx(20) and result.summary["impact"] is not None  # earlier results are kept


def test_create_and_reset_may_fail():
    class NoCreate(OwnPd):
        def create(self, setup):
            raise ValueError("not with six joints")

    class NoReset(OwnPd):
        def reset(self, time):
            raise ValueError("not now")

    assert "created no controller: ValueError: not with six joints" in own().simulate(controller=NoCreate).failure
    assert "reset() of the Python controller" in own().simulate(controller=NoReset).failure
    with pytest.raises(grapnel.SimulationError, match="not now"):
        own().simulate(controller=NoReset, strict=True)


def test_what_does_not_fit_is_refused():
    with pytest.raises(TypeError, match="has no update"):
        own().simulate(controller=3)
    with pytest.raises(ValueError, match="requests no Python controller"):
        grapnel.load(SCENARIO, set={"control": {"period": 0.01}, "post_impact.joints": "free"}).simulate(controller=OwnPd)
    with pytest.raises(grapnel.InputError, match="the calling program must provide the controller"):
        own().simulate()
    with pytest.raises(TypeError, match="expected its class"):
        grapnel.simulate_many([own()], controller=OwnPd())
    faults = grapnel.check(SCENARIO, set={"control": {"period": 0.01, "parameters": {"a": 1}}, "post_impact.joints": "free"})
    assert "control.parameters needs a controller" in faults[0].message


def test_each_run_has_an_instance():
    made = []

    class Counted(OwnPd):
        def __init__(self):
            made.append(threading.get_ident())

    results = grapnel.simulate_many([own() for _ in range(4)], threads=2, controller=Counted)
    alone = own().simulate(controller=OwnPd())
    assert len(made) == 4
    for result in results:
        assert numpy.array_equal(result["joints/position"], alone["joints/position"])


@pytest.mark.parametrize("body", ["pass", "time.sleep(0.001)", "\n            while True: pass"])
def test_a_signal_ends_it(body):
    """Between calls of the controller, in a call, and in a call that does not return."""
    code = f"""
import time, grapnel
class Slow:
    def update(self, input, access, output):
        print("asked", flush=True) if input.time < 20.001 else None
        if True: {body}
problem = grapnel.load({str(SCENARIO)!r}, set={{"control": {CONTROL!r}, "post_impact.duration": 10000, "output.interval": 100}})
try:
    problem.simulate(controller=Slow())
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=os.environ)
    try:
        assert child.stdout.readline() == "asked\n"
        time.sleep(0.5)
        assert child.poll() is None
        child.send_signal(signal.SIGINT)
        output, _ = child.communicate(timeout=60)
    finally:
        child.kill()
        child.wait()
    assert output == "interrupted\n" and child.returncode == 0
