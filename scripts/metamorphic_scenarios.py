"""Random captures for scripts/metamorphic: scenarios as dictionaries in one explicit form, so that relations can change
them: orientations are quaternions, inertias six numbers, joint values and gains mappings by joint."""
import math

import metamorphic_geometry as g


class Draw:
    def __init__(self, random):
        self.random = random

    def between(self, lower, upper):
        return self.random.uniform(lower, upper)

    def decades(self, lower, upper):
        return math.exp(self.random.uniform(math.log(lower), math.log(upper)))

    def chance(self, share):
        return self.random.random() < share

    def of(self, *choices):
        return self.random.choice(choices)

    def vector(self, size):
        return [self.random.uniform(-size, size) for _ in range(3)]

    def direction(self):
        while True:
            v = self.vector(1)
            if 0.1 < g.norm(v) < 1:
                return g.unit(v)

    def quaternion(self):
        return g.unit([self.random.gauss(0, 1) for _ in range(4)])

    def inertia(self, mass, size):
        """Inertia of a box with rotated axes."""
        a, b, c = (self.between(0.5, 1) * size for _ in range(3))
        box = [mass / 12 * x for x in (b * b + c * c, a * a + c * c, a * a + b * b)]
        return g.turn_inertia(self.quaternion(), box + [0, 0, 0])


def joints_of(scenario):
    """Joints with values in the scenario, by name."""
    return {link["joint"]["name"]: link["joint"] for link in scenario["robot"]["links"]
            if link["joint"]["type"] != "fixed" and "spring" not in link["joint"]}


def poses(robot, base, values):
    """Poses of base and links in W."""
    links = {link["name"]: link for link in robot["links"]}
    found = {"base": base}

    def pose(name):
        if name in found:
            return found[name]
        link = links[name]
        joint = link["joint"]
        X = g.compose(pose(link["parent"]), (joint["origin"]["position"], joint["origin"]["quaternion_wxyz"]))
        value = values.get(joint["name"], joint.get("spring", {}).get("rest", 0.0))
        if joint["type"] in ("revolute", "continuous"):
            X = g.compose(X, ([0, 0, 0], g.about(joint["axis"], value)))
        elif joint["type"] == "prismatic":
            X = g.compose(X, (g.scale(value, joint["axis"]), [1, 0, 0, 0]))
        found[name] = X
        return X

    for name in links:
        pose(name)
    return found


def tip_pose(scenario, effector, time=0.0):
    """Pose of an end-effector after motion of base and joints for a time at their initial rates."""
    initial = scenario["initial"]
    values = {j: initial["joints"][j] + time * initial["joint_rates"][j] for j in initial["joints"]}
    base = initial["base"]
    w = base.get("angular_velocity", [0, 0, 0])
    speed = g.norm(w)
    q = g.multiply(g.about(g.unit(w), speed * time), base["quaternion_wxyz"]) if speed else base["quaternion_wxyz"]
    X = (g.add(base["position"], g.scale(time, base.get("velocity", [0, 0, 0]))), q)
    e = next(e for e in scenario["robot"]["end_effectors"] if e["name"] == effector)
    return g.compose(poses(scenario["robot"], X, values)[e["link"]], (e["position"], e["quaternion_wxyz"]))


