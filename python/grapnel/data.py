"""The scenarios, robots, targets and studies that come with Grapnel.

    import grapnel.data
    problem = grapnel.load(grapnel.data.scenario("first-plan"))
"""

from __future__ import annotations

from pathlib import Path

__all__ = ["folder", "names", "robot", "scenario", "study", "target"]


def folder() -> Path:
    """The folder with `scenarios`, `robots`, `targets`, `studies` and `meshes`: of a wheel, of an installation, or of the clone
    that contains the build. Raises FileNotFoundError if there is none."""
    package = Path(__file__).resolve().parent
    places = [package / "share"]
    places += [parent / "share" / "grapnel" for parent in package.parents]  # PREFIX/lib/python3/dist-packages/grapnel
    places += [parent for parent in package.parents if (parent / "cmake/GrapnelModule.cmake").is_file()]  # CLONE/build/release/python
    for place in places:
        if (place / "scenarios/first-plan.yaml").is_file():
            return place
    raise FileNotFoundError(f"no folder with Grapnel's scenarios belongs to {package}; install a wheel or the package grapnel")


def names(kind: str = "scenarios") -> list[str]:
    """The names of all 'scenarios', 'robots', 'targets' or 'studies'."""
    if kind not in ("scenarios", "robots", "targets", "studies"):
        raise ValueError(f"kind is {kind!r}; expected 'scenarios', 'robots', 'targets' or 'studies'")
    place = folder() / kind
    return sorted(file.relative_to(place).with_suffix("").as_posix() for file in place.rglob("*.yaml"))


def _file(kind: str, name: str) -> Path:
    file = folder() / kind / (name if name.endswith(".yaml") else f"{name}.yaml")
    if not file.is_file():
        raise FileNotFoundError(f"there is no {name!r} among the {kind}; expected one of {', '.join(names(kind))}")
    return file


def scenario(name: str) -> Path:
    """The file of a scenario, by its name: 'first-plan', 'thesis/closed-loop', ..."""
    return _file("scenarios", name)


def robot(name: str) -> Path:
    """The file of a robot, by its name: 'planar-dual-arm', ..."""
    return _file("robots", name)


def target(name: str) -> Path:
    """The file of a target, by its name."""
    return _file("targets", name)


def study(name: str) -> Path:
    """The file of a campaign, sweep or optimization, by its name: 'thesis-monte-carlo', ..."""
    return _file("studies", name)
