// Variants without a browser: quantities and their overrides, links, command lines, scenario files, order of runs.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import path from "node:path";
import test from "node:test";
import { grapnel, scenario, scratch, source } from "./browser.mjs";
import { bundle } from "./bundle.mjs";
import { dataOf, settablesOf } from "./variant_page.mjs";

const v = await bundle(["run", "whatif/yaml_places", "whatif/yaml_text", "whatif/scenario_file", "whatif/settings", "whatif/quantities", "whatif/groups", "whatif/variants", "whatif/map_cells", "whatif/engine_queue"]);
const folder = scratch();

const valuesOf = (file) => v.plainValue(v.readYaml(readFileSync(file, "utf8")));
// As the engine lists them: those of the scenario and of its robot.
function settingsOf(name) {
  const values = valuesOf(scenario(name));
  const robot = typeof values.robot === "string" ? valuesOf(path.resolve(path.dirname(scenario(name)), values.robot)) : values.robot;
  return new v.Settings(settablesOf({ ...values, robot }), [], { ...values, robot });
}
const runs = new Map();
function runOf(name, ...more) {
  const key = [name, ...more].join(" ");
  if (!runs.has(key)) {
    const out = path.join(folder, `run-${runs.size}`);
    grapnel(["run", path.isAbsolute(name) ? name : scenario(name), "-o", out, "--quiet", ...more]);
    runs.set(key, new v.Run(dataOf(path.join(out, "report.html")).runs[0]));
  }
  return runs.get(key);
}
const quick = ["--set", "post_impact.duration=0.1"];

test("every scenario's text is read, and a replaced value changes nothing else", () => {
  const files = ["scenarios", "scenarios/thesis"].flatMap((dir) => readdirSync(path.join(source, dir)).filter((one) => one.endsWith(".yaml")).map((one) => path.join(source, dir, one)));
  assert.ok(files.length > 60);
  for (const file of files) {
    const text = readFileSync(file, "utf8");
    const before = v.plainValue(v.readYaml(text));
    assert.match(String(before.name), /\w/, file);
    const changes = [{ path: "description", value: "it's: # new" }, { path: "output.interval", value: 0.25 }, { path: "initial.base", value: { position: [1, 2, 3] } }];
    const after = v.plainValue(v.readYaml(changes.reduce(v.replaced, text)));
    const { description, output, initial, ...rest } = after;
    assert.equal(description, "it's: # new", file);
    assert.equal(output.interval, 0.25, file);
    assert.deepEqual(initial.base.position, [1, 2, 3], file);
    const { description: _d, output: wasOutput, initial: wasInitial, ...same } = before;
    assert.deepEqual(rest, same, file);
    assert.deepEqual({ ...output, interval: 0 }, { ...wasOutput, interval: 0 }, file);
    assert.deepEqual({ ...initial, base: 0 }, { ...wasInitial, base: 0 }, file);
  }
});

