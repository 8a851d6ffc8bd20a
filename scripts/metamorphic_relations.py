"""The relations of scripts/metamorphic: a changed scenario, and the relation of its results to those of the original.

A relation is a function of a scenario (a copy, which it may change) and a random generator. It returns the changed
scenario and a map of outcomes, or None where it does not apply. Outcomes are described in metamorphic_runs.py.
"""
import copy
import decimal

import metamorphic_geometry as g
import metamorphic_scenarios as s

RELATIONS = {}


def relation(bound=1e-6, **settings):
    def add(function):
        RELATIONS[function.__name__] = {"change": function, "bound": bound, "doc": function.__doc__.split("\n")[0], **settings}
        return function
    return add


def same(outcome):
    return outcome


def comparable_impulses(scenario):
    """Angular impulses of a compliant impact are about a point that moves with the base's origin at t = 0: they are comparable only for equal motion of the base."""
    compliant = scenario["impact"].get("law") == "compliant"
    return lambda o: {k: x for k, x in o.items() if not (compliant and k.endswith("/angular_impulse"))}


def noisy(scenario):
    sensors = scenario.get("sensors", {})
    return sensors.get("joints", {}).get("noise", 0) > 0 or sensors.get("attitude", {}).get("noise", 0) > 0


def targets_and_base(scenario):
    return [scenario["initial"]["base"]] + [t["state"] for t in scenario["targets"]]


# --- The world ---

def world_vectors(scenario):
    """(mapping, key, is an axial vector) of vectors in W other than positions."""
    for state in targets_and_base(scenario):
        for key in ("velocity", "angular_velocity"):
            if key in state:
                yield state, key, key == "angular_velocity"
    if "gravity" in scenario:
        yield scenario, "gravity", False
    if "orbit" in scenario:
        yield scenario["orbit"], "radial", False
        yield scenario["orbit"], "along_track", False
    for load in scenario.get("external_wrenches", []):
        if load["frame"] == "world":
            yield load, "force", False
            yield load, "torque", True


@relation()
def rotated_world(scenario, random):
    """All bodies are rotated in W."""
    q = s.Draw(random).quaternion()
    for state in targets_and_base(scenario):
        state["position"] = g.turn(q, state["position"])
        state["quaternion_wxyz"] = g.multiply(q, state["quaternion_wxyz"])
    for mapping, key, _ in world_vectors(scenario):
        mapping[key] = g.turn(q, mapping[key])

    def expect(outcome):
        turned = {"point": lambda x: g.turn(q, x), "vector": lambda x: g.turn(q, x), "axial": lambda x: g.turn(q, x),
                  "attitude": lambda x: g.multiply(q, x)}
        return {key: (kind, turned.get(kind, same)(x)) for key, (kind, x) in outcome.items()}
    return scenario, expect


@relation()
def shifted_world(scenario, random):
    """All bodies are displaced in W."""
    if "orbit" in scenario:
        return None
    offset = s.Draw(random).vector(20)
    for state in targets_and_base(scenario):
        state["position"] = g.add(state["position"], offset)
    return scenario, lambda o: {k: (kind, g.add(x, offset) if kind == "point" else x) for k, (kind, x) in o.items()}


@relation()
def boosted_frame(scenario, random):
    """All bodies have the same additional velocity."""
    if "orbit" in scenario or scenario["robot"]["base"]["mode"] != "free":
        return None
    v = s.Draw(random).vector(1)
    for state in targets_and_base(scenario):
        state["velocity"] = g.add(state["velocity"], v)

    def expect(o):
        t = o["time"][1][0]
        moved = {k: (kind, g.add(x, g.scale(t, v)) if kind == "point" else g.add(x, v) if kind == "vector" and
                     k.endswith("/velocity") else x) for k, (kind, x) in o.items()}
        return {k: x for k, x in moved.items() if not k.startswith("kinetic_energy")}
    return scenario, expect


def mirrored(v):
    return [v[0], -v[1], v[2]]


def mirrored_axial(v):
    return [-v[0], v[1], -v[2]]


def mirrored_attitude(q):
    return [q[0]] + mirrored_axial(q[1:])


def mirror_pose(place):
    place["position"] = mirrored(place["position"])
    if "quaternion_wxyz" in place:
        place["quaternion_wxyz"] = mirrored_attitude(place["quaternion_wxyz"])


