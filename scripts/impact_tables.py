"""Tables of docs/validation/thesis-impulse.md: relative speed, angle of approach, mass. Standard library only.

Used by scripts/validation. The conclusions about the thesis's section 4.3 rest on these.
"""
import math
import re

from impact_studies import (ANGLE, CASES, GRIPS, MOTION, ROOT, SPEED, affine_residual, along_speed, angles_of, angular_impulse, bend,
                            distance, families, impact_of, impulse, joints, magnitude, sweep)
from markdown_table import number, small, table

# Cases of studies/thesis-open-loop-fixed.yaml: the spins of case 1 in both senses, and at rest.
REVERSED = "case 1 reversed"


def per_cent(x):
    return "below 0.01 %" if x < 1e-4 else f"{100 * x:.2f} %" if x < 0.0995 else f"{100 * x:.0f} %"


def outputs(row):
    """Quantities that are compared separately because of their units: impulses of both grasps [N s], angular impulses [N m s]."""
    return ([x for g in GRIPS for x in impulse(row, g)], [x for g in GRIPS for x in angular_impulse(row, g)])


def fixed_rows(rows):
    """The table of the fixed configurations with numbers for angles, as those of the other studies."""
    return [{**r, ANGLE: float(r["approach_angle"].split()[0])} for r in rows]


def exact(fixed):
    """Relations that hold at a fixed configuration, to within rounding error."""
    rows = []
    grid, scaled = sweep("thesis-affine"), sweep("thesis-scaled")
    for loop in ("open", "closed"):
        points = [r for r in grid if r["loop"] == loop]
        twist = [f"targets[0].state.{q}[{i}]" for q in ("velocity", "angular_velocity") for i in range(3)]
        worst = max(affine_residual(points, twist, lambda r, k=k: outputs(r)[k]) for k in (0, 1))
        rows.append((f"P is affine in all six components of a target's twist, {loop} loop", "`thesis-affine`", len(points),
                     small(worst, 1e-12)))
    for loop in ("open", "closed"):
        points = [r for r in scaled if r["loop"] == loop]
        one = next(r for r in points if r["factor"] == 1)
        worst = max(distance([x / r["factor"] for x in outputs(r)[k]], outputs(one)[k]) / math.hypot(*outputs(one)[k])
                    for r in points for k in (0, 1))
        rows.append((f"P is proportional when all of the relative twist is scaled, from 0.01 to 10, {loop} loop", "`thesis-scaled`",
                     len(points), small(worst, 1e-12)))
    worst, mean = 0.0, 0.0
    for angle in angles_of(fixed):
        for grasp in GRIPS:
            for case in (*CASES, REVERSED):
                points = along_speed(fixed, case, angle)
                worst = max(worst, bend([r[SPEED] for r in points], [impulse(r, grasp) for r in points]))
            for a, b, rest in zip(*(along_speed(fixed, c, angle) for c in ("case 1", REVERSED, "case 2"))):
                sums = [(x + y) / 2 for x, y in zip(impulse(a, grasp), impulse(b, grasp))]
                mean = max(mean, distance(sums, impulse(rest, grasp)) / max(magnitude(a, grasp), magnitude(b, grasp)))
    rows.append(("P against the relative speed is a straight line in space", "`thesis-open-loop-fixed`", len(fixed), small(worst, 1e-12)))
    rows.append(("P for targets at rest is the mean of P for opposite spins", "`thesis-open-loop-fixed`",
                 sum(r[MOTION] in ("case 1", REVERSED, "case 2") for r in fixed), small(mean, 1e-12)))
    return table(("at a fixed configuration", "study", "points", "largest deviation, over the largest P"), rows)


SPEEDS = (0.0, 0.1, 0.2)


def curve_cells(points, grasp, with_vector):
    """|P| at three speeds, and the deviations of |P| and of the vector P from a straight line."""
    speeds = [r[SPEED] for r in points]
    cells = [number(magnitude(next(r for r in points if abs(r[SPEED] - v) < 1e-9), grasp), 3) for v in SPEEDS]
    cells.append(per_cent(bend(speeds, [[magnitude(r, grasp)] for r in points])))
    if with_vector:
        cells.append(per_cent(bend(speeds, [impulse(r, grasp) for r in points])))
    return cells


