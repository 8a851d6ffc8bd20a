"""Checks of common arguments: files, integers, threads."""

from __future__ import annotations

import operator
import os
from typing import Any, Union

from numpy.typing import NDArray

Path = Union[str, "os.PathLike[str]"]
Array = NDArray[Any]  #: result type of functions; arguments may be anything that NumPy converts to an array


def whole_number(name: str, value: Any, least: int, most: int) -> int:
    """The value as an int; NumPy integers are accepted. Raises ValueError out of range, TypeError for other types."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {value!r}; expected an integer from {least} to {most}") from None
    if isinstance(value, bool) or not least <= number <= most:
        raise ValueError(f"{name} is {value!r}; expected an integer from {least} to {most}")
    return number


def thread_count(threads: Any) -> int:
    """The number of threads; 0: one per processor."""
    return whole_number("threads", threads, 0, 4096)


def file_path(name: str, value: Any) -> str:
    """A path as a string. Raises TypeError that names the argument."""
    try:
        return os.fsdecode(value)
    except TypeError:
        raise TypeError(f"{name} is {value!r}; expected a path (str or os.PathLike)") from None
