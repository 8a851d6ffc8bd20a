"""Progress of long work: a line on a terminal, a bar in a notebook, or a function of the caller."""

from __future__ import annotations

import html
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Callable, NamedTuple, Optional, Union


class Progress(NamedTuple):
    """How many cases, points or problems of a computation are complete."""

    done: int
    total: int
    successes: int = 0
    not_ok: int = 0
    begun_with: int = 0

    def text(self, unit: str, seconds: float) -> str:
        """A line about the computation after some seconds, such as '384 of 1000 cases, 120 per s, 5 s left, success 97.1 %'."""
        fresh = self.done - self.begun_with
        parts = [f"{self.done} of {self.total} {unit}"]
        if self.done >= self.total:
            parts[0] = f"{self.total} {unit} in {seconds:.1f} s"
        elif fresh > 0 and seconds > 0:
            rate = fresh / seconds
            parts += [f"{rate:.3g} per s", f"{(self.total - self.done) / rate:.0f} s left"]
        if self.successes > 0:
            parts.append(f"success {100 * self.successes / self.done:.1f} %")
        if self.not_ok > 0:
            parts.append(f"{self.not_ok} not ok")
        return ", ".join(parts)


for _name, _text in (("done", "Complete cases, points or problems, with those of earlier calls."), ("total", "All of them."),
                     ("successes", "Successes among those done; campaigns only."),
                     ("not_ok", "Those done that failed or are unreachable."),
                     ("begun_with", "Those that were complete at the start of the call.")):
    getattr(Progress, _name).__doc__ = _text  # for help()

#: None: a line on a terminal, a bar in a notebook, otherwise nothing. True: a line on stderr where there is neither. False:
#: nothing. A function is called several times per second.
ProgressChoice = Union[bool, Callable[[Progress], Any], None]

_Report = Optional[Callable[..., None]]  # as compiled functions take it: None, or a function of the numbers of Progress
_BEGIN = 0.5  # [s] before which nothing is shown
_INTERVAL = 0.2  # [s] between two updates


class _Line:
    """One line of stderr, which each update overwrites and the end removes."""

    def update(self, text: str, share: float) -> None:
        sys.stderr.write(f"\r{text}\x1b[K")
        sys.stderr.flush()

    def end(self, text: str, share: float) -> None:
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()


class _PlainLine(_Line):
    """The last line only, for a file."""

    def update(self, text: str, share: float) -> None:
        pass

    def end(self, text: str, share: float) -> None:
        print(text, file=sys.stderr)


class _Bar:
    """An output of a notebook, which each update replaces."""

    def __init__(self, display: Callable[..., Any]) -> None:
        self._display = display
        self._handle: Any = None

    def update(self, text: str, share: float) -> None:
        page = f'<progress value="{share:.4f}" max="1"></progress> {html.escape(text)}'
        data = {"text/plain": text, "text/html": page}
        if self._handle is None:
            self._handle = self._display(data, raw=True, display_id=True)
        else:
            self._handle.update(data, raw=True)

    end = update


def _notebook_display() -> Callable[..., Any] | None:
    """The function `display` of IPython, if this process serves a notebook."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    if shell is None or getattr(shell, "kernel", None) is None:
        return None
    from IPython.display import display

    shown: Callable[..., Any] = display
    return shown


def _place(is_wanted: bool | None) -> _Line | _Bar | None:
    display = _notebook_display()
    if display is not None:
        return _Bar(display)
    if sys.stderr is not None and sys.stderr.isatty():
        return _Line()
    return _PlainLine() if is_wanted else None


@contextmanager
def reported(choice: ProgressChoice, unit: str) -> Iterator[_Report]:
    """Yields what a compiled function gets as `progress`, and removes or completes what is shown at the end of the block."""
    if choice is False:
        yield None
        return
    if choice is not None and choice is not True:
        if not callable(choice):
            raise TypeError(f"progress is {choice!r}; expected None, True, False or a function")
        function: Callable[[Progress], Any] = choice
        yield lambda *numbers: function(Progress(*numbers))
        return
    found = _place(choice)
    if found is None:
        yield None
        return
    place: _Line | _Bar = found
    begin = time.monotonic()
    due, last = begin + _BEGIN, None

    def report(*numbers: int) -> None:
        nonlocal due, last
        last, now = Progress(*numbers), time.monotonic()
        if now >= due:
            due = now + _INTERVAL
            place.update(last.text(unit, now - begin), last.done / max(last.total, 1))

    try:
        yield report
    finally:
        seconds = time.monotonic() - begin
        if last is not None and (due > begin + _BEGIN or choice):  # shown before, or wanted
            place.end(last.text(unit, seconds), last.done / max(last.total, 1))