def against_speed(rows, cases, with_approach):
    """|P| against relative speed by case and angle. With an approach the configuration differs from point to point."""
    lines = []
    for case in cases:
        for angle in angles_of(rows):
            points = along_speed(rows, case, angle)
            cells = [case, f"{angle:.0f}°"]
            for grasp in GRIPS:
                cells += curve_cells(points, grasp, with_approach)
            if with_approach:
                cells.append(f"{max(max(q) - min(q) for q in zip(*map(joints, points))):.2f}")
            lines.append(cells)
    head = ["case", "θ_e"]
    for i in (1, 2):
        head += [f"grasp {i}: \\|P\\| at 0 [N s]", "0.1 m/s", "0.2 m/s", "nonlinearity of \\|P\\|"] + (["nonlinearity of P"] if with_approach else [])
    return table(head + (["largest change of a joint [rad]"] if with_approach else []), lines)


def closed_fixed():
    rows = {r["motion of the target, relative speed"]: r for r in sweep("thesis-closed-loop-fixed")}
    lines = []
    for case in CASES[:3]:
        points = [rows[f"{case}, {v:g} m/s"] for v in SPEEDS]
        cells = [case]
        for grasp in GRIPS:
            cells += [number(magnitude(r, grasp), 3) for r in points]
            cells.append(small(bend(SPEEDS, [impulse(r, grasp) for r in points]), 1e-12))
        lines.append(cells)
    return table(("case", "grasp 1: \\|P\\| at 0 [N s]", "0.1 m/s", "0.2 m/s", "nonlinearity of P", "grasp 2: \\|P\\| at 0 [N s]", "0.1 m/s", "0.2 m/s",
                  "nonlinearity of P"), lines)


# For each case: whether a grasp holds a spinning target.
SPINNING = {"open": (("case 1", "tip-1"), ("case 1", "tip-2"), ("case 3", "tip-1"), ("case 3", "tip-2"), ("case 4", "tip-2")),
            "closed": tuple((c, g) for c in ("case 1", "case 3", "case 4") for g in GRIPS)}


def rotating(tables):
    """Number of points at which a spinning target needs a larger impulse than one at rest, at the same angle and relative speed."""
    lines = []
    for loop, rows in tables.items():
        for angle in angles_of(rows):
            rest = along_speed(rows, "case 2", angle)
            ratios = [magnitude(a, grasp) / magnitude(b, grasp) for case, grasp in SPINNING[loop]
                      for a, b in zip(along_speed(rows, case, angle), rest) if b[SPEED] > 0]
            more = sum(x > 1 for x in ratios)
            lines.append((loop, f"{angle:.0f}°", f"{more} of {len(ratios)}", f"{min(ratios):.3f}", f"{max(ratios):.3f}"))
    return table(("loop", "θ_e", "larger for the spinning target", "minimum ratio", "maximum ratio"), lines)


def elbow():
    """Case 1 at -10 degrees, where arm 1 is nearly stretched out: as the search finds it, and followed from 0.085 m/s."""
    rows = sweep("thesis-open-loop-edge")
    lines = []
    for speed in sorted({r[SPEED] for r in rows}):
        cells = [number(speed, 3)]
        for search in ("as found", "followed"):
            r = next(r for r in rows if r["search"] == search and r[SPEED] == speed)
            if r["status"] != "ok":
                cells += ["not found"] + [""] * 3
                continue
            cells += [number(magnitude(r, "tip-1")), f"{joints(r)[1]:.2f}", f"{joints(r)[4]:.2f}", number(r["kinetic_energy_before [J]"], 3)]
        lines.append(cells)
    head = ["relative speed [m/s]"]
    for search in ("as found", "followed"):
        head += [f"{search}: \\|P\\| at grasp 1 [N s]", "elbow 1 [rad]", "elbow 2 [rad]", "kinetic energy before [J]"]
    return table(head, lines)


