// What the pages of campaigns compute, without a browser: the model from campaign.json, intervals, distribution functions,
// quantile bands, contours, the sample.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { bundle } from "./bundle.mjs";
import { campaignData, campaignStatistics } from "./made_campaign.mjs";

let c; // all that the modules export
before(async () => {
  const names = ["model", "read", "sample", "wilson", "words", "bands", "cumulative", "contours", "map_grid", "pick", "names", "contour_labels"];
  c = await bundle(["format", ...names.map((name) => `campaign/${name}`)]);
});

const near = (a, b, bound, what = "") => assert.ok(Math.abs(a - b) <= bound, `${what} ${a} for ${b}`);

test("Wilson's interval has known values", () => {
  near(c.normalQuantile(0.975), 1.959963984540054, 1e-12);
  near(c.normalQuantile(0.995), 2.5758293035489004, 1e-12);
  near(c.normalQuantile(0.9999995), 4.891638475699587, 1e-8);
  // Newcombe 1998, table I: 81 of 263 and 1 of 29, 0 of 20 and 29 of 29.
  for (const [x, n, low, high] of [[81, 263, 0.2553, 0.3662], [15, 148, 0.0624, 0.1605], [0, 20, 0, 0.1611], [1, 29, 0.0061, 0.1718], [29, 29, 0.883, 1]]) {
    const p = c.wilson(x, n, 0.95);
    near(p.lower, low, 5e-5, `lower of ${x}/${n}`);
    near(p.upper, high, 5e-5, `upper of ${x}/${n}`);
  }
  const none = c.wilson(0, 0, 0.95);
  assert.ok(Number.isNaN(none.estimate) && none.lower === 0 && none.upper === 1);
});

test("probabilities keep the digits that tell them from 0 and 1", () => {
  assert.deepEqual([0.9127, 0.99998, 1, 0, 0.000012, 0.5, NaN].map((p) => c.probability(p)), ["0.9127", "0.999980", "1", "0", "0.000012", "0.5000", "–"]);
});

test("the model matches campaign.json", () => {
  const data = campaignData();
  const m = c.campaignModel(data);
  const s = data.statistics;
  assert.deepEqual([m.name, m.rows, m.total, m.confidence], ["made up", 200, 200, 0.95]);
  assert.deepEqual([m.success.estimate, m.success.lower, m.success.upper], [s.success.estimate, s.success.lower, s.success.upper]);
  assert.equal(m.success.successes, s.counts.success);
  assert.deepEqual(m.criteria.map((k) => [k.name, k.successes, k.trials, k.onlyThis]), [["captured", 196, 200, 4], ["soft", 188, 200, 12]]);
  // Of a magnitude both signs are limits.
  assert.deepEqual(m.limits.map((l) => [l.column, l.value, l.atMost]), [["impulse", 0.55, true], ["impulse", -0.55, false]]);
  assert.deepEqual(m.sensitivities[0].influences.map((i) => [i.input, i.firstOrder]), [["mass", 0.6], ["rate", 0.1]]);
  for (const d of c.describedOf(m)) {
    const h = d.histogram;
    assert.equal(h.counts.reduce((a, b) => a + b, 0) + h.below + h.above, d.count, d.name);
    for (let k = 0; k < h.counts.length; ++k) assert.ok(h.successes[k] <= h.counts[k]);
  }
});

test("groups of an input with few values are one per value", () => {
  const data = campaignData();
  data.statistics.inputs[0].success_by = { from: [0, 0, 0, 0.1], to: [0, 0, 0.1, 0.1], trials: [10, 10, 10, 10], successes: [9, 8, 7, 6] };
  const groups = c.campaignModel(data).inputs[0].successBy;
  assert.deepEqual(groups.map((g) => [g.from, g.to, g.trials, g.successes]), [[0, 0, 20, 17], [0, 0.1, 10, 7], [0.1, 0.1, 10, 6]]);
});