def mirror_body(body):
    body["com"] = mirrored(body["com"])
    xx, yy, zz, xy, xz, yz = body["inertia"]
    body["inertia"] = [xx, yy, zz, -xy, xz, -yz]


@relation()
def mirrored_scene(scenario, random):
    """All bodies are mirrored in the plane y = 0 of their frames."""
    if noisy(scenario):
        return None
    robot = scenario["robot"]
    mirror_body(robot["base"])
    for link in robot["links"]:
        mirror_body(link)
        mirror_pose(link["joint"]["origin"])
        if "axis" in link["joint"]:
            flip = mirrored if link["joint"]["type"] == "prismatic" else mirrored_axial
            link["joint"]["axis"] = flip(link["joint"]["axis"])
        for key in ("from", "to", "section_y") if "beam" in link else ():
            link["beam"][key] = mirrored(link["beam"][key])
    for effector in robot["end_effectors"]:
        mirror_pose(effector)
    for wheel in robot.get("wheels", []):
        wheel["axis"] = mirrored_axial(wheel["axis"])
    for gyro in robot.get("gyros", []):
        gyro["gimbal_axis"], gyro["spin_axis"] = mirrored_axial(gyro["gimbal_axis"]), mirrored_axial(gyro["spin_axis"])
    for thruster in robot.get("thrusters", []):
        thruster["position"], thruster["direction"] = mirrored(thruster["position"]), mirrored(thruster["direction"])
    for state in targets_and_base(scenario):
        mirror_pose(state)
    for mapping, key, axial in world_vectors(scenario):
        mapping[key] = (mirrored_axial if axial else mirrored)(mapping[key])
    for load in scenario.get("external_wrenches", []):
        load["position"] = mirrored(load["position"])
        if load["frame"] == "body":
            load["force"], load["torque"] = mirrored(load["force"]), mirrored_axial(load["torque"])
    for target in scenario["targets"]:
        mirror_body(target)
        for point in target["grasp_points"]:
            point["position"] = mirrored(point["position"])
            if "normal" in point:
                point["normal"] = mirrored(point["normal"])
        for panel in target.get("panels", []):
            mirror_body(panel)
            mirror_pose(panel["origin"])
            panel["hinge_axis"] = mirrored_axial(panel["hinge_axis"])
    for grasp in scenario["grasps"]:
        if "axis" in grasp:
            grasp["axis"] = mirrored_axial(grasp["axis"])
    for sensor in ("gyro", "attitude"):
        if sensor in scenario.get("sensors", {}):
            scenario["sensors"][sensor]["bias"] = mirrored_axial(scenario["sensors"][sensor]["bias"])

    def expect(outcome):
        flips = {"point": mirrored, "vector": mirrored, "axial": mirrored_axial, "attitude": mirrored_attitude}
        return {key: (kind, flips.get(kind, same)(x)) for key, (kind, x) in outcome.items()}
    return scenario, expect


# --- Units ---

