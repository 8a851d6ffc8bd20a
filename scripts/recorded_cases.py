"""Cases of scripts/record_results: the shipped files, variations of them, and every invalid input of the tests.

The commands and the keys are the program's; where one of them is renamed, it is renamed here too, and the result keeps
its name, so that scripts/compare_results finds it again.
"""
import dataclasses
import re
import shlex

MAP = "map"      # the command for the probability of success over two design values
OUT = "results"       # the commands write below it: results/KIND/NAME
CASES = 2501          # instead of the 100 000 cases of a campaign; no multiple of a block, so that one is not full
FEW_CASES = 9         # cases in a campaign of every scenario: eight in lanes, and one more
WHOLE_CAMPAIGNS = ("dual-arm-tumbling-targets", "heavy-satellite-detumble", "first-plan")  # beside the thesis's; others: the impact
EVALUATIONS = 12      # instead of the 60 of the optimization in three dimensions, which take over a minute

LEFT_OUT = (
    ("report.html", "made from the files recorded here, and megabytes each; tests/report and tests/web check it"),
    ("table.h5, shards", "the same numbers as table.csv; campaigns' shards depend on where a run was stopped"),
    ("timeseries.h5", "read through `grapnel export`: --csv in full, --mat and --glb as text with digests of the numbers"),
    ("pictures of figures", "gnuplot's; their data and scripts are recorded"),
    ("lines of progress and of how long it will take", "which appear depends on how busy the machine is"),
)

