"""Runs that analyse the opening loop of the thesis, and the distance of its ends. Standard library only.

Used by scripts/validation (the table) and scripts/figures (the curves).
"""
import math

PUBLISHED = "impact.law=as_published"
ON_ACCELERATIONS = "integration.loops=acceleration"
BAUMGARTE = "integration.loops=baumgarte"
CUT = "integration.loops=open"

# Name, scenario, overrides: which of the two errors, and how the loop is closed.
RUNS = (
    ("none", "thesis/closed-loop", ()),
    ("positions", "thesis/closed-loop-published-angles", ()),
    ("velocities", "thesis/closed-loop", (PUBLISHED, ON_ACCELERATIONS)),
    ("both", "thesis/closed-loop-published-angles", (PUBLISHED, ON_ACCELERATIONS)),
    ("both, cut", "thesis/closed-loop-published-angles", (PUBLISHED, CUT)),
    ("none, cut", "thesis/closed-loop", (CUT,)),
    ("none, on accelerations", "thesis/closed-loop", (ON_ACCELERATIONS,)),
    ("none, Baumgarte", "thesis/closed-loop", (BAUMGARTE,)),
    ("velocities, Baumgarte", "thesis/closed-loop", (PUBLISHED, BAUMGARTE)),
    ("velocities, projected", "thesis/closed-loop", (PUBLISHED,)),
)


def open_ends(scenario, columns):
    """Times after the impact [s], and the distance of tip-2 from its grasp point [m], with the sphere fixed to tip-1.

    Where the planned angles are used this is the closure's own defect, so that the 1e-12 m by which the plan arrives
    does not hide it. The published angles miss both grasp points; what the loop lacks is the difference of the misses.
    """
    after = [i for i, phase in enumerate(columns["phase"]) if phase == "post_impact"]
    t0 = columns["time [s]"][after[0]]
    times = [columns["time [s]"][i] - t0 for i in after]
    if not scenario.endswith("published-angles"):
        return times, [columns["loops/tip-2/position_defect [m]"][i] for i in after]
    distances = []
    for i in after:
        w, z = (columns[f"targets/sphere/quaternion_wxyz/{c} [1]"][i] for c in "wz")
        angle = 2 * math.atan2(z, w)
        x, y = (columns[f"end_effectors/tip-2/position/{c} [m]"][i] - columns[f"end_effectors/tip-1/position/{c} [m]"][i]
                for c in "xy")
        # From the right grasp point, where tip-1 would be, to the left one: -1 m along the sphere's x axis.
        distances.append(math.hypot(x + math.cos(angle), y + math.sin(angle)))
    return times, distances