@relation()
def scaled_units(scenario, random):
    """Other units of length, mass and time."""
    if "orbit" in scenario or noisy(scenario):
        return None
    d = s.Draw(random)
    L, M, T = d.decades(0.5, 2), d.decades(0.3, 3), d.decades(0.5, 2)
    units = {"m": L, "kg": M, "s": T, "kg m^2": M * L * L, "m/s": L / T, "1/s": 1 / T, "m/s^2": L / T**2, "N": M * L / T**2,
             "N m": M * L * L / T**2, "N m/rad": M * L * L / T**2, "N m s/rad": M * L * L / T, "N/m": M / T**2, "N s/m": M / T,
             "N s": M * L / T, "N m s": M * L * L / T, "J": M * L * L / T**2, "N m^2": M * L**3 / T**2, "1/s^2": 1 / T**2}

    def change(mapping, key, unit):
        if key not in mapping:
            return
        value, factor = mapping[key], units[unit]
        mapping[key] = [factor * x for x in value] if isinstance(value, list) else factor * value

    def body(b):
        change(b, "mass", "kg"), change(b, "com", "m"), change(b, "inertia", "kg m^2")

    robot, joints = scenario["robot"], {}
    body(robot["base"])
    for link in robot["links"]:
        body(link)
        joint = link["joint"]
        change(joint["origin"], "position", "m")
        for key, unit in (("from", "m"), ("to", "m"), ("bending_stiffness_y", "N m^2"), ("bending_stiffness_z", "N m^2"),
                          ("fastest_mode", "1/s")):
            change(link.get("beam", {}), key, unit)
        joints[joint["name"]] = slides = joint["type"] == "prismatic"
        limits, friction, spring = joint.get("limits", {}), joint.get("friction", {}), joint.get("spring", {})
        for key in ("lower", "upper"):
            change(limits, key, "m") if slides else None
        if "stop" in limits:
            change(limits["stop"], "rest_rate", "m/s" if slides else "1/s")
        change(friction, "viscous", "N s/m" if slides else "N m s/rad")
        change(friction, "coulomb", "N" if slides else "N m")
        change(friction, "static", "N" if slides else "N m")
        change(friction, "transition_rate", "m/s" if slides else "1/s")
        change(joint, "rotor_inertia", "kg m^2")
        if slides and "gear_ratio" in joint:
            joint["gear_ratio"] /= L
        for one in (spring, joint.get("elasticity", {})):
            change(one, "stiffness", "N/m" if slides else "N m/rad")
            change(one, "damping", "N s/m" if slides else "N m s/rad")
    for effector in robot["end_effectors"]:
        change(effector, "position", "m")
    for wheel in robot.get("wheels", []):
        change(wheel, "inertia", "kg m^2"), change(wheel, "torque", "N m"), change(wheel, "rate", "1/s")
    for gyro in robot.get("gyros", []):
        gyro.setdefault("bandwidth", 20)
        change(gyro, "inertia", "kg m^2"), change(gyro, "gimbal_inertia", "kg m^2"), change(gyro, "spin_rate", "1/s")
        change(gyro, "rate", "1/s"), change(gyro, "bandwidth", "1/s")
    for thruster in robot.get("thrusters", []):
        change(thruster, "position", "m"), change(thruster, "force", "N"), change(thruster, "min_on_time", "s")
    initial = scenario["initial"]
    for name in initial["joints"]:
        if joints[name]:
            change(initial["joints"], name, "m")
        change(initial["joint_rates"], name, "m/s" if joints[name] else "1/s")
    change(initial, "wheel_rates", "1/s")
    for state in targets_and_base(scenario):
        change(state, "position", "m"), change(state, "velocity", "m/s"), change(state, "angular_velocity", "1/s")
    change(scenario, "gravity", "m/s^2")
    for target in scenario["targets"]:
        body(target)
        for point in target["grasp_points"]:
            change(point, "position", "m")
        for panel in target.get("panels", []):
            body(panel), change(panel["origin"], "position", "m")
            change(panel["hinge"], "stiffness", "N m/rad"), change(panel["hinge"], "damping", "N m s/rad")
    for load in scenario.get("external_wrenches", []):
        change(load, "position", "m"), change(load, "force", "N"), change(load, "torque", "N m")
        change(load["time"], "start", "s"), change(load["time"], "end", "s"), change(load["time"], "frequency", "1/s")
    impact = scenario["impact"]
    change(impact, "duration", "s"), change(impact, "longest", "s")
    if "grasp" in impact:
        change(impact["grasp"], "linear_stiffness", "N/m"), change(impact["grasp"], "linear_damping", "N s/m")
        change(impact["grasp"], "angular_stiffness", "N m/rad"), change(impact["grasp"], "angular_damping", "N m s/rad")
    if "approach" in scenario:
        change(scenario["approach"], "duration", "s")
        for name in scenario["approach"]["final_joints"]:
            if joints[name]:
                change(scenario["approach"]["final_joints"], name, "m")
        for gain, unit in (("kp", "1/s^2"), ("kd", "1/s")):
            for name in scenario["approach"].get("tracking", {}).get(gain, {}):
                change(scenario["approach"]["tracking"][gain], name, unit)
    post = scenario["post_impact"]
    change(post, "duration", "s")
    computed = post["joints"] == "computed_torque"
    for name in post.get("kp", {}):
        change(post["kp"], name, "1/s^2" if computed else "N/m" if joints[name] else "N m/rad")
        change(post["kd"], name, "1/s" if computed else "N s/m" if joints[name] else "N m s/rad")
    if "move" in post:
        change(post["move"], "duration", "s")
        for name in post["move"]["joints"]:
            if joints[name]:
                change(post["move"]["joints"], name, "m")
    for release in post.get("release", []):
        change(release, "after", "s")
    if "base_control" in post:
        control = post["base_control"]
        change(control, "kp", "N m/rad"), change(control, "kd", "N m s/rad"), change(control, "limit", "N m")
    change(scenario.get("control", {}), "period", "s"), change(scenario.get("control", {}), "delay", "s")
    sensors = scenario.get("sensors", {})
    for name in sensors.get("joints", {}).get("bias", {}):
        if joints[name]:
            change(sensors["joints"]["bias"], name, "m")
    change(sensors.get("gyro", {}), "bias", "1/s")
    change(scenario["output"], "interval", "s")

    def expect(outcome):
        def unit_of(key, kind):
            if key.startswith("joint/"):
                slides = joints[key.split("/")[1]]
                return {"position": "m" if slides else None, "velocity": "m/s" if slides else "1/s"}[key.split("/")[2]]
            if key in ("time",):
                return "s"
            if key.startswith("kinetic_energy"):
                return "J"
            if key.endswith("angular_impulse"):
                return "N m s"
            if key.endswith("impulse"):
                return "N s"
            return {"point": "m", "vector": "m/s", "axial": "1/s"}.get(kind)
        result = {}
        for key, (kind, x) in outcome.items():
            unit = unit_of(key, kind)
            result[key] = (kind, g.scale(units[unit], x) if unit else x)
        return result
    return scenario, expect