# Laws, models and modes that the shipped scenarios do not have, each as overrides of one of them.
PLANNED = "scenarios/thesis/open-loop-case-1-planned.yaml"
CLOSED = "scenarios/thesis/closed-loop.yaml"
PUBLISHED = "scenarios/thesis/open-loop-case-1.yaml"
REBOUND = "scenarios/contact-rebound.yaml"
VARIATIONS = {
    "as-published": (CLOSED, "impact={law: as_published}"),
    "restitution-of-grasps": (PLANNED, "impact={law: bilateral_restitution, restitution: 0.5, duration: 1e-3}"),
    "closed-restitution-of-grasps": (CLOSED, "impact={law: bilateral_restitution, restitution: 0.3, duration: 1e-3}"),
    "braked": (PLANNED, "impact.joints=braked"),
    "driven": (PLANNED, "impact.joints=driven"),
    "closed-braked": (CLOSED, "impact.joints=braked", "post_impact.joints=braked"),
    "closed-driven": (CLOSED, "impact.joints=driven"),
    "hinge": (CLOSED, "grasps.tip-1.model=hinge", "grasps.tip-1.axis=[0, 0, 1]"),
    "point": (CLOSED, "grasps.tip-2.model=point"),
    "open-hinge-and-point": (PLANNED, "grasps.tip-1.model=hinge", "grasps.tip-1.axis=[0, 0, 1]", "grasps.tip-2.model=point"),
    "match-twist": (PLANNED, "approach.final_rates={match: twist}"),
    "match-least-rates": (PLANNED, "approach.final_rates={match: velocity_least_rates}"),
    "cycloidal": (PLANNED, "approach.profile=cycloidal"),
    "quintic": (PLANNED, "approach.profile=quintic"),
    "measure-excursion": (PLANNED, "approach.plan={objective: excursion}"),
    "measure-limits": (PLANNED, "approach.plan={objective: limits}"),
    "measure-manipulability": (PLANNED, "approach.plan={objective: manipulability}"),
    "measure-nearest": (PLANNED, "approach.plan={objective: nearest, guess: [-0.5, -1.4, 0, 2.6, -1.4, 0]}"),
    "tracking-pd": (PLANNED, "approach.tracking={mode: pd, kp: 490, kd: 140}", "contact={gap: weld_as_found}"),
    "tracking-computed-torque": (PLANNED, "approach.tracking={mode: computed_torque, kp: 49, kd: 14}",
                                 "contact={gap: weld_as_found}"),
    "tracking-noise": (
        PLANNED, "approach.tracking={mode: computed_torque, kp: 49, kd: 14, noise: {position: 1e-3, bandwidth: 1, seed: 3}}",
        "contact={gap: weld_as_found}"),
    "gap-refused": (PUBLISHED, "contact={gap: refuse, limit: 0.001}"),
    "gap-welded": (PUBLISHED, "contact={gap: weld_as_found}"),
    "gap-translated": (PUBLISHED, "contact={gap: translate_target, largest_gap: any}"),
    "base-held": (PLANNED, "robot.base.mode=held"),
    "base-fixed": (PLANNED, "robot.base.mode=fixed"),
    "orbit": (PLANNED, "orbit={semi_major_axis: 9000 km, eccentricity: 0.2, true_anomaly: 40 deg}"),
    "rk4": (PLANNED, "integration={method: rk4, step: 0.01}"),
    "rk4-too-coarse": (PUBLISHED, "integration.method=rk4", "integration.step=2"),
    "root-velocity-integrated": (PLANNED, "integration.root_velocity=integrated"),
    "loops-baumgarte": (CLOSED, "integration.loops=baumgarte"),
    "loops-acceleration": (CLOSED, "integration.loops=acceleration"),
    "loops-open": (CLOSED, "integration.loops=open"),
    "steps-run-out": (PUBLISHED, "integration.max_steps=300"),
    "planning-runs-out": (PLANNED, "approach.plan.max_evaluations=10"),
    "no-clearance": (CLOSED, "clearance={enabled: false}"),
    "no-published": (CLOSED, "output.as_published=false"),
    "afterwards-pd": (PLANNED, "post_impact={duration: 20, joints: pd, kp: 30, kd: 25}"),
    "afterwards-braked": (PLANNED, "post_impact={duration: 20, joints: braked}"),
    "frictionless-contact": (REBOUND, "impact={law: restitution, restitution: 0.6, duration: 1e-2}"),
    "contact-newton": (
        REBOUND, "impact={law: friction, hypothesis: newton, restitution: 0.4, friction: 0.15, duration: 1e-2}"),
    "contact-poisson": (
        REBOUND, "impact={law: friction, hypothesis: poisson, restitution: 0.4, friction: 0.15, duration: 1e-2}"),
    "contact-kelvin-voigt": (
        REBOUND, "impact={law: compliant, contact: {model: kelvin_voigt, stiffness: 1e5, damping: 100}, friction: 0.15}"),
    "contact-hertz": (REBOUND, "impact={law: compliant, contact: {model: hertz, stiffness: 1e7}}"),
    "contact-hunt-crossley": (
        REBOUND, "impact={law: compliant, contact: {model: hunt_crossley, stiffness: 1e6, damping: 0.5}, friction: 0.15}"),
}