test("empty documents, missing keys and wrong types give a model", () => {
  for (const statistics of [null, {}, [], "x", { criteria: 3, inputs: {}, columns: [null, 7], worst: [null], reasons: [{}], sensitivity: [], success_map: { axes: [] } }])
    assert.ok(c.campaignModel({ statistics, rows: 0 }).inputs);
  const whole = campaignStatistics();
  const walk = (value, path) => {
    if (value === null || typeof value !== "object") return [path];
    return [path, ...Object.keys(value).slice(0, 40).flatMap((k) => walk(value[k], [...path, k]))];
  };
  const paths = walk(whole, []).slice(1);
  assert.ok(paths.length > 200, `${paths.length} keys`);
  for (const path of paths) {
    for (const change of [undefined, null, "x", -1, {}, []]) {
      const copy = structuredClone(whole);
      const parent = path.slice(0, -1).reduce((v, k) => v[k], copy);
      if (change === undefined && !Array.isArray(parent)) delete parent[path.at(-1)];
      else parent[path.at(-1)] = change ?? null;
      assert.doesNotThrow(() => c.campaignModel({ statistics: copy, rows: 200 }), path.join("/"));
    }
  }
});

test("reasons of failures, assumed successes and saved cases are present", () => {
  const data = campaignData();
  assert.equal(c.campaignModel(data).failuresAreAll, false);
  Object.assign(data.statistics, {
    warnings: ["in all successes the grasps are assumed to close"],
    failures: [{ status: "ok", reason: "not met: soft", count: 12, examples: [{ index: 3, reason: "not met: soft", replay: "x" }] }],
    failures_left_out: 1,
    grasps: [{ end_effector: "tip-1", captured: 190, missed: 10, tolerances: [{ name: "position", exceeded: 9, limiting: 7 }] }],
  });
  data.statistics.success.assumed = 184;
  data.statistics.criteria[1].not_checked = 3;
  data.statistics.sensitivity.groups = [{ name: "both", design: false, inputs: ["mass", "rate"] }];
  data.statistics.sensitivity.measures[0].groups = { first_order: [0.8], error: [0.02], rank_correlation: [null] };
  data.statistics.sensitivity.measures[0].unexplained = 0.2;
  const m = c.campaignModel(data);
  assert.deepEqual([m.failures[0].reason, m.failuresAreAll, m.failuresLeftOut, m.warnings.length, m.assumed], ["not met: soft", true, 1, 1, 184]);
  assert.deepEqual(m.grasps, [{ endEffector: "tip-1", captured: 190, missed: 10, tolerances: [{ name: "position", exceeded: 9, limiting: 7 }] }]);
  assert.deepEqual([m.criteria[1].notChecked, m.criteria[1].reads, [...m.saved]], [3, ["impulse"], [2, 13]]);
  const [success, impulse] = m.sensitivities;
  assert.deepEqual([success.groups[0].input, success.groups[0].firstOrder, success.unexplained, impulse.groups.length], ["both", 0.8, 0.2, 0]);
});

test("a point of a success map has its decisive criterion", () => {
  const { points } = c.campaignModel(campaignData("map")).successMap;
  assert.deepEqual([points[0].deciding, points[5].deciding, points[11].deciding], ["", "soft", "captured"]);
  assert.deepEqual(points[11].unmet, [{ criterion: "captured", count: 100 }, { criterion: "soft", count: 100 }]);
});

test("the sample is a table of cases with their indices", () => {
  const sample = c.sampleOf(campaignData());
  assert.deepEqual([sample.table.size, sample.complete, sample.table.noun], [200, true, "case"]);
  assert.equal(sample.table.numbers[3], 3);
  assert.deepEqual(sample.table.axes.map((a) => a.name), ["mass", "rate"]);
  assert.equal(sample.table.status[13], "failed");
  assert.equal(sample.table.reason[13], "no convergence");
  assert.ok(Number.isNaN(sample.table.find("impulse").values[13]));
  assert.equal(sample.successField.labelOf(sample.successField.values[0]), "success");
  const none = c.sampleOf({ statistics: {}, rows: 10, sample: null });
  assert.deepEqual([none.table.size, none.complete], [0, false]);
});