class Maker:
    def __init__(self, random):
        self.d = Draw(random)

    def scenario(self):
        d = self.d
        self.sampled = d.chance(0.45)
        self.mode = d.of("free", "free", "free", "free", "free", "fixed")
        self.kind = d.of("grasp", "grasp", "grasp", "grasp", "contact")
        self.approaches = d.chance(0.3)
        scenario = {"name": "random", "robot": self.robot()}
        scenario["initial"] = self.initial(scenario)
        self.targets(scenario)
        self.phases(scenario)
        self.surroundings(scenario)
        scenario["integration"] = {"relative_tolerance": 1e-12, "absolute_tolerance": 1e-13, "max_steps": 100000}
        scenario["output"] = {"interval": 0.1}
        return scenario

    # --- The robot ---

    def robot(self):
        d = self.d
        self.mass = d.decades(50, 1000)
        robot = {"name": "random", "base": {"mode": self.mode, "mass": self.mass, "com": d.vector(0.1),
                                            "inertia": d.inertia(self.mass, 1.5)}, "links": [], "end_effectors": []}
        self.arms = d.of(1, 1, 2, 2, 3)
        self.scales = {}
        self.flexible = d.of("none", "none", "panel", "gear")
        for arm in range(self.arms):
            self.arm(robot, arm)
        if self.flexible == "panel":
            self.panel(robot)
        if self.mode == "free":
            self.actuators(robot)
        return robot

    def arm(self, robot, arm):
        d = self.d
        parent, place = "base", [0.7 * math.cos(2 * arm + 0.3), 0.7 * math.sin(2 * arm + 0.3), d.between(-0.3, 0.3)]
        count = d.of(3, 4, 6, 6, 7)
        for i in range(count):
            name, mass = f"link-{arm}-{i}", self.mass * d.between(0.01, 0.04)
            length = d.between(0.3, 0.8)
            joint = self.joint(f"joint-{arm}-{i}", mass, length * (count - i))
            joint["origin"] = {"position": place, "quaternion_wxyz": d.quaternion() if i == 0 else
                               g.about(d.direction(), d.between(-0.6, 0.6))}
            robot["links"].append({"name": name, "parent": parent, "joint": joint, "mass": mass,
                                   "com": g.add([length / 2, 0, 0], d.vector(0.05)), "inertia": d.inertia(mass, length)})
            parent, place = name, [length, 0, 0]
        robot["end_effectors"].append({"name": f"tip-{arm}", "link": parent, "position": g.add(place, d.vector(0.05)),
                                       "quaternion_wxyz": d.quaternion()})

    def joint(self, name, mass, reach):
        d = self.d
        kind = d.of("revolute", "revolute", "revolute", "revolute", "continuous", "prismatic")
        joint = {"name": name, "type": kind, "axis": d.direction()}
        # Relative to the inertia moved by the joint: proportional gains and friction avoid stiff scenarios.
        scale = self.scales[name] = mass * (1 if kind == "prismatic" else reach * reach)
        effort = 0.05 * scale
        friction = d.of("none", "none", "smooth", "sticking")
        if friction == "smooth":
            joint["friction"] = {"model": "smooth", "viscous": effort * d.between(0, 1), "coulomb": effort * d.between(0, 0.3),
                                 "transition_rate": 0.01}
        elif friction == "sticking":
            coulomb = effort * d.between(0.01, 0.3)
            joint["friction"] = {"model": "sticking", "viscous": effort * d.between(0, 1), "coulomb": coulomb,
                                 "static": coulomb * d.between(1, 1.5)}
        if d.chance(0.3):
            self.rotor(joint, d.of(-1, 1) * d.between(20, 100), scale)
        if kind != "continuous" and d.chance(0.3):  # the range is set about the initial value
            joint["limits"] = {"lower": -d.decades(0.003, 0.3), "upper": d.decades(0.003, 0.3)}
            if d.chance(0.7):
                joint["limits"]["stop"] = {"restitution": d.of(0, d.between(0, 1)), "rest_rate": 1e-4}
        if self.flexible == "gear" and d.chance(0.2):
            self.rotor(joint, 50.0, scale)
            joint["elasticity"] = {"stiffness": 1000 * scale, "damping": scale}
        return joint

    def rotor(self, joint, ratio, scale):
        joint["rotor_inertia"], joint["gear_ratio"] = self.d.between(0.03, 0.3) * scale / ratio**2, ratio

    def panel(self, robot):
        d = self.d
        mass = 0.05 * self.mass
        if d.chance(0.4):
            return self.boom(robot, mass)
        inertia = d.inertia(mass, 1.5)
        robot["links"].append({
            "name": "panel", "parent": "base", "mass": mass, "com": [0.8, 0, 0], "inertia": inertia,
            "joint": {"name": "panel-hinge", "type": "revolute", "axis": [0, 1, 0],
                      "origin": {"position": [0, 0.9, 0.2], "quaternion_wxyz": d.quaternion()},
                      "spring": {"stiffness": mass * d.between(5, 50), "damping": mass * d.between(0, 0.1), "rest": 0.0}}})

    def boom(self, robot, mass):
        """A slender flexible rod, clamped to the base."""
        d = self.d
        length = 1.6
        across = mass * length**2 / 12
        robot["links"].append({
            "name": "boom", "parent": "base", "mass": mass, "com": [length / 2, 0, 0], "inertia": [1e-3 * mass, across, across, 0, 0, 0],
            "joint": {"name": "boom-clamp", "type": "fixed",
                      "origin": {"position": [0, 0.9, 0.2], "quaternion_wxyz": d.quaternion()}},
            "beam": {"from": [0, 0, 0], "to": [length, 0, 0], "section_y": [0, 1, 0], "bending_stiffness_y": 100 * mass,
                     "bending_stiffness_z": 300 * mass, "damping_ratio": 0.01, "segments": 2, "modes": 1, "fastest_mode": 100}})

    def actuators(self, robot):
        d = self.d
        self.actuator = d.of("none", "none", "outside", "wheels", "gyros", "thrusters" if self.sampled else "wheels")
        s = self.mass
        axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        if self.actuator == "wheels":
            for k, axis in enumerate(axes + [g.unit([1, 1, 1])]):
                robot.setdefault("wheels", []).append(
                    {"name": f"wheel-{k}", "axis": [float(x) for x in axis], "inertia": 2e-4 * s, "torque": d.between(3e-4, 3e-2) * s,
                     "rate": d.of(60.0, 400.0)})
        elif self.actuator == "gyros":
            skew = 0.9553166181245093
            for k in range(4):
                a = math.pi / 2 * k
                lean = [math.cos(a), math.sin(a), 0]
                axis = g.unit(g.add(g.scale(math.sin(skew), lean), [0, 0, math.cos(skew)]))
                robot.setdefault("gyros", []).append(
                    {"name": f"gyro-{k}", "gimbal_axis": axis, "spin_axis": [-math.sin(a), math.cos(a), 0.0],
                     "inertia": 6e-5 * s, "spin_rate": 600.0, "gimbal_inertia": 7e-5 * s, "rate": 1.0})
        elif self.actuator == "thrusters":
            for k in range(3):
                for a in (1, -1):
                    for b in (1, -1):
                        robot.setdefault("thrusters", []).append(
                            {"name": f"thruster-{len(robot.get('thrusters', []))}", "position": g.scale(a, axes[(k + 1) % 3]),
                             "direction": [float(x) for x in g.scale(b, axes[(k + 2) % 3])], "force": 2e-3 * s,
                             "specific_impulse": 220.0, "min_on_time": 0.005})

    # --- State, targets ---

    def initial(self, scenario):
        d = self.d
        joints = joints_of(scenario)
        values = {name: d.between(-0.8, 0.8) if j["type"] != "prismatic" else d.between(-0.2, 0.2) for name, j in joints.items()}
        for name, j in joints.items():
            if "lower" in j.get("limits", {}):
                j["limits"]["lower"] += values[name]
                j["limits"]["upper"] += values[name]
        base = {"position": d.vector(1), "quaternion_wxyz": d.quaternion()}
        if self.mode == "free":
            base |= {"velocity": d.vector(0.05), "angular_velocity": d.vector(0.2)}
        initial = {"base": base, "joints": values,
                   "joint_rates": {name: 0.0 if d.chance(0.3) else d.between(-0.3, 0.3) for name in joints}}
        if "wheels" in scenario["robot"]:
            initial["wheel_rates"] = [d.between(-50, 50) for _ in scenario["robot"]["wheels"]]
        if "gyros" in scenario["robot"]:
            initial["gimbal_angles"] = [d.between(-0.4, 0.4) for _ in range(4)]
        return initial

    def targets(self, scenario):
        d = self.d
        shared = self.arms > 1 and self.kind == "grasp" and d.chance(0.6)
        groups = [[0, 1]] + [[a] for a in range(2, self.arms)] if shared else [[a] for a in range(self.arms)]
        scenario["targets"], scenario["grasps"] = [], []
        for t, arms in enumerate(groups):
            X = tip_pose(scenario, f"tip-{arms[0]}")
            X_WT = (g.add(X[0], g.scale(0.5, d.direction())), d.quaternion())
            mass = self.mass * d.decades(0.1, 2)
            h = 1e-6
            velocity = g.scale(0.5 / h, g.sub(tip_pose(scenario, f"tip-{arms[0]}", h)[0], tip_pose(scenario, f"tip-{arms[0]}", -h)[0]))
            normal = d.direction()  # in W, outward
            w = d.vector(0.3)
            at = g.sub(X[0], X_WT[0])
            origin = g.sub(g.add(velocity, g.scale(0.05, normal)), g.cross(w, at))
            target = {"name": f"target-{t}", "mass": mass, "com": d.vector(0.1), "inertia": d.inertia(mass, 1.0),
                      "state": {"position": X_WT[0], "quaternion_wxyz": X_WT[1], "velocity": origin, "angular_velocity": w},
                      "grasp_points": []}
            for a in arms:
                tip = tip_pose(scenario, f"tip-{a}")
                local = g.compose(g.inverse(X_WT), tip)
                point = {"name": f"point-{a}", "position": local[0]}
                if self.kind == "contact":
                    point["normal"] = g.unit(g.turn(g.conjugate(X_WT[1]), normal))
                target["grasp_points"].append(point)
                grasp = {"end_effector": f"tip-{a}", "target": target["name"], "point": point["name"],
                         "model": "contact" if self.kind == "contact" else d.of("rigid", "rigid", "rigid", "hinge", "point")}
                if grasp["model"] == "hinge":
                    grasp["axis"] = d.direction()
                scenario["grasps"].append(grasp)
            if self.kind == "grasp" and d.chance(0.2):
                panel = 0.05 * mass
                target["panels"] = [{"name": "wing", "origin": {"position": d.vector(0.4), "quaternion_wxyz": d.quaternion()},
                                     "mass": panel, "com": [0.3, 0, 0], "inertia": [panel * x for x in (0.01, 0.04, 0.045, 0, 0, 0)],
                                     "hinge_axis": [0, 1, 0], "hinge": {"stiffness": panel * 20, "damping": panel * 0.05}}]
                self.include(target, target["panels"][0])
            scenario["targets"].append(target)

    def include(self, target, panel):
        """Mass, centre of mass and inertia of a target include its panel."""
        X = (panel["origin"]["position"], panel["origin"]["quaternion_wxyz"])
        parts = [(target["mass"], target["com"], target["inertia"]),
                 (panel["mass"], g.compose(X, (panel["com"], [1, 0, 0, 0]))[0], g.turn_inertia(X[1], panel["inertia"]))]
        mass = sum(m for m, _, _ in parts)
        com = [sum(m * c[k] for m, c, _ in parts) / mass for k in range(3)]
        inertia = [0.0] * 6
        for m, c, I in parts:
            inertia = g.add(inertia, g.add(I, g.point_inertia(m, g.sub(c, com))))
        target["mass"], target["com"], target["inertia"] = mass, com, inertia

    # --- Phases ---

    def phases(self, scenario):
        d = self.d
        joints = joints_of(scenario)
        impact = {"duration": 1e-3, "joints": d.of("free", "free", "free", "braked")}
        if self.kind == "contact":
            impact |= d.of({"law": "restitution", "restitution": 0.4}, {"law": "friction", "restitution": 0.4, "friction": 0.3})
        scenario["contact"] = {"gap": "weld_as_found", "largest_gap": "any"}
        scenario["impact"] = impact
        if self.kind == "grasp" and self.arms == len(scenario["targets"]) and d.chance(0.25):
            impact["law"], impact["joints"] = "compliant", "free"
            impact["grasp"] = {"linear_stiffness": 1e5, "linear_damping": 5e3, "angular_stiffness": 1e5, "angular_damping": 5e3}
            impact["longest"] = 0.5
        if self.approaches:
            self.approach(scenario)
        loops = self.arms > len(scenario["targets"])  # whose joints cannot be accelerated one by one
        post = {"duration": d.of(0.5, 1.0),
                "joints": d.of("free", "free", "pd", "pd", "pd" if loops else "computed_torque", "braked")}
        if post["joints"] in ("pd", "computed_torque"):
            stiff = {name: (self.scales[name] if post["joints"] == "pd" else 1) * (2 if self.sampled else 6) for name in joints}
            post["kp"] = {name: stiff[name] * d.between(0.5, 1) for name in joints}
            post["kd"] = {name: 0.3 * stiff[name] * d.between(0.5, 1) for name in joints}
            if d.chance(0.4):
                post["move"] = {"joints": {n: scenario["initial"]["joints"][n] + (0 if "limits" in j else d.between(-0.1, 0.1))
                                           for n, j in joints.items()},
                                "duration": 0.4, "after": 0.0, "profile": "quintic"}
        if self.mode == "free" and self.actuator != "none":
            control = {"actuators": self.actuator, "kp": 0.05 * self.mass, "kd": 0.3 * self.mass, "limit": self.mass}
            if self.actuator == "thrusters":
                control["thrusters"] = {"modulation": "pulse_width"}
            post["base_control"] = control
        if self.kind == "grasp" and d.chance(0.2):
            post["release"] = [{"after": 0.3, "end_effectors": [scenario["grasps"][0]["end_effector"]]}]
        scenario["post_impact"] = post
        if self.sampled:
            self.computer(scenario)

    def approach(self, scenario):
        """Joints move slightly; the grasps close at the resulting positions of the end-effectors, across gaps."""
        d = self.d
        final = {n: scenario["initial"]["joints"][n] + (0 if "limits" in j else d.between(-0.1, 0.1))
                 for n, j in joints_of(scenario).items()}
        for name, j in joints_of(scenario).items():
            if "limits" in j:
                scenario["initial"]["joint_rates"][name] = 0.0
        scenario["approach"] = {"duration": 0.5, "profile": "quintic", "final_joints": final}
        if d.chance(0.5):
            gain = 4.0 * (0.5 if self.sampled else 1)
            scenario["approach"]["tracking"] = {"mode": "computed_torque", "kp": {n: gain for n in final}, "kd": {n: gain for n in final}}
        for target in scenario["targets"]:
            target["state"]["at"] = "start"

    def computer(self, scenario):
        d = self.d
        period = d.of(0.02, 0.05)
        scenario["control"] = {"period": period, "delay": d.of(0.0, 0.0, 0.3 * period)}
        if not d.chance(0.6):
            return
        sensors = {"seed": 7, "joints": {"bias": {n: d.between(-1, 1) * 1e-3 for n in joints_of(scenario)},
                                         "rate": d.of("difference", "exact"), "noise": d.of(0.0, 1e-5)}}
        if self.mode == "free":
            sensors["gyro"] = {"noise": 0.0, "bias": d.vector(1e-4)}
            sensors["attitude"] = {"noise": d.of(0.0, 1e-5), "bias": d.vector(1e-3)}
        scenario["sensors"] = sensors

    # --- External loads ---

    def surroundings(self, scenario):
        d = self.d
        if d.chance(0.15):
            scenario["gravity"] = d.vector(0.3)
        elif self.mode == "free" and d.chance(0.15):
            q = d.quaternion()
            scenario["orbit"] = {"body": "earth", "semi_major_axis": 7.0e6, "eccentricity": 0.01, "true_anomaly": 1.0,
                                 "radial": g.turn(q, [1, 0, 0]), "along_track": g.turn(q, [0, 1, 0])}
        if d.chance(0.3):
            load = {"position": d.vector(0.3), "frame": d.of("world", "body"), "force": g.scale(self.mass, d.vector(0.02)),
                    "torque": g.scale(self.mass, d.vector(0.01)),
                    "time": d.of({"shape": "constant"}, {"shape": "half_sine", "start": 0.1, "end": 0.4},
                                 {"shape": "sine", "frequency": 2.0, "phase": 0.3})}
            load |= {"body": scenario["robot"]["links"][0]["name"]} if d.chance(0.5) else {"target": scenario["targets"][0]["name"]}
            scenario["external_wrenches"] = [load]


def random_scenario(random):
    return Maker(random).scenario()