# Errors in studies: a shipped file, the replaced text (first occurrence), and its replacement.
ANGLE, AFFINE, RATIO = "optimize-angle.yaml", "thesis-affine.yaml", "mass-ratio.yaml"
CAMPAIGN, DESIGN = "thesis-uncertain-target.yaml", "thesis-success-map.yaml"
SLIPS = (
    (RATIO, "simulate: impact", "simulate: impakt"), (RATIO, "axes:", "axis:"), (RATIO, "count: 41", "count: 0"),
    (RATIO, "quantity: mass_ratio", "quantity: mass_ration"), (RATIO, "from: 1e-6", "from: -1"), (RATIO, "1e4", "1e4 kg"),
    (RATIO, "seven-joint-dual-capture", "eight-joint-dual-capture"), (RATIO, "scenario: ", "scenario: scenario: "),
    (RATIO, "schema: grapnel-study/1", "schema: grapnel-study/9"), (RATIO, "{quantity", "{quantity, [quantity"),
    (AFFINE, "targets[0]", "targets[9]"), (AFFINE, "[-0.07, 0, 0.05]", "[]"), (AFFINE, "state.velocity[1]", "state.velocty[1]"),
    (AFFINE, "label: closed", "label: open"), (AFFINE, "[-0.03, 0, 0.11]", "[-0.03, text, 0.11]"),
    (ANGLE, "minimize: grasps/*/impulse_magnitude", "minimize: grasps/*/impuls_magnitude"),
    (ANGLE, "from: -60, to: 90", "from: 90, to: -60"),
    (ANGLE, "evaluations: 120", "evaluations: 0"), (ANGLE, "grasp: tip-1", "grasp: tip-7"), (ANGLE, "unit: deg", "unit: degrees"),
    (ANGLE, "variables:", "limits:"), (ANGLE, "approach_angle", "approach_angel"),
    (CAMPAIGN, "cases: ", "cases: -"), (CAMPAIGN, "seed: 1", "seed: one"), (CAMPAIGN, "sobol", "halton"),
    (CAMPAIGN, "from: 0.8, to: 1.2", "from: 1.2, to: 0.8"), (CAMPAIGN, "deviation: 0.1", "deviation: -0.1"),
    (CAMPAIGN, "as: factor", "as: factory"), (CAMPAIGN, "targets.target-1.mass", "targets.target-1.mas"),
    (CAMPAIGN, "impulse_magnitude < 0.18", "impulse_magnitude <"), (CAMPAIGN, "columns: [captured", "columns: [catched"),
    (CAMPAIGN, "- captured", "- caught"), (CAMPAIGN, "uncertain:", "uncertainties:"),
    (CAMPAIGN, "normal: {deviation: [0.005, 0.005, 0]}", "normal: {deviation: [0.005, 0.005]}"),
    (CAMPAIGN, "worst: {count: 3, by: grasps/tip-1/", "worst: {count: 3, by: grasps/tip-3/"),
    (DESIGN, "count: 13", "count: 1"), (DESIGN, "quantity: target_spin", "quantity: relative_speed"), (DESIGN, "to: 0.12", "to: fast"),
    (DESIGN, "keep:", "keeps:"), (DESIGN, "\ndesign:", "\ndesing:"),
)

GOOD = "tests/damaged/good/capture.yaml"
# Invalid command lines.
MISTAKES = {
    "nothing": "",
    "unknown-command": "fly",
    "unknown-option": "run x.yaml --fast",
    "no-file": "run absent.yaml",
    "a-folder": "run scenarios",
    "no-scenario": "run",
    "robot-as-scenario": "run robots/planar-dual-arm.yaml",
    "scenario-as-robot": f"info {PUBLISHED}",
    "study-as-scenario": "run studies/mass-ratio.yaml",
    "scenario-as-study": f"sweep {PUBLISHED}",
    "campaign-as-study": "sweep studies/thesis-monte-carlo.yaml",
    "study-as-campaign": "campaign studies/mass-ratio.yaml",
    "campaign-as-map": f"{MAP} studies/{CAMPAIGN}",
    "study-as-optimization": "optimize studies/mass-ratio.yaml",
    "nonsense-set": f"run {GOOD} --set nonsense",
    "set-unknown": f"run {GOOD} --set approach.durtion=3",
    "set-value": f"run {GOOD} --set 'approach.duration=3 s'",
    "set-index": f"check {GOOD} --set targets[3].mass=2",
    "set-name": f"check {GOOD} --set targets.bal.mass=2",
    "output-is-a-file": f"run {GOOD} -o README.md",
    "export-nothing": "export --csv absent",
    "export-no-format": "export scenarios",
    "export-no-results": "export --csv scenarios",
    "figure-nothing": "figure absent --what joints",
    "report-nothing": "report absent",
    "merge-nothing": f"merge absent -o {OUT}/mistakes/merged",
    "merge-no-campaign": f"merge scenarios -o {OUT}/mistakes/merged",
    "unknown-schema": "schema robots",
    "point-too-large": "sweep studies/mass-ratio.yaml --only 1000",
    "case-negative": f"campaign studies/{CAMPAIGN} --only -1",
    "shard-of-none": f"campaign studies/{CAMPAIGN} --shard 3/2",
    "shard-text": f"campaign studies/{CAMPAIGN} --shard half",
    "no-jobs": "sweep studies/mass-ratio.yaml -j 0",
    "only-and-shard": f"campaign studies/{CAMPAIGN} --only 1 --shard 1/2",
    "too-many-samples": f"run {GOOD} --set output.interval=0.000001",
    "mass-negative": f"run {GOOD} --set targets[0].mass=-1",
    "damaged-motion": "run tests/damaged/good/absent.yaml --quiet",
}