test("columns that criteria limit come first", () => {
  const m = c.campaignModel(campaignData());
  assert.equal(c.mainDescribed(m).name, "impulse");
  const sample = c.sampleOf(campaignData());
  assert.deepEqual(sample.table.fields.filter((f) => f.role === "column").map((f) => f.name), ["success", "captured", "impulse", "energy"], "in the file energy is the first");
  assert.deepEqual([...new Set(c.optionsOf(m).map((o) => o.group))], ["In the criteria", "Columns", "Inputs"]);
});

test("the distribution function never falls, and meets its quantiles", () => {
  const m = c.campaignModel(campaignData());
  const of = m.columns.find((d) => d.name === "impulse");
  const points = c.cumulative(of);
  for (let k = 1; k < points.length; ++k) assert.ok(points[k].share >= points[k - 1].share && points[k].value >= points[k - 1].value);
  assert.equal(points.at(-1).share, 1);
  for (const q of of.quantiles) near(c.shareAt(points, q.value), q.probability, 0.03, `at ${q.value}`);
  assert.deepEqual([c.shareAt(points, -1e9), c.shareAt(points, 1e9)], [0, 1]);
  near(c.bandWidth(1000, 0.95), 0.04294694, 1e-8);
  assert.equal(c.bandWidth(0, 0.95), 1);
});

test("quantile bands match each group, and few points have none", () => {
  const n = 4000;
  const x = Float64Array.from({ length: n }, (_, k) => (k * 0.6180339887498949) % 1);
  const y = Float64Array.from(x, (v, k) => 10 * v + ((k * 0.7548776662466927) % 1)); // uniform over [10 x, 10 x + 1]
  const bands = c.quantileBands(x, y, [...x.keys()], 20);
  assert.equal(bands.length, 20);
  for (const b of bands) {
    assert.equal(b.count, 200);
    near(b.middle, 10 * b.x + 0.5, 0.12);
    assert.ok(b.low < b.middle && b.middle < b.high);
  }
  assert.deepEqual(c.quantileBands(x, y, [1, 2, 3]), []);
  y.fill(NaN);
  assert.deepEqual(c.quantileBands(x, y, [...x.keys()]), []);
});

test("contours of a plane are straight, complete and correctly placed", () => {
  const x = [0, 1, 3, 4];
  const y = [0, 2, 5];
  const values = y.map((v) => x.map((u) => u + v)); // level u + v = 4
  const lines = c.joined(c.contourSegments(x, y, values, 4.1));
  assert.equal(lines.length, 1, "pieces are joined");
  for (const [u, v] of lines[0]) near(u + v, 4.1, 1e-12);
  assert.deepEqual(c.contourSegments(x, y, values, 99), []);
  values[1][1] = NaN;
  assert.ok(c.contourSegments(x, y, values, 4.1).length < lines[0].length - 1);
});

test("a circle's contour closes, a saddle has two lines", () => {
  const x = Array.from({ length: 41 }, (_, k) => k / 20 - 1);
  const values = x.map((v) => x.map((u) => Math.hypot(u, v)));
  const [line, ...more] = c.joined(c.contourSegments(x, x, values, 0.7));
  assert.equal(more.length, 0);
  assert.deepEqual(line[0], line.at(-1));
  for (const [u, v] of line) near(Math.hypot(u, v), 0.7, 2e-3);
  assert.equal(c.contourSegments([0, 1], [0, 1], [[1, 0], [0, 1]], 0.6).length, 2);
});

test("a success map is a grid, the first axis upward", () => {
  const data = campaignData("map");
  const e = c.campaignModel(data).successMap;
  assert.deepEqual(e.axes.map((a) => a.values.length), [3, 4]);
  assert.deepEqual([e.points[5].at, e.points[5].successes, e.points[5].trials], [[1, 1], 95, 100]);
  const grid = c.gridOf(e);
  assert.equal(grid[1][1], e.points[5]);
  assert.deepEqual(c.cellEdges([0, 1, 3]), [-0.5, 0.5, 2, 4]);
  near(e.points[5].lower, c.wilson(95, 100, 0.95).lower, 1e-12);
  const turned = campaignData("map").statistics;
  turned.success_map.axes[1].values.reverse();
  const other = c.campaignModel({ statistics: turned, rows: 0 }).successMap;
  assert.deepEqual([other.axes[1].values, c.gridOf(other)[1][2].successes], [[5, 10, 20, 40], 95], "values that decrease are turned round");
  data.statistics.success_map.trials[5] = 0;
  assert.ok(Number.isNaN(c.campaignModel(data).successMap.points[5].estimate));
});