def with_unit(value, exponent, unit):
    """A number with a unit that is a power of ten, without rounding."""
    return f"{decimal.Decimal(repr(float(value))).scaleb(exponent):f} {unit}"


@relation(bound=0, bits=True)
def units_in_files(scenario, random):
    """Numbers are written with units."""
    robot = scenario["robot"]
    for body in [robot["base"]] + robot["links"] + scenario["targets"]:
        body["mass"] = with_unit(body["mass"], 3, "g")
        body["com"] = [with_unit(x, 3, "mm") for x in body["com"]]
        body["inertia"] = [with_unit(x, 3, "g m^2") for x in body["inertia"]]
    for state in targets_and_base(scenario):
        state["position"] = [with_unit(x, 2, "cm") for x in state["position"]]
        if "angular_velocity" in state:
            state["angular_velocity"] = [with_unit(x, 3, "mrad/s") for x in state["angular_velocity"]]
    for name, joint in s.joints_of(scenario).items():
        unit = "mm" if joint["type"] == "prismatic" else "mrad"
        scenario["initial"]["joints"][name] = with_unit(scenario["initial"]["joints"][name], 3, unit)
    scenario["post_impact"]["duration"] = with_unit(scenario["post_impact"]["duration"], 3, "ms")
    if "control" in scenario:
        scenario["control"]["period"] = with_unit(scenario["control"]["period"], 6, "us")
    return scenario, same


# --- Names and orders ---

def renamed(value, names, key=None):
    if isinstance(value, dict):
        return {names.get(k, k): renamed(v, names, k) for k, v in value.items()}
    if isinstance(value, list):
        return [renamed(v, names, key) for v in value]
    return names.get(value, value) if isinstance(value, str) and key not in ("mode", "type", "model", "law", "shape") else value


@relation(bound=0, bits=True)
def renamed_bodies(scenario, random):
    """Bodies, joints, end-effectors, targets and grasp points have other names, in another alphabetical order."""
    robot = scenario["robot"]
    old = [x["name"] for x in robot["links"] + robot["end_effectors"] + scenario["targets"]]
    old += [link["joint"]["name"] for link in robot["links"]]
    old += [x["name"] for key in ("wheels", "gyros", "thrusters") for x in robot.get(key, [])]
    old += [p["name"] for t in scenario["targets"] for p in t["grasp_points"] + t.get("panels", [])]
    order = list(range(len(old)))
    random.shuffle(order)
    names = {name: f"n{i:03d}" for name, i in zip(old, order)}

    def expect(outcome):
        return {"/".join(names.get(part, part) for part in key.split("/")): x for key, x in outcome.items()}
    return renamed(scenario, names), expect


@relation()
def permuted_bodies(scenario, random):
    """Links, end-effectors, targets, grasps, wheels, gyros and thrusters are listed in another order."""
    if noisy(scenario):
        return None
    robot, initial = scenario["robot"], scenario["initial"]
    for key, of_initial in (("wheels", "wheel_rates"), ("gyros", "gimbal_angles"), ("thrusters", None)):
        if key in robot:
            order = list(range(len(robot[key])))
            random.shuffle(order)
            robot[key] = [robot[key][i] for i in order]
            if of_initial in initial:
                initial[of_initial] = [initial[of_initial][i] for i in order]
    for owner, key in ((robot, "links"), (robot, "end_effectors"), (scenario, "targets"), (scenario, "grasps")):
        random.shuffle(owner[key])
    return scenario, same


