"""Custom controllers in Python: a class with `update`, and the types of its arguments.

    class Damper:
        def create(self, setup): self.kd = setup.parameters["kd"]
        def reset(self, time): ...
        def update(self, input, access, output): output.effort = -self.kd * input.rate

    result = problem.simulate(controller=Damper)       # scenario with control: {external: true, period: ...}

Names and arguments are those of the C interface, grapnel/plugin/grapnel_controller.h; docs/how-to/own-controller.md.
"""

from __future__ import annotations

import hashlib
import inspect
from typing import Any, Protocol

from ._grapnel import ControllerAccess, ControllerInput, ControllerOutput, ControllerSetup

__all__ = ["Controller", "ControllerAccess", "ControllerInput", "ControllerOutput", "ControllerSetup"]


class Controller(Protocol):
    """Argument of `Problem.simulate(controller=...)`: an object with `update`, or a class, of which each run creates an object.

    Optional functions are `create(setup: ControllerSetup)`, called once per run before all others, and `reset(time: float)`,
    called before the first sample. An exception in any of them ends the run; the results up to that time are kept.
    """

    def update(self, input: ControllerInput, access: ControllerAccess, output: ControllerOutput) -> None:
        """Called at each sample: reads `input`, may query the true model in `access`, writes `output.effort` and `output.base_torque`."""


def _given(controller: Any) -> tuple[Any, str, str]:
    """The controller, its name in results, and the sha256 of its class's source; '' if the source is not available."""
    if controller is None:
        return None, "", ""
    kind = controller if inspect.isclass(controller) else type(controller)
    if not callable(getattr(kind, "update", None)):
        raise TypeError(f"controller is {controller!r}, which has no update(input, access, output)")
    try:
        digest = hashlib.sha256(inspect.getsource(kind).encode()).hexdigest()
    except (OSError, TypeError):
        digest = ""
    return controller, kind.__qualname__, digest