test("units are read as kg m², and written to files as kg m^2", () => {
  const shown = ["kg m^2", "m/s^2", "1/s^2", "m^-1", "N/m^1.5", "rad/s", "1", ""].map(c.unitText);
  assert.deepEqual(shown, ["kg\u00a0m²", "m/s²", "1/s²", "m⁻¹", "N/m^1.5", "rad/s", "", ""]);
  assert.deepEqual([c.label("inertia", "kg m^2"), c.label("share", "1")], ["inertia [kg\u00a0m²]", "share"]);
  assert.equal(c.withUnit(1.5, "kg m^2"), "1.5 kg\u00a0m²");
  assert.equal(c.columnHead("inertia", "kg m^2"), "inertia [kg m^2]");
});

test("shortened names of inputs remain distinct", () => {
  const names = [1, 2].flatMap((k) => ["mass", "state.angular_velocity/x", "state.angular_velocity/length", "grasp_points.grip.position/y"].map((n) => `targets.target-${k}.${n}`));
  assert.deepEqual(c.distinctNames(names, 99), names);
  for (const most of [45, 36, 30, 26, 22]) {
    const short = c.distinctNames(names, most);
    assert.equal(new Set(short).size, names.length, `${most}: ${short}`);
    for (const name of short) assert.ok(name.length <= most, `${name} in ${most}`);
  }
  assert.equal(c.distinctNames(names, 40)[2], "…target-1.state.angular_velocity/length");
  assert.deepEqual(c.distinctNames(["a".repeat(40), ""], 10).map((n) => n.length), [10, 0]);
});

test("names of contours lie on their lines, inside, and on no other name", () => {
  const frame = { left: 0, right: 600, top: 0, bottom: 300 };
  // Lines 6 pixels apart, which all have their middle at the same place; a short one; one that reaches beyond the frame.
  const lines = [0, 6, 12, 18, 24].map((d, k) => ({ text: `0.${k}9`, points: [[20, 100 + d], [300, 90 + d], [580, 100 + d]] }));
  lines.push({ text: "short", points: [[50, 250], [60, 250]] }, { text: "long", points: [[-400, 200], [150, 200], [150, 290]] });
  const labels = c.placeLabels(lines, frame);
  assert.deepEqual(labels.map((l) => l.text).sort(), ["0.09", "0.19", "0.29", "0.39", "0.49", "long"]);
  for (const [k, a] of labels.entries()) {
    assert.ok(a.box.left >= frame.left && a.box.right <= frame.right && a.box.top >= frame.top && a.box.bottom <= frame.bottom, a.text);
    for (const b of labels.slice(k + 1)) assert.ok(!c.overlap(a.box, b.box), `${a.text} on ${b.text}`);
    assert.ok(c.crosses(lines.find((l) => l.text === a.text).points, { left: a.x - 0.1, right: a.x + 0.1, top: a.y - 0.1, bottom: a.y + 0.1 }), `${a.text} beside its line`);
  }
  // Where there is room, clear of other lines too.
  const apart = c.placeLabels([{ text: "a", points: [[0, 0], [600, 300]] }, { text: "b", points: [[0, 300], [600, 0]] }], frame);
  assert.equal(apart.length, 2);
  assert.ok(!c.crosses([[0, 300], [600, 0]], apart[0].box) && !c.crosses([[0, 0], [600, 300]], apart[1].box));
  assert.deepEqual([c.crosses([[0, 0], [10, 10]], { left: 4, right: 6, top: 0, bottom: 3 }), c.crosses([[0, 0], [10, 10]], { left: 4, right: 6, top: 0, bottom: 5 })], [false, true]);
  assert.deepEqual(c.placeLabels([], frame), []);
});
