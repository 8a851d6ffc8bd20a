"""Runs of the program for scripts/metamorphic, and outcomes: {name: (kind, numbers)} with kinds point (position in W),
vector (in W), axial (axial vector in W), attitude (quaternion of a body in W) and scalar."""
import copy
import csv
import json
import math
import subprocess

import metamorphic_geometry as g


class Failure(Exception):
    """The program did not run as expected."""


def execute(program, arguments, limit):
    try:
        done = subprocess.run([str(program), *map(str, arguments)], capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        raise Failure(f"{arguments[0]}: not finished after {limit} s") from None
    if done.returncode not in (0, 1, 3):
        raise Failure(f"{arguments[0]}: exit code {done.returncode}: {done.stderr.strip()[-600:]}")
    return done


def write(scenario, path):
    path.write_text(json.dumps(scenario, indent=1))
    return path


def run(program, scenario, folder, name, limit=120):
    path = write(scenario, folder / f"{name}.yaml")
    done = execute(program, ["run", path, "-o", folder / name, "--quiet"], limit)
    summary = folder / name / "summary.json"
    if not summary.exists():
        raise Failure(f"run: exit code {done.returncode} and no summary: {done.stderr.strip()[-600:]}")
    return json.loads(summary.read_text())


def outcome_of(summary):
    outcome = {}

    def put(name, kind, numbers):
        outcome[name] = (kind, list(numbers) if isinstance(numbers, list) else [numbers])

    def put_body(group, body):
        put(group + "/position", "point", body["position"])
        if "quaternion_wxyz" in body:
            put(group + "/attitude", "attitude", body["quaternion_wxyz"])
        put(group + "/velocity", "vector", body["velocity"])
        put(group + "/angular_velocity", "axial", body["angular_velocity"])

    impact = summary.get("impact") or {}
    for grasp in impact.get("grasps", []):
        if all(grasp.get("determined", [True])):
            put(f"grasp/{grasp['end_effector']}/impulse", "vector", grasp["impulse"])
            put(f"grasp/{grasp['end_effector']}/angular_impulse", "axial", grasp["angular_impulse"])
    for key in ("kinetic_energy_before", "kinetic_energy_after"):
        if key in impact:
            put(key, "scalar", impact[key])
    end = (summary.get("post_impact") or {}).get("end")
    if not end:
        return outcome
    put("time", "scalar", end["time"])
    put_body("base", end["base"])
    for i, joint in enumerate(end["joints"]["names"]):
        put(f"joint/{joint}/position", "scalar", end["joints"]["position"][i])
        put(f"joint/{joint}/velocity", "scalar", end["joints"]["velocity"][i])
    for effector in end["end_effectors"]:
        put_body("end_effector/" + effector["name"], effector)
    for target in end.get("targets", []):
        put_body("target/" + target["name"], target)
    return outcome


def features_of(scenario, summary):
    """Features of the scenario and events of its run, for the statistics."""
    robot, links = scenario["robot"], scenario["robot"]["links"]
    drives = summary.get("joints") or []
    present = {
        "arms": len(robot["end_effectors"]) > 1,
        "loops": len(scenario["grasps"]) > len(scenario["targets"]) and scenario["grasps"][0]["model"] != "contact",
        "contacts": scenario["grasps"][0]["model"] == "contact",
        "compliant": scenario["impact"].get("law") == "compliant",
        "approach": "approach" in scenario,
        "sampled": "control" in scenario,
        "sensors": "sensors" in scenario,
        "wheels": "wheels" in robot, "gyros": "gyros" in robot, "thrusters": "thrusters" in robot,
        "sprung panels": any("spring" in link["joint"] for link in links) or any("panels" in t for t in scenario["targets"]),
        "beams": any("beam" in link for link in links),
        "elastic gears": any("elasticity" in link["joint"] for link in links),
        "sticking friction": any(link["joint"].get("friction", {}).get("model") == "sticking" for link in links),
        "stuck": any(d["sticks"] > 0 for d in drives),
        "stops met": any(d["stop_impacts"] > 0 for d in drives),
        "gravity": "gravity" in scenario, "orbit": "orbit" in scenario, "loads": "external_wrenches" in scenario,
        "releases": "release" in scenario["post_impact"],
        "fixed bases": robot["base"]["mode"] == "fixed",
    }
    return [name for name, there in present.items() if there]


CHECKS = ("linear_momentum_drift", "angular_momentum_drift", "work_energy_residual", "energy_drift",
          "generalized_momentum_residual", "energy_identity_residual", "joint_position_violation")


def verdicts_of(summary):
    verdicts = {"status": summary["status"], "captured": (summary.get("capture") or {}).get("captured")}
    for check in CHECKS:
        verdicts[check] = (summary.get("ledger") or {}).get(check, {}).get("pass")
    return verdicts


def failed_checks(summary):
    ledger = summary.get("ledger") or {}
    return [f"{k} {v['value']:.3g} of {v['bound']:.3g}" for k, v in ledger.items()
            if isinstance(v, dict) and v.get("kind") == "conservation" and not v.get("pass")]


def difference(expected, found):
    """The largest deviation and its location: of positions, velocities and rates absolute, of impulses and energies
    relative to the largest, of attitudes as angles."""
    if set(expected) != set(found):
        return float("inf"), "other results: " + ", ".join(sorted(set(expected) ^ set(found)))[:200]
    sizes = {}
    for key, (_, x) in expected.items():
        group = key.split("/")[-1]
        if "impulse" in group or "energy" in group:
            sizes[group] = max([sizes.get(group, 1e-6)] + [abs(v) for v in x])
    worst, where = 0.0, ""
    for key, (kind, x) in expected.items():
        y = found[key][1]
        if kind == "attitude" and g.dot(x, y) < 0:
            y = g.scale(-1, y)
        size = sizes.get(key.split("/")[-1], 1.0)
        if kind != "attitude" and size == 1.0:
            size = max([1.0] + [abs(v) for v in x])
        off = max(abs(a - b) for a, b in zip(x, y)) / size
        if not off <= worst:
            worst, where = off, f"{key}: {y}, expected {x}"
    return worst, where


# --- Other programs than one run ---

def campaign_outcome(program, scenario, folder, name):
    """The columns of a campaign of two equal cases that a run's outcome also has."""
    write(scenario, folder / f"{name}.yaml")
    mass = scenario["targets"][0]["mass"]
    campaign = {"name": name, "scenario": f"{name}.yaml", "cases": 2, "success": ["ledger/pass"],
                "uncertain": [{"path": "targets[0].mass", "discrete": {"values": [mass]}}],
                "keep": {"columns": ["end", "grasps", "ledger"]}}
    path = write(campaign, folder / f"{name}-campaign.yaml")
    execute(program, ["campaign", path, "-o", folder / name, "--quiet"], 300)
    with open(folder / name / "table.csv") as table:
        row = next(csv.DictReader(table))
    if row["status"] != "ok":
        raise Failure(f"campaign: case 0 is {row['status']}: {row['reason']}")
    outcome = {}
    for column, value in row.items():
        parts = column.split(" [")[0].split("/")
        if parts[0] == "end" and parts[1] == "base":
            key, kind = "/".join(parts[1:-1]), "axial" if "angular" in parts[-2] else "vector"
        elif parts[0] == "grasps" and parts[2] in ("impulse", "angular_impulse"):
            key, kind = f"grasp/{parts[1]}/{parts[2]}", "vector"
        else:
            continue
        outcome.setdefault(key, (kind, []))[1].append(float(value))
    return outcome


def begin_from(scenario, end):
    """The scenario with the final state of a summary's phase as initial state."""
    def put(state, body):
        for key in ("position", "quaternion_wxyz", "velocity", "angular_velocity"):
            if key in state:
                state[key] = body[key]
    put(scenario["initial"]["base"], end["base"])
    for i, joint in enumerate(end["joints"]["names"]):
        scenario["initial"]["joints"][joint] = end["joints"]["position"][i]
        scenario["initial"]["joint_rates"][joint] = end["joints"]["velocity"][i]
    for target in scenario["targets"]:
        put(target["state"], next(t for t in end["targets"] if t["name"] == target["name"]))


def shifted(program, scenario, summary, folder, name):
    """The scenario without its approach, from the final state of the approach."""
    scenario = copy.deepcopy(scenario)
    duration = scenario.pop("approach")["duration"]
    begin_from(scenario, summary["approach"]["end"])
    for load in scenario.get("external_wrenches", []):
        time = load["time"]
        for key in ("start", "end"):
            if key in time:
                time[key] -= duration
        if time["shape"] == "sine":
            time["phase"] += 2 * math.pi * time["frequency"] * duration
    outcome = outcome_of(run(program, scenario, folder, name))
    outcome["time"] = ("scalar", [outcome["time"][1][0] + duration])
    return outcome


def continued(program, scenario, folder, name):
    """The scenario in two runs, the second from the final state of the first."""
    first, second = copy.deepcopy(scenario), copy.deepcopy(scenario)
    whole = scenario["post_impact"]["duration"]
    first["post_impact"]["duration"] = second["post_impact"]["duration"] = whole / 2
    begin_from(second, run(program, first, folder, name + "-first")["post_impact"]["end"])
    second["impact"]["joints"] = "free"
    outcome = outcome_of(run(program, second, folder, name))
    outcome["time"] = ("scalar", [whole])
    return outcome