@dataclasses.dataclass
class Case:
    """Commands that are run one after the other, and the folder they leave; the result is stored as kind/name."""
    kind: str
    name: str
    commands: list  # of (label, arguments)
    cwd: str = "."
    folder: str = ""  # that of the results, beneath the inputs; empty: the commands write none


def place(kind, name):
    return f"{OUT}/{kind}/{name}"


def command_of(study):
    """sweep, campaign, optimize or the map's command, for the text of a study file."""
    kind = re.search(r"^schema: grapnel-(\w+)/", study, re.M)
    if kind is None or kind[1] == "study":
        return "sweep"
    if kind[1] == "optimization":
        return "optimize"
    return MAP if re.search(r"^design:", study, re.M) else "campaign"


def shortened(study):
    """A study's text, reduced if it would take minutes."""
    study = re.sub(r"^cases: \d{5,}", f"cases: {CASES}", study, flags=re.M)
    return re.sub(r"evaluations: 60\b", f"evaluations: {EVALUATIONS}", study)


def studies(inputs):
    """Every study, the longest first; single points and cases of some; a campaign in parts, merged and extended."""
    found = []
    for path in sorted((inputs / "studies").glob("*.yaml")):
        command = command_of(path.read_text())
        out = place("studies", path.stem)
        arguments = [command, f"studies/{path.name}", "-o", out, "--no-report", "-j", "1"]
        found.append(Case("studies", path.stem, [(command, arguments)], folder=out))
    slow = ("optimize-3d", "arm-2-limits", "thesis-success-map", "thesis-open-loop-angle", "optimize-angle")
    found.sort(key=lambda case: slow.index(case.name) if case.name in slow else len(slow))
    single = (("sweep", RATIO, 7), ("sweep", "thesis-closed-loop.yaml", 31), ("campaign", CAMPAIGN, 1820), ("campaign", DESIGN, 20))
    for command, file, number in single:
        name = f"{file.removesuffix('.yaml')}-{number}"
        out = place("single", name)
        command = MAP if file == DESIGN else command
        arguments = [command, f"studies/{file}", "-o", out, "--no-report", "-j", "1", "--only", str(number)]
        found.append(Case("single", name, [(command, arguments)], folder=out))
    out = place("parts", "merged")
    parts = [f"{out}-{i}" for i in (1, 2)]
    part = ["campaign", f"studies/{CAMPAIGN}", "--no-report", "--no-csv", "-j", "1"]
    commands = [(f"part-{i}", [*part, "-o", parts[i - 1], "--shard", f"{i}/2"]) for i in (1, 2)]
    found.append(Case("parts", "merged", commands + [("merge", ["merge", *parts, "-o", out, "--no-report"])], folder=out))
    out = place("parts", "extended")
    campaign = ["campaign", "studies/thesis-monte-carlo.yaml", "-o", out, "--no-report", "-j", "1"]
    commands = [("campaign", campaign), ("again", campaign), ("extend", campaign + ["--extend", "300"])]
    found.append(Case("parts", "extended", commands, folder=out))
    return found


