// The page's functions, without a browser: playback, states at an impact, colours, the first plots and their limits,
// differences of texts, badges, panels.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { bundle } from "./bundle.mjs";

let v;
before(async () => {
  globalThis.ResizeObserver ??= class {}; // of tables, which these tests do not draw
  v = await bundle([
    "clock", "run", "colors", "roles", "plots/catalog", "plots/phases", "plots/axes", "plots/svg", "plots/compare_specs", "plots/time_window", "page/line_diff", "page/yaml_values", "page/envelope_bars", "page/facts", "format", "replay/keyboard", "replay/actuators", "replay/sky",
    "study/badge", "study/field", "replay/transport", "replay/vectors", "replay/ground", "replay/obstacles", "replay/compass", "replay/cameras", "replay/panels", "replay/video", "replay/bodies", "replay/markers",
  ]);
});

const near = (a, b, bound) => assert.ok(Math.abs(a - b) < bound, `${a} is not ${b}`);
const base64 = (array) => Buffer.from(array.buffer).toString("base64");

// ---- Playback ----

test("playback keeps its speed for any frame time, and through slow motion", () => {
  near(v.advance(0, 0.5, 2, [], 100), 1, 1e-12); // one frame of half a second at 2x
  const slow = [{ time: 10, before: 1, after: 1, factor: 0.1 }];
  near(v.advance(8, 1, 2, slow, 100), 9.1, 1e-12); // half a second to the slow interval, the rest at a tenth
  near(v.advance(8, 20, 2, slow, 100), 8 + 1 + 2 + 2 * 9.5, 1e-12); // through the interval in one frame
  assert.equal(v.advance(99, 5, 2, slow, 100), 100);
});

test("a slow machine plays 2x at 2x; time in the background is skipped", () => {
  const frames = [];
  const listeners = {};
  let now = 0;
  const originals = { performance: globalThis.performance, requestAnimationFrame: globalThis.requestAnimationFrame, document: globalThis.document };
  Object.defineProperty(globalThis, "performance", { value: { now: () => now }, configurable: true });
  globalThis.requestAnimationFrame = (frame) => frames.push(frame);
  globalThis.document = { hidden: false, addEventListener: (name, listener) => (listeners[name] = listener) };
  try {
    const clock = new v.Clock(0, 100);
    clock.speed = 2;
    clock.play();
    for (let k = 0; k < 10; ++k) frames.shift()((now += 250)); // four frames a second, as on a software renderer
    near(clock.time, 5, 1e-9);
    document.hidden = true;
    listeners.visibilitychange();
    document.hidden = false;
    frames.shift()((now += 60_000));
    near(clock.time, 5.2, 1e-9);
  } finally {
    Object.defineProperty(globalThis, "performance", { value: originals.performance, configurable: true });
    globalThis.requestAnimationFrame = originals.requestAnimationFrame;
    globalThis.document = originals.document;
  }
});

// ---- An impact has two states at one time ----

// The approach ends at 1 s, the contact has one sample before and one after, and the last phase begins as the contact
// ends.
function impactRun(scene = null, more = [], summary = {}) {
  const time = Float64Array.of(0, 1, 1, 1, 1, 2);
  const series = (path, unit, components, values) => ({ path, unit, description: "", components, data: base64(Float32Array.from(values.flat())) });
  return new v.Run({
    label: "",
    folder: "x",
    summary,
    scene,
    notes: [],
    series: {
      samples: 6,
      of: 6,
      bound: 0,
      time: base64(time),
      phase: base64(Uint8Array.of(0, 0, 1, 1, 2, 2)),
      phases: ["approach", "contact", "post_impact"],
      series: [series("base/angular_velocity", "rad/s", ["x", "y", "z"], [[0, 0, 0], [0, 0, 1], [0, 0, 1], [0, 0, 3], [0, 0, 3], [0, 0, 3]]), ...more.map((one) => series(...one))],
    },
  });
}

test("the states before and after an impact are two steps", () => {
  const run = impactRun();
  assert.deepEqual([...run.ranks], [0, 0, 0, 1, 1, 0]);
  assert.deepEqual(run.states, [{ time: 0, back: 0 }, { time: 1, back: 3 }, { time: 1, back: 0 }, { time: 2, back: 0 }]);
  const rate = (state) => run.at(run.series("base/angular_velocity"), run.locate(state.time, state.back))[2];
  assert.deepEqual(run.states.map(rate), [0, 1, 3, 3]);
  const back = v.nextState(run.states, { time: 1, back: 0 }, false);
  assert.deepEqual(back, { time: 1, back: 3 }); // "previous sample" shows the state just before
  assert.deepEqual(v.nextState(run.states, back, true), { time: 1, back: 0 });
  assert.deepEqual(v.nextState(run.states, { time: 0.5, back: 0 }, true), { time: 1, back: 3 });
  assert.equal(v.nextState(run.states, { time: 2, back: 0 }, true), undefined);
});