# --- Frames and bodies ---

@relation()
def moved_target_frame(scenario, random):
    """The target's frame has another origin and other axes in the target."""
    d = s.Draw(random)
    target = scenario["targets"][0]
    X = (d.vector(0.5), d.quaternion())  # of the new frame in the old one
    back = g.inverse(X)
    state = target["state"]
    old = (state["position"], state["quaternion_wxyz"])
    new = g.compose(old, X)
    state["velocity"] = g.add(state["velocity"], g.cross(state["angular_velocity"], g.sub(new[0], old[0])))
    state["position"], state["quaternion_wxyz"] = new
    place = lambda p: g.compose(back, (p, [1, 0, 0, 0]))[0]
    target["com"], target["inertia"] = place(target["com"]), g.turn_inertia(back[1], target["inertia"])
    for point in target["grasp_points"]:
        point["position"] = place(point["position"])
        if "normal" in point:
            point["normal"] = g.unit(g.turn(back[1], point["normal"]))
    for panel in target.get("panels", []):
        origin = g.compose(back, (panel["origin"]["position"], panel["origin"]["quaternion_wxyz"]))
        panel["origin"] = {"position": origin[0], "quaternion_wxyz": origin[1]}
    for load in scenario.get("external_wrenches", []):
        if load.get("target") == target["name"]:
            load["position"] = place(load["position"])
            if load["frame"] == "body":
                load["force"], load["torque"] = g.turn(back[1], load["force"]), g.turn(back[1], load["torque"])
    name = "target/" + target["name"]

    def expect(o):
        result = dict(o)
        if name + "/position" in o:
            X_WT = g.compose((o[name + "/position"][1], o[name + "/attitude"][1]), X)
            arm = g.sub(X_WT[0], o[name + "/position"][1])
            result[name + "/position"], result[name + "/attitude"] = ("point", X_WT[0]), ("attitude", X_WT[1])
            result[name + "/velocity"] = ("vector", g.add(o[name + "/velocity"][1],
                                                          g.cross(o[name + "/angular_velocity"][1], arm)))
        return result
    return scenario, expect


@relation()
def moved_link_frames(scenario, random):
    """Links have other axes, along which their joints, children and shapes are stated."""
    d = s.Draw(random)
    robot = scenario["robot"]
    turns = {}
    for link in robot["links"]:
        q = turns[link["name"]] = d.quaternion()  # of the new axes in the old ones
        link["joint"]["origin"]["quaternion_wxyz"] = g.multiply(link["joint"]["origin"]["quaternion_wxyz"], q)
        back = g.conjugate(q)
        if "axis" in link["joint"]:
            link["joint"]["axis"] = g.unit(g.turn(back, link["joint"]["axis"]))
        link["com"], link["inertia"] = g.turn(back, link["com"]), g.turn_inertia(back, link["inertia"])
        for key in ("from", "to", "section_y") if "beam" in link else ():
            link["beam"][key] = g.turn(back, link["beam"][key])
    for link in robot["links"]:
        if link["parent"] in turns:
            back, origin = g.conjugate(turns[link["parent"]]), link["joint"]["origin"]
            origin["position"] = g.turn(back, origin["position"])
            origin["quaternion_wxyz"] = g.multiply(back, origin["quaternion_wxyz"])
    for effector in robot["end_effectors"]:
        back = g.conjugate(turns[effector["link"]])
        effector["position"] = g.turn(back, effector["position"])
        effector["quaternion_wxyz"] = g.multiply(back, effector["quaternion_wxyz"])
    for load in scenario.get("external_wrenches", []):
        if load.get("body") in turns:
            back = g.conjugate(turns[load["body"]])
            load["position"] = g.turn(back, load["position"])
            if load["frame"] == "body":
                load["force"], load["torque"] = g.turn(back, load["force"]), g.turn(back, load["torque"])
    return scenario, same