def every_scenario_uncertain(inputs):
    """A campaign of every scenario and variation: comparison of several concurrent cases with a single one."""
    texts = {}
    for path in sorted((inputs / "scenarios").rglob("*.yaml")):
        texts[path.stem] = (str(path.relative_to(inputs)), ())
    for name, (scenario, *overrides) in VARIATIONS.items():
        texts[name] = (scenario, overrides)
    found = []
    for name, (scenario, overrides) in texts.items():
        lines = [f"  {line.replace('=', ': ', 1)}\n" for line in overrides]
        simulate = "run" if "thesis/" in scenario or name in WHOLE_CAMPAIGNS else "impact"
        if name != "no-clearance":
            lines.append("  clearance: {enabled: false}\n")
        (inputs / "studies" / f"uncertain-{name}.yaml").write_text(
            f"schema: grapnel-campaign/1\nname: {name}\nscenario: ../{scenario}\nsimulate: {simulate}\n"
            f"set:\n{''.join(lines)}cases: {FEW_CASES}\nseed: 2\nsampling: latin_hypercube\nuncertain:\n"
            "  - {path: \"targets[0].mass\", as: factor, uniform: {from: 0.9, to: 1.1}}\n"
            "  - {path: \"targets[0].state.angular_velocity\", as: offset, normal: {deviation: 1e-3}}\n"
            "success: [captured]\n")
        out = place("campaigns", name)
        arguments = ["campaign", f"studies/uncertain-{name}.yaml", "-o", out, "--no-report", "-j", "1"]
        found.append(Case("campaigns", name, [("campaign", arguments)], folder=out))
    return found


def run(kind, name, scenario, overrides=()):
    out = place(kind, name)
    arguments = ["run", scenario, "-o", out, "--no-report"]
    for override in overrides:
        arguments += ["--set", override]
    return Case(kind, name, [("run", arguments)], folder=out)


def runs(inputs):
    """Every scenario; the figures of some runs and studies; variations."""
    found = []
    for path in sorted((inputs / "scenarios").rglob("*.yaml")):
        name = str(path.relative_to(inputs / "scenarios").with_suffix(""))
        found.append(run("runs", name, str(path.relative_to(inputs))))
        found.append(Case("checks", name, [("check", ["check", str(path.relative_to(inputs))])]))
    found.sort(key=lambda case: case.name != "six-arm-servicer")  # the longest first
    found.append(run("runs", "damaged-good", GOOD))
    found += [run("variations", name, scenario, overrides) for name, (scenario, *overrides) in VARIATIONS.items()]
    figures = ("joints", "velocities", "relative", "distance", "momentum", "base", "energy", "loops", "torques", "forces", "clearance",
               "impulse", "strobe")
    for name, scenario in (("closed-loop", CLOSED), ("tumbling-targets", "scenarios/dual-arm-tumbling-targets.yaml")):
        found.append(drawn(name, ["run", scenario], figures))
    for study in ("thesis-closed-loop", "mass-ratio"):
        found.append(drawn(study, ["sweep", f"studies/{study}.yaml", "-j", "1"], ("impulse-map",)))
    return found


def drawn(name, command, figures):
    """Figures of one result folder; kept are their data and scripts."""
    out = place("figures", name)
    commands = [(command[0], [*command, "-o", f"{out}-of", "--no-report", "--quiet"]), ("list", ["figure", "--list", f"{out}-of"])]
    commands += [(what, ["figure", "--what", what, "-o", f"{out}/{what}.svg", f"{out}-of"]) for what in figures]
    return Case("figures", name, commands, folder=out)


def documents(inputs, help_of):
    """Help texts, schemas, and the information about every robot. help_of(WORDS...): the program's help."""
    found = [Case("help", "grapnel", [("help", ["--help"])])]
    listed = help_of().partition("Subcommands:")[2]
    for name in re.findall(r"^  ([a-z]+) ", listed, re.M):
        found.append(Case("help", name, [("help", [name, "--help"])]))
    kinds = re.search(r"TEXT:\{([^}]*)\}", help_of("schema"))
    for kind in kinds[1].split(",") if kinds else ():
        found.append(Case("schemas", kind, [("schema", ["schema", kind])]))
    for path in sorted((inputs / "robots").glob("*.yaml")):
        found.append(Case("robots", path.stem, [("info", ["info", f"robots/{path.name}"])]))
    return found