test("an impulse is shown from contact on", () => {
  const run = impactRun();
  const occurred = (time, back) => v.hasOccurred(run, 1, time, run.locate(time, back), back);
  assert.equal(occurred(0.99, 0), false); // marked 0.3 s before it in earlier versions
  assert.equal(occurred(1, 3), false);
  assert.equal(occurred(1, 0), true);
  assert.equal(occurred(1.2, 0), true);
});

// ---- Colours ----

const linear = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
const rgb = (hex) => [1, 3, 5].map((i) => linear(parseInt(hex.slice(i, i + 2), 16) / 255));
const luminance = ([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;
const contrast = (a, b) => {
  const [low, high] = [luminance(rgb(a)), luminance(rgb(b))].sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
};
function lab([r, g, b]) {
  const f = (t) => (t > 0.008856 ? Math.cbrt(t) : 7.787 * t + 16 / 116);
  const [x, y, z] = [f((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505), f(0.2126 * r + 0.7152 * g + 0.0722 * b), f((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089)];
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}
// As seen with deuteranopia (Machado, Oliveira, Fernandes 2009).
const withoutGreen = ([r, g, b]) => [0.367322 * r + 0.860646 * g - 0.227968 * b, 0.280085 * r + 0.672501 * g + 0.047413 * b, -0.01182 * r + 0.04294 * g + 0.968881 * b].map((c) => Math.max(0, c));
const apart = (a, b, seen = (c) => c) => Math.hypot(...lab(seen(rgb(a))).map((x, i) => x - lab(seen(rgb(b)))[i]));

test("colours of arms, targets and axes are distinct and have contrast with the page", () => {
  const roles = ["arm 0", "arm 1", "arm 2", "arm 3", "target 0", "target 1", "axis x", "axis y", "axis z"];
  for (const [scheme, page] of [["light", "#ffffff"], ["dark", "#171e26"]]) {
    const colors = roles.map((role) => v.roleColor(role, scheme));
    colors.forEach((color, i) => {
      assert.ok(contrast(color, page) >= 3, `${roles[i]} on ${page}: ${contrast(color, page)}`);
      for (let k = 0; k < i; ++k) {
        assert.ok(apart(color, colors[k]) > 20, `${roles[i]} and ${roles[k]}, ${scheme}: ${apart(color, colors[k])}`); // measured at least 22
        const alike = [roles[i], roles[k]].every((role) => role.startsWith("axis")) || [roles[i], roles[k]].every((role) => !role.startsWith("axis"));
        if (alike) assert.ok(apart(color, colors[k], withoutGreen) > 14, `${roles[i]} and ${roles[k]}, ${scheme}, without green: ${apart(color, colors[k], withoutGreen)}`);
      }
    });
  }
  for (const scheme of ["light", "dark"]) {
    const targets = [0, 1, 2, 3, 4, 5].map((k) => v.roleColor(`target ${k}`, scheme)); // one for each of six arms
    targets.forEach((color, i) => targets.slice(0, i).forEach((other) => assert.ok(apart(color, other) > 20, `${color} and ${other}`))); // measured at least 21
  }
  const [r, g, b] = ["axis x", "axis y", "axis z"].map((role) => rgb(v.roleColor(role, "light")));
  assert.ok(r[0] > r[1] && r[0] > r[2] && g[1] > g[0] && g[1] > g[2] && b[2] > b[0] && b[2] > b[1]); // x red, y green, z blue
});

function twoArms() {
  const body = (name, kind, parent) => ({ name, kind, parent, joint: null, series: name, mass: 1, com: [0, 0, 0], inertia: [1, 1, 1, 0, 0, 0], geometry: [] });
  return {
    planar: false,
    bodies: [body("bus", "base", null), body("left", "link", "bus"), body("right", "link", "bus"), body("debris", "target", null)],
    end_effectors: [{ name: "tip-1", body: "left" }, { name: "tip-2", body: "right" }].map((e) => ({ ...e, position: [0, 0, 0], quaternion_wxyz: [1, 0, 0, 0] })),
    grasp_points: [{ target: "debris", name: "bar", position: [0, 0, 0], approach_direction: null }],
    grasps: ["tip-1", "tip-2"].map((end_effector) => ({ end_effector, target: "debris", grasp_point: "bar", model: "rigid" })),
    meshes: [],
    limits: { grasps: [{ end_effector: "tip-1", position: 0.03, velocity: 0.02 }, { end_effector: "tip-2", position: 0.03, velocity: 0.01 }], clearance: 0.05 },
  };
}

function fullRun() {
  const six = (...values) => values.map((one) => [one].flat());
  const still = six([0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]);
  const attitude = six(...Array(6).fill([1, 0, 0, 0]));
  const moves = six([1, 0, 0], [0.5, 0, 0], [0.5, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]);
  const force = six([0, 0, 0], [0, 0, 0], [0, 0, 0], [30, 40, 0], [30, 40, 0], [0, 0, 0]);
  const xyz = ["x", "y", "z"];
  const more = [
    ["targets/debris/position", "m", xyz, still], ["targets/debris/quaternion_wxyz", "1", ["w", "x", "y", "z"], attitude],
    ["targets/debris/velocity", "m/s", xyz, still], ["targets/debris/angular_velocity", "rad/s", xyz, still],
    ["targets/debris/linear_momentum", "N s", xyz, moves], ["robot/linear_momentum", "N s", xyz, moves],
    ...["tip-1", "tip-2"].flatMap((name) => [
      [`end_effectors/${name}/velocity`, "m/s", xyz, moves],
      [`grasps/${name}/distance`, "m", [""], six(1, 0.5, 0.5, 0, 0, 0)],
      [`grasps/${name}/force`, "N", xyz, force],
    ]),
    ["clearance/minimum", "m", [""], six(1, 1, 1, 1, 1, 1)], ["system/kinetic_energy", "J", [""], six(2, 2, 2, 1, 1, 1)],
  ];
  const summary = {
    loads: [
      { of: "tip-1", quantity: "force", phase: "approach", peak: 20, rating: 100, margin: 0.8 },
      { of: "tip-1", quantity: "force", phase: "contact", peak: 120, rating: 100, margin: -0.2, assumed_duration: true },
      { of: "tip-1", quantity: "force", phase: "post_impact", peak: 55, rating: 100, margin: 0.45 },
      { of: "tip-2", quantity: "force", phase: "post_impact", peak: 5, rating: null, margin: null },
    ],
  };
  return impactRun(twoArms(), more, summary);
}

test("one colour per arm, target and axis in every plot", () => {
  const { plots } = v.plotsOf(fullRun(), 0);
  const line = (plot, label) => plots.find((one) => one.id === plot).lines.find((one) => one.label === label);
  assert.equal(line("grasp-force", "tip-2").color, "arm 1");
  assert.equal(line("closing", "tip-2").color, "arm 1");
  assert.equal(line("momentum-linear-x", "debris").color, "target 0"); // orange, like tip-2, in earlier versions
  assert.deepEqual(plots.find((one) => one.id === "base-angular_velocity").lines.map((one) => one.color), ["axis x", "axis y", "axis z"]);
  assert.equal(line("end-effector-velocity-tip-1", "z").color, "axis z");
});

// ---- The first plots ----

test("seven plots come first, with their limits; the rest follows in groups", () => {
  const { plots, absent } = v.plotsOf(fullRun(), 0);
  const first = plots.filter((plot) => plot.group === "Overview");
  assert.deepEqual(first.map((plot) => plot.id), ["closing", "closing-speed", "grasp-force", "base-angular_velocity", "clearance", "energy", "worst-margin"]);
  assert.deepEqual(plots.slice(0, 7), first);
  assert.deepEqual(absent, []);
  assert.equal(new Set(plots.map((plot) => plot.id)).size, plots.length);
  assert.deepEqual(first[0].limits, [{ label: "allowed distance", value: 0.03 }]);
  assert.deepEqual(first[1].limits, [{ label: "allowed speed of tip-1", value: 0.02 }, { label: "allowed speed of tip-2", value: 0.01 }]);
  assert.deepEqual(first[2].limits, [{ label: "rating", value: 100 }]);
  assert.deepEqual(first[4].limits, [{ label: "required", value: 0.05 }]);
  assert.deepEqual([first[0].log, first[0].floor], [true, 1e-4]); // four decades of the largest distance
  assert.deepEqual([first[0].start, first[2].start], [[0, 1.05], [0.95, 2]]); // distances until the impact, forces from it on
  const [sampled, phases] = first[6].lines.map((line) => [...line.values()]);
  assert.deepEqual(sampled, [100, 100, 100, 50, 50, 100]); // |force| = 50 N of 100
  assert.deepEqual(phases.map((x) => Math.round(x)), [80, 80, -20, -20, 45, 45]);
  assert.match(first[6].note, /assumed duration/);
});

test("transmitted joint loads are among the rated loads", () => {
  const six = (...values) => values.map((one) => [one].flat());
  const more = [["joints/reaction_force", "N", ["elbow", "wrist"], six([10, 1], [20, 1], [20, 1], [90, 1], [90, 1], [0, 1])]];
  const summary = { loads: [{ of: "elbow", quantity: "force", phase: "approach", peak: 25, rating: 100, margin: 0.75 }] };
  const { plots } = v.plotsOf(impactRun(null, more, summary), 0);
  const [sampled] = plots.find((plot) => plot.id === "worst-margin").lines;
  assert.deepEqual([...sampled.values()].map(Math.round), [90, 80, 80, 10, 10, 100]);
});

test("missing plots of these are reported", () => {
  const { plots, absent } = v.plotsOf(impactRun(), 0);
  assert.deepEqual(plots.map((plot) => plot.id), ["base-angular_velocity"]);
  assert.equal(absent.length, 6);
  assert.match(absent.join(";"), /the robot has no ratings/);
});

test("a limit near the lines widens the axis; a distant one does not flatten them", () => {
  assert.deepEqual(v.withLimits(0, 10, [12]), { low: 0, high: 12 });
  assert.deepEqual(v.withLimits(0, 10, [1500]), { low: 0, high: 10 });
  assert.deepEqual(v.withLimits(NaN, NaN, [0]), { low: 0, high: 0 });
});

test("limits beyond the axis are named in a strip", () => {
  const named = (value, label = "limit") => ({ label, value });
  assert.deepEqual(v.offScale([named(5), named(418.9), named(-418.9)], { min: 0, max: 10 }), ["↕ limit ±418.9, off scale"]);
  assert.deepEqual(v.offScale([named(20, "upper"), named(-3, "lower")], { min: 0, max: 10 }), ["↑ upper 20, off scale", "↓ lower −3, off scale"]);
  assert.deepEqual(v.offScale([named(0.01), named(1e-9, "floor")], { min: -4, max: 0 }, true), ["↓ floor 10⁻⁹, off scale"]);
});

test("the time around an impact shows the impact", () => {
  const phase = (name, begin, end) => ({ name, begin, end, first: 0, last: 0 });
  const ranges = v.timeRanges([phase("approach", 0, 20), phase("contact", 20, 20), phase("post_impact", 20, 40)], 0, 40);
  assert.deepEqual(ranges.map((one) => one.name), ["whole run", "approach", "around the impact", "post-impact"]);
  assert.deepEqual(ranges[2], { name: "around the impact", begin: 19.6, end: 20.4, at: 20 });
  const clock = new v.Clock(0, 40);
  clock.enter(19.6, 20.4);
  assert.equal(clock.time, 19.6);
  clock.time = 30;
  clock.enter(19.6, 20.4);
  assert.equal(clock.time, 20.4);
});

test("joint plots have the limits that the joints come closest to", () => {
  const joint = (name) => ({ name, type: "revolute", axis: [0, 0, 1], position: [0, 0, 0], quaternion_wxyz: [1, 0, 0, 0] });
  const scene = twoArms();
  scene.bodies[1].joint = joint("left-1");
  scene.bodies[2] = { ...scene.bodies[2], parent: "left", joint: joint("left-2") };
  scene.limits.joints = [
    { joint: "left-1", lower: -1, upper: 2, rate: 3, effort: null },
    { joint: "left-2", lower: -4, upper: 2, rate: 5, effort: 7 },
  ];
  const rows = [[0, 0], [0.5, 1], [0.5, 1], [1, 1.5], [1, 1.5], [1, 1.5]];
  const more = ["position", "velocity", "effort"].map((name) => [`joints/${name}`, "", ["left-1", "left-2"], rows]);
  const limits = (id) => v.plotsOf(impactRun(scene, more), 0).plots.find((plot) => plot.id === id).limits;
  assert.deepEqual(limits("joints-position-left"), [{ label: "limit", value: 2 }, { label: "limit of 1", value: -1 }, { label: "limit of 2", value: -4 }]);
  assert.deepEqual(limits("joints-velocity-left").map((one) => one.value), [3, 5, -3, -5]);
  assert.deepEqual(limits("joints-effort-left"), [{ label: "limit of 2", value: 7 }, { label: "limit of 2", value: -7 }]);
});

test("what a run uses is among the first plots, under plain names", () => {
  const six = (...values) => values.map((one) => [one].flat());
  const turn = [1, 0, 0, 0], quarter = [Math.SQRT1_2, 0, 0, -Math.SQRT1_2];
  const orbital = six([1, 2, 3], [1, 2, 3], [1, 2, 3], [1, 2, 3], [1, 2, 3], [1, 2, 3]);
  const more = [
    ["base/quaternion_wxyz", "1", ["w", "x", "y", "z"], six(turn, turn, turn, quarter, quarter, turn.map((q) => -q))],
    ["base/control_torque", "N m", ["x", "y", "z"], orbital],
    ["wheels/rate", "rad/s", ["a"], six(0, 100, 100, 200, 200, 400)],
    ["thrusters/impulse", "N s", ["jet"], six(0, 1, 1, 2, 2, 3)],
    ["base/orbital_position", "m", ["radial", "along_track", "cross_track"], orbital],
    ["orbit/radial", "1", ["x", "y", "z"], orbital],
    ["elastic/deflection", "rad", ["boom-1"], six(0, 1, 1, 2, 2, 3)],
    ["grippers/left/squeeze_effort", "N", ["squeeze"], six(0, 1, 1, 2, 2, 3)],
  ];
  const { plots } = v.plotsOf(impactRun(null, more, { wheels: [{ name: "a", rate_limit: 400 }] }), 0);
  const first = plots.filter((plot) => plot.group === "Overview").map((plot) => plot.id);
  assert.deepEqual(first, ["base-angular_velocity", "base-pointing", "wheels-capacity_used", "thrusters-impulse", "orbit-base", "elastic-deflection"]);
  const pointing = [...plots.find((plot) => plot.id === "base-pointing").lines[0].values()];
  pointing.forEach((angle, i) => near(angle, [0, 0, 0, Math.PI / 2, Math.PI / 2, 0][i], 1e-6)); // q and -q are one attitude
  const titles = plots.map((plot) => plot.title);
  assert.ok(titles.includes("Radial direction of the orbit, outward"));
  assert.ok(titles.includes("Squeeze effort, left"));
  assert.equal(titles.some((title) => /[/_]/.test(title)), false, titles.join("; "));
});

test("a stated goal is the first verdict", () => {
  const answer = (question, tone) => ({ question, tone });
  const of = (...answers) => v.goalFirst(answers).map((one) => one.question);
  assert.deepEqual(of(answer("Capture", "none"), answer("Ledger", "good"), answer("Goal", "bad")), ["Goal", "Ledger"]);
  assert.deepEqual(of(answer("Capture", "good"), answer("Goal", "good")), ["Goal", "Capture"]);
  assert.deepEqual(of(answer("Capture", "none"), answer("Ledger", "good")), ["Capture", "Ledger"]);
});

test("files of a plot have its limits", () => {
  const line = { color: "#000000", dash: [], width: 1, time: [0, 1] };
  const svg = v.svgPlot({
    id: "a", title: "t", xTitle: "time", yTitle: "distance", window: { min: 0, max: 1 }, log: false, width: 400, height: 250, phases: [],
    lines: [{ ...line, label: "near", values: [0, 1] }],
    limits: [{ label: "allowed", value: 0.5, color: "#b3261e" }, { label: "rating", value: 9000, color: "#b3261e" }],
  });
  assert.match(svg, />allowed 0\.5</);
  assert.match(svg, />↑ rating 9000, off scale</);
  assert.equal(svg.match(/stroke-dasharray="7 3 1.5 3"/g).length, 1); // the distant limit has no line
  assert.doesNotMatch(svg, /NaN/);
});

test("two runs share equal limits and mark different ones", () => {
  const plot = (value) => ({ id: "p", group: "g", title: "", axis: "", unit: "N", lines: [], limits: [{ label: "contact", value: 0 }, { label: "rating", value }] });
  const [joined] = v.overlay([plot(100)], [plot(200)], ["A", "B"]);
  assert.deepEqual(joined.limits, [{ label: "contact", value: 0 }, { label: "rating, A", value: 100 }, { label: "rating, B", value: 200 }]);
});

// ---- Contacts between shapes ----

// The finger touches at the samples 1 to 3 of six; the palm never does.
function touchingRun() {
  const six = (...values) => values.map((one) => [one].flat());
  const xyz = ["x", "y", "z"], none = [NaN, NaN, NaN], zero = [0, 0, 0];
  const pair = (name, force, normal, point, depth) => [
    [`contacts/${name}/force`, "N", xyz, force], [`contacts/${name}/normal_force`, "N", ["normal_force"], normal],
    [`contacts/${name}/point`, "m", xyz, point], [`contacts/${name}/depth`, "m", ["depth"], depth],
  ];
  const finger = pair(
    "finger--debris", six(zero, [0, 3, 4], [0, 6, 8], [0, 3, 4], zero, zero), six(0, 5, 10, 5, 0, 0),
    six(none, [1, 0, 0], [1, 1, 0], [1, 2, 0], none, none), six(0, 1, 2, 1, 0, 0),
  );
  const palm = pair("palm--debris", six(zero, zero, zero, zero, zero, zero), six(0, 0, 0, 0, 0, 0), six(none, none, none, none, none, none), six(0, 0, 0, 0, 0, 0));
  return impactRun(null, [...finger, ...palm]);
}

test("contacts that occur have plots of forces and depths", () => {
  const { plots } = v.plotsOf(touchingRun(), 0);
  const contacts = plots.filter((plot) => plot.group === "Contacts");
  assert.deepEqual(contacts.map((plot) => plot.id), ["contacts-normal_force", "contacts-depth", "contact-force-finger-debris"]);
  assert.deepEqual(contacts[0].lines.map((line) => [line.label, [...line.values()]]), [["finger – debris", [0, 5, 10, 5, 0, 0]]]);
  assert.deepEqual([...contacts[1].lines[0].values()], [0, 1, 2, 1, 0, 0]);
  assert.deepEqual(contacts[2].lines.map((line) => line.label), ["x", "y", "z"]);
  assert.deepEqual(plots.filter((plot) => plot.group === "Other"), []);
  assert.equal(v.plotsOf(impactRun(), 0).plots.some((plot) => plot.group === "Contacts"), false);
});

test("the grid of a half-space is about the bodies, and its lines are fixed in the half-space", () => {
  // A wall whose z axis is -x of W: its y axis is y of W, and its x axis is z of W.
  const half = Math.SQRT1_2;
  const wall = { position: [1, 0, 0.5], quaternion_wxyz: [half, 0, -half, 0] };
  const square = v.surfaceSquare(wall, [0, 3.03, 0.5 + 2.02], 1);
  near(square.step, 0.2, 1e-12);
  near(square.x, 2, 1e-12);
  near(square.y, 3, 1e-12);
  assert.equal(square.cells, 10);
});

test("arrows of contact forces begin at points of contact, also beside samples without contact", () => {
  const run = touchingRun();
  const forces = v.contactForces(run);
  assert.deepEqual(forces.map(({ force }) => force.path), ["contacts/finger--debris/force"]);
  const at = (index, fraction) => v.knownPoint(run, forces[0].point, { index, fraction });
  assert.deepEqual(at(1, 0.5), [1, 0.5, 0]);
  assert.deepEqual(at(0, 0.5), [1, 0, 0]); // contact begins before the next sample
  assert.deepEqual(at(3, 0.5), [1, 2, 0]);
  assert.deepEqual(at(5, 0), [0, 0, 0]); // no arrow: the force is zero
});

// ---- Texts ----

test("texts are compared by lines", () => {
  const diff = v.lineDiff("a\nb\nc\nd\n", "a\nx\nc\nd\ne\n");
  assert.deepEqual(diff.map(({ side, text }) => `${side} ${text}`), ["both a", "a b", "b x", "both c", "both d", "b e"]);
  assert.deepEqual(diff.map(({ a, b }) => [a, b]), [[1, 1], [2, null], [null, 2], [3, 3], [4, 4], [null, 5]]);
  assert.ok(v.lineDiff("", "").length === 0);
  assert.deepEqual(v.lineDiff("", "q").map((line) => line.side), ["b"]);
  const long = Array.from({ length: 60 }, (_, i) => `line ${i}`);
  const shown = v.hunks(v.lineDiff(long.join("\n"), long.with(30, "other").join("\n")), 2);
  assert.deepEqual(shown.map((line) => line?.text ?? "..."), ["...", "line 28", "line 29", "line 30", "other", "line 31", "line 32", "..."]);
  // Random edits: common lines and lines of one text reproduce each text.
  let seed = 7;
  const random = (n) => (seed = (seed * 48271) % 2147483647) % n;
  for (let k = 0; k < 50; ++k) {
    const [a, b] = [0, 1].map(() => Array.from({ length: random(25) }, () => "pqrs"[random(4)]));
    const lines = v.lineDiff(a.join("\n"), b.join("\n"));
    assert.deepEqual(lines.filter((line) => line.side !== "b").map((line) => line.text).join(""), a.join(""));
    assert.deepEqual(lines.filter((line) => line.side !== "a").map((line) => line.text).join(""), b.join(""));
  }
  const other = (name) => Array.from({ length: 3000 }, (_, i) => `${name}${i}`).join("\n");
  assert.equal(v.lineDiff(other("p"), other("q")), null);
});

test("the thesis's formulas are shown on request", () => {
  assert.equal(v.showsPublished({ impact: { show_as_published: false, as_published: {} } }), false);
  assert.equal(v.showsPublished({ impact: { show_as_published: true } }), true);
  assert.equal(v.showsPublished({ impact: { as_published: {} } }), true); // of earlier versions
  assert.equal(v.showsPublished({}), false);
});

test("time after the first overlap is shaded", () => {
  const run = { phases: [{ name: "approach", begin: 0, end: 40 }], end: 40, validUntil: 35.46, data: { label: "" } };
  assert.deepEqual(v.shades([run]).at(-1), { name: v.kBeyond, begin: 35.46, end: 40 });
  assert.notEqual(v.phaseTint(v.kBeyond), "transparent");
  assert.equal(v.shades([{ ...run, validUntil: null }]).length, 1);
});

// ---- Badges ----

test("a completed case without success has no green badge", () => {
  const columns = (values) => Object.entries(values).map(([name, value]) => new v.Field(name, name, "", "", "column", () => Float64Array.of(value)));
  const badge = (status, values) => v.badgeOf(v.tableOf(1, [status], [""], [], columns(values)), 0);
  assert.deepEqual(badge("ok", { success: 0 }), { text: "no success", kind: "failed" });
  assert.deepEqual(badge("ok", { success: 0, captured: 0 }), { text: "no success: not captured", kind: "failed" });
  assert.deepEqual(badge("ok", { success: 1 }), { text: "success", kind: "ok" });
  assert.deepEqual(badge("ok", { "ledger/pass": 0 }), { text: "ledger fails", kind: "failed" });
  assert.deepEqual(badge("ok", { feasible: 0 }), { text: "not feasible", kind: "unreachable" });
  assert.deepEqual(badge("ok", { feasible: NaN, captured: 1 }), { text: "ok", kind: "ok" });
  assert.deepEqual(badge("failed", { success: 0 }), { text: "failed", kind: "failed" });
});

// ---- The replay's picture ----

test("the scale bar is 1, 2 or 5 times a power of ten and fits", () => {
  for (const perPixel of [1e-5, 0.0031, 0.009, 0.02, 0.77, 12]) {
    const bar = v.scaleBar(perPixel, 130);
    assert.ok(bar.pixels <= 130.001 && bar.pixels > 130 / 2.6, `${bar.pixels} px at ${perPixel}`);
    const lead = bar.length / 10 ** Math.floor(Math.log10(bar.length * 1.0001));
    assert.ok([1, 2, 5].some((k) => Math.abs(lead - k) < 1e-6), `${bar.length}`);
  }
  assert.equal(v.scaleBar(0), null);
  near(v.niceLength(0.3), 0.5, 1e-12);
});

test("keys rotate the camera about its target, not over the pole", () => {
  const start = { x: 3, y: 0, z: 4, length: () => 5 };
  const right = v.turned(start, Math.PI / 2, 0);
  near(right.x, 0, 1e-12);
  near(right.y, 3, 1e-12);
  near(right.z, 4, 1e-12);
  const up = v.turned(start, 0, 9);
  near(Math.hypot(up.x, up.y, up.z), 5, 1e-12);
  assert.ok(up.z < 5 && up.x > 0);
});

test("thin rectangles of a mesh are panels, blocks and discs are not", () => {
  // A block of 1 m and, separate from it, a plate of 2 x 1 x 0.02 m.
  const box = (size, at) => Array.from({ length: 8 }, (_, i) => [0, 1, 2].map((k) => at[k] + (((i >> k) & 1) - 0.5) * size[k])).flat();
  const faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]];
  const vertices = [...box([1, 1, 1], [0, 0, 0]), ...box([2, 1, 0.02], [4, 0, 1])];
  const triangles = [...faces.flat(), ...faces.flat().map((i) => i + 8)];
  const parts = v.connectedParts(vertices, triangles);
  assert.deepEqual(parts.map((part) => part.length), [12, 12]);
  assert.equal(v.plateOf(vertices, triangles, parts[0]), undefined);
  const plate = v.plateOf(vertices, triangles, parts[1]);
  plate.size.forEach((size, k) => near(size, [2, 1, 0.02][k], 1e-9));
  near(plate.centre.x, 4, 1e-9);
  near(Math.abs(plate.u.x), 1, 1e-9);
  assert.equal(v.plateOfBox([1, 1, 0.5]), undefined);
  assert.deepEqual(v.plateOfBox([1, 0.01, 3]).size, [3, 1, 0.01]);
  const disc = [0, 0, 0, ...Array.from({ length: 24 }, (_, i) => [Math.cos((i * Math.PI) / 12), Math.sin((i * Math.PI) / 12), 0]).flat()];
  const fan = Array.from({ length: 24 }, (_, i) => [0, 1 + i, 1 + ((i + 1) % 24)]).flat();
  assert.equal(v.plateOf(disc, fan, v.connectedParts(disc, fan)[0]), undefined);
});

test("exactly the shapes of a body are drawn", () => {
  const at = (shape, size, position) => ({ shape, size, position, quaternion_wxyz: [1, 0, 0, 0] });
  const paints = { surface: () => ({}), line: () => ({}), rim: () => ({}), flat: () => ({}) };
  const drawn = (geometry) => {
    const scene = twoArms();
    scene.bodies[3].geometry = geometry;
    return v.buildBodies(fullRun(), scene, paints, "solid")[3];
  };
  const three = drawn([at("box", [1, 1, 1], [0, 0, 0]), at("box", [1, 4, 0.02], [0, 3, 0]), at("sphere", [0.2, 0, 0], [0, 0, 0.7])]);
  assert.deepEqual(three.object.children.map((part) => part.position.toArray()), [[0, 0, 0], [0, 3, 0], [0, 0, 0.7]]);
  near(three.radius, 3 + 0.5 * Math.hypot(1, 4, 0.02), 1e-12);
  assert.equal(drawn([]).object.children.length, 1); // the box of its inertia
  // A grasp point off the surface has a handle to the nearest of the boxes.
  const target = { ...twoArms().bodies[3], geometry: [at("box", [1, 1, 1], [0, 0, 0]), at("box", [1, 4, 0.02], [0, 3, 0])] };
  const point = { target: "debris", name: "bar", position: [0, 4, 0.21], approach_direction: null };
  const [, handle] = v.graspPoint(point, target, 0.1, "target 0", paints).children;
  handle.position.toArray().forEach((x, k) => near(x, [0, 4, 0.11][k], 1e-12));
});

test("a browser without recording gives a message", () => {
  const canvas = { prototype: { captureStream() {} } };
  assert.match(v.videoType({}).why, /cannot record/);
  assert.match(v.videoType({ MediaRecorder: { isTypeSupported: () => false }, HTMLCanvasElement: canvas }).why, /WebM/);
  assert.deepEqual(v.videoType({ MediaRecorder: { isTypeSupported: (type) => /vp8/.test(type) }, HTMLCanvasElement: canvas }), { type: "video/webm;codecs=vp8" });
});

// ---- Comparisons ----

test("scenarios are compared by values, not by how they are written", () => {
  const a = `# a comment
schema: grapnel-scenario/1
robot: {file: r.yaml}   # where
targets:
  - name: "debris # 1"
    position: [1, 2.0,
      3e0]
    spin:
      rate: 5 deg/s
  - name: other
grasps:
- end_effector: left
- end_effector: right
note: |
  two
  lines
`;
  const b = `robot: { file: r.yaml }
schema: grapnel-scenario/1
targets:
  - name: 'debris # 1'
    spin: 
      rate: 8 deg/s
    position: [1.0, 2, 3]
  - name: other
    mass: 7
grasps:
  - end_effector: left
  - end_effector: right
note: |
  two
  lines
`;
  const [x, y] = [a, b].map(v.yamlValues);
  assert.equal(x.get("targets[0].name"), "debris # 1");
  assert.equal(x.get("targets[0].position"), "[1, 2, 3]");
  assert.equal(x.get("grasps[1].end_effector"), "right");
  assert.equal(x.get("note"), "two lines");
  assert.deepEqual(v.valueChanges(x, y), [
    { path: "targets[0].spin.rate", a: "5 deg/s", b: "8 deg/s" },
    { path: "targets[1].mass", a: null, b: "7" },
  ]);
  assert.equal(v.yamlValues("a: &anchor 1\n"), null);
  assert.equal(v.yamlValues("a: [1, 2\n"), null);
});

test("rounding errors are zero and no difference", () => {
  assert.equal(v.quiet(1e-17, 0.5), 0);
  assert.equal(v.quiet(1e-9, 0.5), 1e-9);
  const summary = { impact: { kinetic_energy_before: 2, kinetic_energy_after: 2 - 4e-16, grasps: [] } };
  assert.equal(v.keyFacts(impactRun(null, [], summary)).find((fact) => fact.key === "energy").value, 0);
});

// ---- Keys ----

test("keys reach the replay after any click, except where an element uses them", () => {
  const at = (tag, more = {}) => ({ tag, type: "", editable: false, inside: false, ...more });
  assert.equal(v.leaves(at("BUTTON"), " ", true), true); // clicked: the space bar plays
  assert.equal(v.leaves(at("BUTTON"), " ", false), false); // reached by Tab: it presses
  assert.equal(v.leaves(at("A"), "ArrowLeft", false), true);
  assert.equal(v.leaves(at("INPUT", { type: "search" }), "w", true), false);
  assert.equal(v.leaves(at("INPUT", { type: "range" }), "ArrowLeft", true), false);
  assert.equal(v.leaves(at("INPUT", { type: "range", inside: true }), "ArrowLeft", true), true); // the replay's own
  assert.equal(v.leaves(at("SELECT"), "1", true), false);
  assert.equal(v.leaves(at("DIV"), "w", false), true);
});

// ---- Actuators ----

test("actuators are coloured by the share of their limit", () => {
  assert.equal(v.shareUsed(-200, 400, 300), 0.5);
  assert.equal(v.shareUsed(150, null, 300), 0.5); // without a limit: of the largest value of the run
  assert.equal(v.shareUsed(NaN, 400, 300), 0);
  const hue = (share) => `#${v.saturationColor(share, "light").getHexString()}`;
  assert.equal(hue(0), v.roleColor("idle", "light"));
  assert.equal(hue(1.2), v.roleColor("limit", "light"));
  assert.notEqual(hue(0.7), hue(0));
});

test("the central body has the direction and size of the orbit", () => {
  const six = (...values) => values.map((one) => [one].flat());
  const radial = six(...Array(6).fill([0, 1, 0]));
  const run = impactRun(null, [["orbit/radial", "1", ["x", "y", "z"], radial], ["orbit/radius", "m", ["radius"], six(...Array(6).fill(7e6))]]);
  const body = v.centralBodyOf(run, { central_body: { name: "earth", radius: 6.378137e6 } });
  const { direction, ratio } = body.at({ index: 0, fraction: 0 });
  assert.deepEqual(direction.toArray().map((x) => x + 0), [0, -1, 0]);
  near(ratio, 0.911, 1e-3);
  assert.equal(v.centralBodyOf(impactRun(), { central_body: { name: "earth", radius: 6.378137e6 } }), null);
  assert.equal(v.centralBodyOf(run, { central_body: null }), null);
});

test("three or more grasps show the share of their envelopes", () => {
  const grasp = (name, distance) => ({ end_effector: name, captured: "yes", reason: "", distance, velocity: 0.005 });
  const grasps = [grasp("tip-1", 0.015), grasp("tip-2", 0.04), grasp("tip-3", null)];
  const shares = v.envelopeShares(impactRun(twoArms(), [], { capture: { grasps } }));
  assert.deepEqual(shares.map((one) => one.shares.map((share) => [share.name, share.value / share.limit])), [[["distance", 0.5], ["speed", 0.25]], [["distance", 0.04 / 0.03], ["speed", 0.5]], []]);
  assert.deepEqual(v.envelopeShares(impactRun(twoArms(), [], { capture: { grasps: grasps.slice(0, 2) } })), []);
});