@relation()
def moved_base_frame(scenario, random):
    """The base's frame has another origin in the base."""
    d = s.Draw(random)
    robot, state = scenario["robot"], scenario["initial"]["base"]
    offset = d.vector(0.5)
    arm = g.turn(state["quaternion_wxyz"], offset)
    state["position"] = g.add(state["position"], arm)
    if "velocity" in state:
        state["velocity"] = g.add(state["velocity"], g.cross(state["angular_velocity"], arm))
    robot["base"]["com"] = g.sub(robot["base"]["com"], offset)
    for link in robot["links"]:
        if link["parent"] == "base":
            link["joint"]["origin"]["position"] = g.sub(link["joint"]["origin"]["position"], offset)
    for thruster in robot.get("thrusters", []):
        thruster["position"] = g.sub(thruster["position"], offset)

    known = comparable_impulses(scenario)

    def expect(o):
        moved = known(o)
        arm = g.turn(o["base/attitude"][1], offset)
        moved["base/position"] = ("point", g.add(o["base/position"][1], arm))
        moved["base/velocity"] = ("vector", g.add(o["base/velocity"][1], g.cross(o["base/angular_velocity"][1], arm)))
        return moved
    return scenario, expect


@relation()
def split_bodies(scenario, random):
    """A part of the base and of each link becomes a separate link on a fixed joint."""
    d = s.Draw(random)
    robot = scenario["robot"]
    parts = []
    for body in [robot["base"]] + robot["links"]:
        if "rotor_inertia" in body.get("joint", {}) or "elasticity" in body.get("joint", {}) or "beam" in body:
            continue
        mass, share = body["mass"], d.between(0.1, 0.6)
        apart = d.vector(0.05)  # from the rest to the part
        inertia = g.sub(body["inertia"], g.point_inertia(mass * share * (1 - share), apart))
        name = body.get("name", "base")
        X = (d.vector(0.3), d.quaternion())
        com = g.add(body["com"], g.scale(1 - share, apart))
        back = g.inverse(X)
        parts.append({"name": name + "-part", "parent": name, "mass": mass * share,
                      "joint": {"name": name + "-weld", "type": "fixed",
                                "origin": {"position": X[0], "quaternion_wxyz": X[1]}},
                      "com": g.compose(back, (com, [1, 0, 0, 0]))[0],
                      "inertia": g.turn_inertia(back[1], g.scale(share, inertia))})
        body["mass"], body["com"] = mass * (1 - share), g.sub(body["com"], g.scale(share, apart))
        body["inertia"] = g.scale(1 - share, inertia)
    # Wheels and gyros are at the base's centre of mass: a base with wheels or gyros is not divided.
    if robot.get("wheels") or robot.get("gyros"):
        return None
    robot["links"] += parts
    return scenario, same


@relation()
def reversed_joints(scenario, random):
    """Joints are reversed: axes, values, rates, limits and biases change their signs."""
    if noisy(scenario):
        return None
    flipped = {n for n in s.joints_of(scenario) if random.random() < 0.7}
    for link in scenario["robot"]["links"]:
        joint = link["joint"]
        if joint["name"] not in flipped:
            continue
        joint["axis"] = g.scale(-1, joint["axis"])
        limits = joint.get("limits", {})
        if "lower" in limits:
            limits["lower"], limits["upper"] = -limits["upper"], -limits["lower"]
    values = [scenario["initial"]["joints"], scenario["initial"]["joint_rates"],
              scenario.get("approach", {}).get("final_joints", {}),
              scenario["post_impact"].get("move", {}).get("joints", {}),
              scenario.get("sensors", {}).get("joints", {}).get("bias", {})]
    for mapping in values:
        for name in flipped & set(mapping):
            mapping[name] = -mapping[name]

    def expect(o):
        return {k: (kind, g.scale(-1, x) if k.startswith("joint/") and k.split("/")[1] in flipped else x)
                for k, (kind, x) in o.items()}
    return scenario, expect


@relation()
def continuous_joints(scenario, random):
    """Revolute joints without a range become continuous, and continuous ones revolute."""
    for joint in s.joints_of(scenario).values():
        if joint["type"] == "continuous":
            joint["type"] = "revolute"
        elif joint["type"] == "revolute" and "limits" not in joint:
            joint["type"] = "continuous"
    return scenario, same


@relation()
def weightless_part(scenario, random):
    """A part of negligible mass is welded to the last link."""
    robot = scenario["robot"]
    robot["links"].append({"name": "speck", "parent": robot["end_effectors"][-1]["link"], "mass": 1e-9, "com": [0, 0, 0],
                           "inertia": [1e-12, 1e-12, 1e-12, 0, 0, 0],
                           "joint": {"name": "speck-weld", "type": "fixed",
                                     "origin": {"position": [0.1, 0, 0], "quaternion_wxyz": [1, 0, 0, 0]}}})
    return scenario, same


