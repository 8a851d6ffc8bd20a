"""Arguments that many functions have: files, whole numbers, threads."""

from __future__ import annotations

import operator
import os
from typing import Any, Union

from numpy.typing import NDArray

Path = Union[str, "os.PathLike[str]"]
Array = NDArray[Any]  #: what functions return; they take whatever NumPy makes an array of


def whole_number(name: str, value: Any, least: int, most: int) -> int:
    """The value as an int, NumPy's too. Raises ValueError, or TypeError where it is no whole number at all."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {value!r}; expected is a whole number from {least} to {most}") from None
    if isinstance(value, bool) or not least <= number <= most:
        raise ValueError(f"{name} is {value!r}; expected is a whole number from {least} to {most}")
    return number


def thread_count(threads: Any) -> int:
    """How many threads; 0: one per processor."""
    return whole_number("threads", threads, 0, 4096)


def file_path(name: str, value: Any) -> str:
    """A path as text. Raises TypeError naming the argument."""
    try:
        return os.fsdecode(value)
    except TypeError:
        raise TypeError(f"{name} is {value!r}; expected is a path, a text or pathlib's") from None