test("a scenario file with overrides gives the numbers of --set", () => {
  const base = runOf("thesis/closed-loop.yaml", ...quick);
  const overrides = [
    { path: "targets.sphere.mass", value: 12.5 },
    { path: "targets[0].inertia", value: [1.25, 1.25, 1.25] },
    { path: "grasps.tip-1.relative_velocity", value: [-0.05, 0, 0] },
    { path: "robot.links.arm-1-link-1.mass", value: 4 },
    { path: "impact.law", value: "plastic" },
    { path: "clearance.required", value: 0.01 },
  ];
  const file = path.join(folder, "variant.yaml"); // outside the scenario's folder: its paths have to be absolute here
  const text = v.scenarioWith(base.data.source, overrides);
  assert.match(text, /^# A variant made in a report\./);
  assert.match(text, /# Table 4\.5 \[rad\]/); // comments remain
  writeFileSync(file, text.replaceAll("../../", `${source}/`));
  const exported = runOf(file).summary;
  const set = runOf("thesis/closed-loop.yaml", ...quick, ...overrides.flatMap((one) => ["--set", v.settingText(one)])).summary;
  for (const key of ["impact", "ledger", "post_impact", "approach", "capture"]) assert.deepEqual(exported[key], set[key], key);
  assert.notDeepEqual(set.impact, base.summary.impact);
});

test("a kept joint motion is an override: the program reaches the same joint values without its planner", () => {
  const base = runOf("thesis/closed-loop.yaml", ...quick);
  const settings = settingsOf("thesis/closed-loop.yaml");
  const kept = v.keptApproach(settings, base);
  assert.deepEqual(kept.value.final_joints, base.summary.approach.plan.final_position);
  const same = runOf("thesis/closed-loop.yaml", ...quick, "--set", v.settingText(kept)).summary;
  assert.equal(same.approach.plan.found, undefined); // not searched
  const ratio = same.impact.grasps[0].impulse_magnitude / base.summary.impact.grasps[0].impulse_magnitude;
  assert.ok(Math.abs(ratio - 1) < 1e-9, `${ratio}`);
  assert.match(v.keptApproach(settingsOf("dual-arm-satellite-handles.yaml"), base), /final straight approach/);
});

test("quantities of a scenario state overrides that change what they name", () => {
  const base = runOf("thesis/closed-loop.yaml", ...quick);
  const groups = v.quantitiesOf(settingsOf("thesis/closed-loop.yaml"), base);
  const all = groups.flatMap((group) => group.quantities);
  const named = (name) => all.find((one) => one.name === name) ?? assert.fail(name);
  const overrides = (...changes) => v.overridesOf(groups, new Map(changes.map(([name, value]) => [named(name).key, value])));
  assert.deepEqual(overrides(["Spin rate", 0.4]), [{ path: "targets.sphere.state.angular_velocity", value: [0, 0, 0.4] }]);
  assert.deepEqual(overrides(["Mass, times", 2]), [{ path: "targets.sphere.mass", value: 20 }]);
  assert.deepEqual(overrides(["Time to capture", 30]), [{ path: "approach.duration", value: 30 }]);
  assert.deepEqual(named("Joints").choices, ["free", "braked"]);
  assert.ok(!all.some((one) => one.name === "Spin axis")); // planar
  // The speed at contact is along the approach direction, in W at the capture.
  const [speed] = overrides(["Speed at contact, tip-1", 0.1]);
  const faster = runOf("thesis/closed-loop.yaml", ...quick, "--set", v.settingText(speed)).summary.impact;
  const change = faster.grasps[0].relative_velocity_before.map((x, k) => x - base.summary.impact.grasps[0].relative_velocity_before[k]);
  assert.ok(Math.abs(Math.hypot(...change) - 0.1) < 1e-6, `${change}`);
  for (const group of groups) for (const one of group.quantities) assert.ok(one.choices || Array.isArray(one.base) || one.high > one.low, one.name);
  // An override that a quantity can express is read back as its value.
  const mass = groups.find((group) => group.paths[0] === "targets.sphere.mass");
  assert.deepEqual(mass.read(25), [[named("Mass, times").key, 2.5]]);
  const inertia = groups.find((group) => group.paths[0] === "targets.sphere.inertia");
  assert.equal(inertia.read([1, 2, 1]), null);
});

test("quantities follow what a scenario has", () => {
  const base = runOf("thesis/closed-loop.yaml", ...quick);
  const names = (file) => v.quantitiesOf(settingsOf(file), base).flatMap((group) => group.quantities.map((one) => one.name));
  const handles = names("dual-arm-satellite-handles.yaml");
  for (const name of ["Speed at contact", "Gain kp of joints, times", "Duration for mean forces"]) assert.ok(handles.includes(name), name);
  assert.ok(names("compliant-grip.yaml").includes("Grasp stiffness"));
  assert.ok(names("contact-rebound.yaml").includes("Restitution"));
});

test("values of the text are found by names, with numbers of the engine where the text has units", () => {
  const stated = { targets: [{ name: "a.b", mass: "1.4 t", state: { angular_velocity: [0, 0, "2 deg/s"] } }], impact: { law: "plastic" } };
  const listed = [{ path: "targets[0].mass", value: 1400 }, { path: "targets[0].state.angular_velocity", value: [0, 0, 0.035] }, { path: "impact.restitution", value: 0 }];
  const settings = new v.Settings(listed, ["a.b"], stated);
  assert.equal(settings.value("targets.a.b.mass"), 1400);
  assert.deepEqual(settings.value("targets[0].state.angular_velocity"), [0, 0, 0.035]);
  assert.equal(settings.value("impact.restitution"), undefined); // a default that the scenario does not state
  assert.equal(settings.named("targets[0].mass"), "targets.a.b.mass");
  assert.deepEqual(settings.spellings("targets.a.b.mass"), ["targets.a.b.mass", "targets[0].mass"]);
  assert.deepEqual(settings.match("targets.*.mass").map((one) => [one.path, one.names]), [["targets.a.b.mass", ["a.b"]]]);
  const base = runOf("thesis/closed-loop.yaml", ...quick);
  const values = v.scenarioValues(base.data.source);
  assert.equal(values.post_impact.duration, 0.1); // with --set of the run
  assert.equal(values.robot.links[0].name, "arm-1-link-1");
});

test("links carry variants; hostile and damaged ones are refused or remain text", () => {
  const variant = { name: `<img src=x onerror="planted=1"> & 'q'`, request: { plan: "keep", overrides: [{ path: "a.b", value: [1, -2.5e-9, "x"] }, { path: "c", value: { d: true } }] } };
  assert.deepEqual(v.linkedVariant(v.fragmentOf(variant)), variant);
  assert.doesNotMatch(v.fragmentOf(variant), /[<> "]/);
  assert.equal(v.linkedVariant("#t=20"), null);
  const refused = (content, message) => assert.throws(() => v.linkedVariant(typeof content === "string" ? content : `#variant=${encodeURIComponent(JSON.stringify(content))}`), message);
  refused("#variant=%7B%22", /not JSON/);
  refused("#variant=%E0%A4%A", /not JSON/);
  refused(null, /no name/);
  refused({ name: "x".repeat(201), plan: "again", set: [] }, /no name/);
  refused({ name: "x", plan: "never", set: [] }, /again or keep/);
  refused({ name: "x", plan: "again", set: { length: 1 } }, /no list/);
  refused({ name: "x", plan: "again", set: [["", 1]] }, /not a path/);
  refused(`#variant=${"a".repeat(20_001)}`, /longer than/);
});

test("command lines survive a shell", () => {
  const overrides = [{ path: "targets.it's.mass", value: 12 }, { path: "approach.final_rates", value: { match: "twist" } }, { path: "name", value: "$(touch x) `y` \"z\" \\ '" }, { path: "robot", value: "a b.yaml" }];
  const words = execFileSync("sh", ["-c", v.commandText(overrides, "my scenario.yaml").replace("grapnel run", "printf '%s\\n'")], { encoding: "utf8" }).trimEnd().split("\n");
  assert.deepEqual(words, ["my scenario.yaml", ...overrides.flatMap((one) => ["--set", v.settingText(one)])]);
  const back = words.filter((one) => one.includes("=")).map((one) => v.plainValue(v.readYaml(one.slice(one.indexOf("=") + 1))));
  assert.deepEqual(back, overrides.map((one) => one.value));
});

test("one run at a time, the panel before maps; cancelling ends all", async () => {
  const order = [];
  let [now, most] = [0, 0];
  const engine = {
    run: async ({ plan }) => {
      most = Math.max(most, ++now);
      order.push(plan);
      await new Promise((done) => setTimeout(done, 2));
      --now;
      return plan;
    },
    cancel: () => order.push("cancel"),
  };
  const queue = new v.EngineQueue(engine);
  await Promise.all([queue.run({ plan: 1 }, false), queue.run({ plan: 2 }, false), queue.run({ plan: 3 }, true)]);
  assert.deepEqual([order, most], [[1, 3, 2], 1]);
  const both = [queue.run({ plan: 4 }, true), queue.run({ plan: 5 }, false)].map((one) => one.catch((error) => error));
  queue.cancel();
  for (const one of await Promise.all(both)) assert.ok(one instanceof v.Cancelled);
  assert.equal(await queue.run({ plan: 6 }, true), 6);
  assert.deepEqual(order.slice(3), [4, "cancel", 6]);
});

test("frequent changes compute the newest only", async () => {
  const computed = [];
  await new Promise((end) => {
    const latest = new v.Latest(async (x) => (computed.push(x), await new Promise((done) => setTimeout(done, 5)), x), (x) => x === 29 && end(), 0);
    let x = 0;
    const timer = setInterval(() => (x < 30 ? latest.request(x++) : clearInterval(timer)), 1);
  });
  assert.equal(computed.at(-1), 29);
  assert.ok(computed.length < 30, `${computed.length}`);
});

test("draws are standard normal, the same in every cell, and valid overrides", () => {
  const first = v.normals(1);
  const many = Array.from({ length: 4000 }, first);
  const mean = many.reduce((sum, x) => sum + x, 0) / many.length;
  const deviation = Math.sqrt(many.reduce((sum, x) => sum + (x - mean) ** 2, 0) / many.length);
  assert.ok(Math.abs(mean) < 0.05 && Math.abs(deviation - 1) < 0.05, `${mean} ${deviation}`); // three standard errors
  const settings = settingsOf("thesis/closed-loop.yaml");
  const request = { plan: "again", overrides: [{ path: "targets.sphere.mass", value: 20 }] };
  const scatter = { draws: 2, position: 0.01, mass: 0.1 };
  const [a, again, b] = [0, 0, 1].map((k) => v.drawn(request, settings, scatter, k).overrides);
  assert.deepEqual(a, again);
  assert.notDeepEqual(a, b);
  assert.deepEqual(a.map((one) => one.path), ["targets.sphere.mass", "targets.sphere.estimate.position_error", "targets.sphere.mass", "targets.sphere.inertia"]);
  const factor = a[2].value / 20; // of the request's mass, not of the base case
  assert.ok(factor !== 1 && Math.abs(factor - 1) < 0.5);
  assert.deepEqual(a[3].value, [factor, factor, factor]);
  grapnel(["check", scenario("thesis/closed-loop.yaml"), ...a.flatMap((one) => ["--set", v.settingText(one)])]);
});

test("the default axes of maps are speed, angle and spin where a scenario has them", () => {
  const base = runOf("thesis/closed-loop.yaml", ...quick);
  const quantities = v.axisQuantities(v.quantitiesOf(settingsOf("thesis/closed-loop.yaml"), base));
  const names = (probability) => v.defaultAxes(quantities, probability).map((one) => one.name);
  assert.match(names(false).join("; "), /^Speed at contact, tip-1; (Angle of approach|Direction of the velocity), tip-1$/);
  assert.deepEqual(names(true), ["Speed at contact, tip-1", "Spin rate"]);
  const axis = { quantity: quantities[0], from: 1, to: 2, count: 3 };
  assert.deepEqual(v.axisValues(axis), [1, 1.5, 2]);
  assert.equal(v.axisValues({ ...axis, count: 1e9 }).length, v.kMostPerAxis);
});