def against_angle():
    """Results of the fine grids of the angle. Slow: unreachable angles take the most time."""
    lines = []
    for loop in ("open", "closed"):
        rows = sweep(f"thesis-{loop}-loop-angle")
        for case in CASES:
            points = [r for r in rows if r[MOTION] == case]
            main = next(p for p in families(points) if p[0][ANGLE] <= 0 <= p[-1][ANGLE])
            lost = [r[ANGLE] for r in points if r["status"] != "ok"]
            cells = [loop, case, f"{main[0][ANGLE]:.0f}° to {main[-1][ANGLE]:.0f}°", ", ".join(f"{a:.0f}°" for a in lost) or "none"]
            for grasp in GRIPS:
                least, most = min(main, key=lambda r: magnitude(r, grasp)), max(main, key=lambda r: magnitude(r, grasp))
                cells += [f"{number(magnitude(r, grasp), 3)} at {r[ANGLE]:.0f}°" for r in (least, most)]
            lines.append(cells)
    return table(("loop", "case", "one family of configurations", "unreachable", "grasp 1: minimum \\|P\\| [N s]", "maximum", "grasp 2: minimum",
                  "maximum"), lines)


SEVEN_JOINTS = "seven-joint-dual-capture"


def rotate(q, v):
    """A vector rotated by a quaternion (w, x, y, z)."""
    w, *u = q
    cross = lambda a, b: [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    t = [2 * x for x in cross(u, v)]
    return [a + w * b + c for a, b, c in zip(v, t, cross(u, t))]


def light_target_limit(impact, coms):
    """Limit of |P| over the target's mass for zero mass [m/s]: the target adopts the end-effector's motion, per grasp."""
    limits = []
    for grasp, target, com in zip(impact["grasps"], impact["targets_before"], coms):
        v, w = grasp["relative_velocity_before"], grasp["relative_angular_velocity_before"]
        r = [a + b - c for a, b, c in zip(rotate(target["quaternion_wxyz"], com), target["position"], grasp["contact_point"])]
        limits.append(math.hypot(v[0] + w[1] * r[2] - w[2] * r[1], v[1] + w[2] * r[0] - w[0] * r[2], v[2] + w[0] * r[1] - w[1] * r[0]))
    return limits


def mass_ratio():
    """Impulses and the base's disturbance from light to heavy targets, in three dimensions."""
    scenario = (ROOT / "scenarios" / f"{SEVEN_JOINTS}.yaml").read_text()
    robot = (ROOT / "robots" / "seven-joint-dual-arm.yaml").read_text()
    servicer = sum(float(m) for m in re.findall(r"^ +mass: ([0-9.]+)", robot, re.M))
    first = [float(x) for x in re.search(r"^    com: \[(.*?)\]", scenario, re.M).group(1).split(",")]
    limits = light_target_limit(impact_of(SEVEN_JOINTS), (first, (0.0, 0.0, 0.0)))
    lines = [("limit 0, by hand calculation", "", "", *(number(x, 5) for x in limits), "", "")]
    for r in sweep("mass-ratio"):
        decade = math.log10(r["mass_ratio [1]"])
        if abs(decade - round(decade)) > 1e-6:
            continue
        base = [math.hypot(*(r[f"base/{q}/{c} [{u}]"] for c in "xyz")) for q, u in (("velocity_change", "m/s"), ("angular_velocity_change", "rad/s"))]
        mass = servicer * r["mass_ratio [1]"]
        lines.append((f"1e{round(decade)}", *(number(magnitude(r, g)) for g in GRIPS), *(number(magnitude(r, g) / mass, 5) for g in GRIPS),
                      *(number(x) for x in base)))
    return table(("mass ratio", "grasp 1: \\|P\\| [N s]", "grasp 2: \\|P\\| [N s]", "grasp 1: \\|P\\| / target's mass [m/s]", "grasp 2 [m/s]",
                  "change of the base's velocity [m/s]", "of its angular velocity [rad/s]"), lines)


def blocks():
    """The generated blocks by name."""
    fixed = fixed_rows(sweep("thesis-open-loop-fixed"))
    tables = {loop: sweep(f"thesis-{loop}-loop") for loop in ("open", "closed")}
    return {"impulse-exact": exact(fixed), "impulse-fixed": against_speed(fixed, (*CASES, REVERSED), False),
            "impulse-closed-fixed": closed_fixed(), "impulse-open": against_speed(tables["open"], CASES, True),
            "impulse-closed": against_speed(tables["closed"], CASES, True), "impulse-rotating": rotating(tables),
            "mass-ratio": mass_ratio()}


def long_blocks():
    """Blocks that take longer, or depend on rounding errors near a singular configuration."""
    return {"impulse-angle": against_angle(), "impulse-elbow": elbow()}