# --- Computation ---

@relation(bound=1e-4, verdicts=False)
def other_integrator(scenario, random):
    """rk4 with short steps integrates the motion."""
    robot = scenario["robot"]
    if any("elasticity" in link["joint"] or "beam" in link for link in robot["links"]):
        return None  # the steps of rk4 would have to be much shorter
    scenario["integration"] |= {"method": "rk4", "step": 2e-4}
    return scenario, same


@relation()
def other_tolerance(scenario, random):
    """The adaptive integrator works with another tolerance and shorter steps."""
    scenario["integration"] |= {"relative_tolerance": 1e-13, "absolute_tolerance": 1e-14, "max_step": 0.02}
    return scenario, same


@relation()
def integrated_roots(scenario, random):
    """Velocities of free bodies are integrated, not recovered from momenta."""
    scenario["integration"]["root_velocity"] = "integrated"
    return scenario, same


@relation()
def zero_load(scenario, random):
    """A wrench of zero acts on the base."""
    loads = scenario.setdefault("external_wrenches", [])
    loads.append({"body": "base", "position": [0, 0, 0], "frame": "world", "force": [0, 0, 0], "torque": [0, 0, 0],
                  "time": {"shape": "constant"}})
    return scenario, same


@relation(bound=0, bits=True)
def output_interval(scenario, random):
    """The time series has another interval: neither motion nor verdicts change."""
    scenario["output"]["interval"] = s.Draw(random).of(0.013, 0.037, 0.25)
    return scenario, same


@relation(bound=0, bits=True)
def link_series(scenario, random):
    """The velocities of the links are recorded too."""
    scenario["output"]["links"] = True
    return scenario, same


@relation(bound=0, bits=True)
def same_again(scenario, random):
    """The same scenario gives the same bits."""
    return scenario, same


@relation(bound=1e-9, program="campaign")
def lanes(scenario, random):
    """A campaign of the one case, in SIMD lanes, gives the same columns."""
    return scenario, same


def without_memory(scenario):
    """The scenario without parts whose state cannot be an initial state: computer, springs, actuators, orbit."""
    robot, post = scenario["robot"], scenario["post_impact"]
    for key in ("control", "sensors", "orbit"):
        scenario.pop(key, None)
    for key in ("wheels", "gyros", "thrusters"):
        robot.pop(key, None)
    for key in ("wheel_rates", "gimbal_angles"):
        scenario["initial"].pop(key, None)
    post.pop("release", None)
    if post.get("base_control", {}).get("actuators") != "outside":
        post.pop("base_control", None)
    robot["links"] = [link for link in robot["links"] if "spring" not in link["joint"] and "beam" not in link]
    for link in robot["links"]:
        link["joint"].pop("elasticity", None)
    for target in scenario["targets"]:
        target.pop("panels", None)
    return scenario


def free_after_grasps(scenario):
    """Without memory and approach, and with free joints and constant loads after grasps that close immediately."""
    scenario = without_memory(scenario)
    if any(grasp["model"] == "contact" for grasp in scenario["grasps"]):
        return None
    scenario.pop("approach", None)
    for target in scenario["targets"]:
        target["state"].pop("at", None)
    for joint in s.joints_of(scenario).values():
        if "stop" not in joint.get("limits", {}):
            joint.pop("limits", None)  # a scenario must not begin beyond them
    scenario["post_impact"] = {"duration": scenario["post_impact"]["duration"], "joints": "free"}
    scenario["impact"] = {"duration": 1e-3, "joints": scenario["impact"]["joints"]}
    for load in scenario.get("external_wrenches", []):
        load["time"] = {"shape": "constant"}
    return scenario


@relation(program="continued", simplify=free_after_grasps)
def continued_run(scenario, random):
    """A run that starts at the end of another run equals one continuous run."""
    return scenario, same


@relation(program="shifted", simplify=lambda scenario: without_memory(scenario) if "approach" in scenario else None)
def time_shift(scenario, random):
    """The capture is at t = 0, from the final state of the approach; loads act earlier by its duration."""
    return scenario, comparable_impulses(scenario)


def changed(name, scenario, random):
    return RELATIONS[name]["change"](copy.deepcopy(scenario), random)