def wrong_inputs(inputs):
    """Invalid inputs of the tests, unchanged, and errors in studies and command lines."""
    found = []
    for transcript in sorted((inputs / "tests/damaged").glob("*.transcript")):
        lines = [line for line in transcript.read_text(errors="surrogateescape").splitlines() if line.startswith("$ grapnel ")]
        for number, line in enumerate(lines):
            arguments = shlex.split(line.removeprefix("$ grapnel "))
            file = next((word for word in arguments if word.endswith(".yaml")), "command")
            name = f"{transcript.stem}/{number:03}-{file.removesuffix('.yaml').replace('/', '-')}"
            found.append(Case("damaged", name, [(arguments[0], arguments)], cwd="tests/damaged"))
    for path in sorted((inputs / "tests/damaged").glob("*/*.yaml")):
        if re.search(rb"^schema: grapnel-robot", path.read_bytes(), re.M):
            name = f"{path.parent.name}/{path.stem}"
            found.append(Case("damaged-robots", name, [("info", ["info", f"{path.parent.name}/{path.name}"])], cwd="tests/damaged"))
    for folder in sorted((inputs / "fuzz").iterdir()):
        overrides = [line for line in (folder / "set").read_text(errors="surrogateescape").splitlines() if line]
        arguments = ["check", "scenario.yaml"]
        commands = [("check", arguments)] + [(f"set-{n:02}", arguments + ["--set", text]) for n, text in enumerate(overrides)]
        if (folder / "robot.yaml").exists():
            commands.append(("robot", ["info", "robot.yaml"]))
        found.append(Case("fuzz", folder.name, commands, cwd=f"fuzz/{folder.name}"))
    for number, (file, _, _) in enumerate(SLIPS):
        slip = slip_file(number)
        command = command_of((inputs / "studies" / file).read_text())
        arguments = [command, f"studies/{slip}", "-o", f"{OUT}/slips/{number:03}", "--no-report", "--quiet", "-j", "1"]
        found.append(Case("slips", slip.removesuffix(".yaml"), [(command, arguments)]))
    found += [Case("mistakes", name, [("mistake", shlex.split(words))]) for name, words in MISTAKES.items()]
    return found


def slip_file(number):
    return f"slip-{number:03}-{SLIPS[number][0]}"


def prepare(inputs, corpus):
    """Completes a copy of the repository's inputs: shorter studies, slips, the fuzzer's corpus as files. Raises ValueError
    if a slip no longer fits its study."""
    for path in (inputs / "studies").glob("*.yaml"):
        path.write_text(shortened(path.read_text()))
    slips = {}
    for number, (file, old, new) in enumerate(SLIPS):
        text = (inputs / "studies" / file).read_text()
        if old not in text:
            raise ValueError(f"scripts/recorded_cases.py: there is no {old!r} in studies/{file} any more")
        slips[slip_file(number)] = text.replace(old, new, 1)
    for path in sorted(corpus.iterdir()):
        folder = inputs / "fuzz" / path.name
        folder.mkdir(parents=True)
        parts = re.split(rb"^=== (\S+)\n", path.read_bytes(), flags=re.M)
        (folder / "scenario.yaml").write_bytes(parts[0])
        (folder / "set").write_bytes(b"")
        for name, content in zip(parts[1::2], parts[2::2]):
            (folder / name.decode()).write_bytes(content)
    return slips


def all_cases(inputs, help_of):
    """Every case, the longest first. The files with errors must not be in studies/ yet."""
    return studies(inputs) + every_scenario_uncertain(inputs) + runs(inputs) + documents(inputs, help_of) + wrong_inputs(inputs)
