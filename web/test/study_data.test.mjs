// Computations of study pages, without a browser: tables, filters, lines, cells, bins, extremes, neighbours, text.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { bundle } from "./bundle.mjs";

let s; // all exports of the modules
before(async () => {
  const names = ["field", "choice", "filter", "shape", "csv", "search", "describe", "parallel_layout", "state"];
  s = await bundle(names.map((name) => `study/${name}`));
});

// 2 motions x 3 angles x 4 speeds; point 5 is unreachable.
function sweep() {
  const [motion, angle, speed, impulses, others] = [[], [], [], [], []];
  for (let m = 0; m < 2; ++m)
    for (const a of [0, 30, 60])
      for (const v of [0, 0.1, 0.2, 0.3]) {
        motion.push(m);
        angle.push(a);
        speed.push(v);
        const missing = impulses.length === 5;
        impulses.push(missing ? null : v * 10 + m);
        others.push(missing ? null : v * 5 + a / 10);
      }
  const status = impulses.map((v) => (v === null ? "unreachable" : "ok"));
  return {
    settings: {},
    command: "",
    axes: [
      { name: "motion", unit: "", description: "", labels: ["case 1", "a, \"b\""] },
      { name: "approach_angle", unit: "deg", description: "" },
      { name: "relative_speed", unit: "m/s", description: "" },
    ],
    axis_values: [motion, angle, speed],
    status,
    reason: status.map((v) => (v === "ok" ? "" : "too far")),
    columns: [
      { name: "grasps/tip-1/impulse_magnitude", unit: "N s", description: "" },
      { name: "grasps/tip-2/impulse_magnitude", unit: "N s", description: "" },
      { name: "rows", unit: "1", description: "" },
    ],
    values: [impulses, others, impulses.map(() => 6)],
  };
}

test("columns are combined over grasps, and the largest impulse is shown first", () => {
  const table = s.sweepTable(sweep());
  const main = s.mainColumn(table);
  assert.equal(main.name, "largest of grasps/*/impulse_magnitude");
  assert.equal(main.values[11], 7.5); // 3 of tip-1, 1.5 + 6 of tip-2
  assert.ok(Number.isNaN(main.values[5]));
  assert.ok(!s.informativeColumns(table, 9).some((f) => f.name === "rows"), "the same everywhere: tells nothing");
});

test("components give a norm, margins their minimum", () => {
  const data = sweep();
  const fill = (v) => data.status.map(() => v);
  for (const [name, value] of [["base/angular_velocity_change/x", 1], ["base/angular_velocity_change/y", 2], ["base/angular_velocity_change/z", -2], ["margins/a/force", 0.5], ["margins/b/moment", -0.25]]) {
    data.columns.push({ name, unit: name.startsWith("m") ? "1" : "rad/s", description: "" });
    data.values.push(fill(value));
  }
  const table = s.sweepTable(data);
  assert.equal(table.find("norm of base/angular_velocity_change").values[0], 3);
  assert.equal(table.find("least of margins").values[0], -0.25);
});

test("a line per angle, a panel per motion", () => {
  const table = s.sweepTable(sweep());
  const plan = s.linePlan(table);
  assert.deepEqual([plan.x.name, plan.lines.name, plan.panels.name], ["relative_speed", "approach_angle", "motion"]);
  const { panels, leftOut } = s.linesOf(table, { ...plan, most: 60 });
  assert.equal(leftOut, 0);
  assert.deepEqual(panels.map((p) => p.lines.map((l) => l.level)), [[0, 30, 60], [0, 30, 60]]);
  assert.deepEqual(panels[1].lines[2].points, [20, 21, 22, 23]);
});

test("held axes select points, free ones give lines, and thinned lines keep their ends", () => {
  const table = s.sweepTable(sweep());
  const [motion, angle, speed] = table.axes;
  const query = { x: speed, lines: null, panels: null, held: new Map([[motion.key, 1]]), most: 60 };
  assert.deepEqual(s.linesOf(table, query).panels[0].lines.map((l) => l.points[0]), [12, 16, 20]);
  const few = s.linesOf(table, { ...query, lines: angle, most: 2 });
  assert.deepEqual([few.panels[0].lines.map((l) => l.level), few.leftOut], [[0, 60], 1]);
});

test("cells go half-way to their neighbours", () => {
  const table = s.sweepTable(sweep());
  const [motion, angle, speed] = table.axes;
  const cells = s.cellsOf(table, speed, angle, table.find("rows"), new Map([[motion.key, 1]]), [false, false]);
  assert.equal(cells.length, 12);
  const first = cells[0];
  assert.equal(first.point, 12);
  assert.deepEqual([first.x1, first.x2, first.y1, first.y2].map((v) => Number(v.toFixed(9))), [-0.05, 0.05, -15, 15]);
});

test("filters by range, status and text select the matching points", () => {
  const table = s.sweepTable(sweep());
  const state = new s.StudyState(table);
  let notified = 0;
  state.listenFilter(() => ++notified);
  const angle = table.axes[1];
  state.setRange(angle.key, { field: angle, from: 20, to: 40 });
  assert.equal(state.passingCount, 8);
  state.setFilter({ text: "A, \"B" });
  assert.equal(state.passingCount, 4);
  state.setFilter({ text: "too far" });
  assert.deepEqual([state.passingCount, state.passing[5]], [1, 1]);
  state.setFilter({ text: "", status: "ok" });
  assert.equal(state.passingCount, 7);
  state.setRange(angle.key, null);
  assert.deepEqual([state.passingCount, notified], [23, 5]);
  state.select(99);
  assert.equal(state.selected, null, "there is no such point");
});

test("ordered points: those without a number last, in both directions", () => {
  const table = s.sweepTable(sweep());
  const passing = new Uint8Array(table.size).fill(1);
  for (const descending of [false, true]) {
    const order = s.orderedPoints(table, passing, { field: table.find("grasps/tip-1/impulse_magnitude"), descending });
    assert.equal(order.length, 24);
    assert.equal(order[23], 5);
    assert.equal(order[0], descending ? 15 : 0);
  }
});

test("every number is in one bin, also on bounds and when all are the same", () => {
  const table = s.sweepTable(sweep());
  const passing = new Uint8Array(table.size).fill(1);
  passing[0] = 0;
  for (const field of table.fields) {
    const { bins, missing } = s.binsOf(field, passing);
    assert.equal(bins.reduce((sum, b) => sum + b.all, 0) + missing, 24, field.name);
    for (const bin of bins) assert.ok(bin.to > bin.from && bin.passing <= bin.all);
  }
});

test("extremes and neighbours name points", () => {
  const table = s.sweepTable(sweep());
  const found = s.span(table.find("grasps/tip-1/impulse_magnitude").values);
  assert.deepEqual([found.least, found.leastAt, found.greatest, found.greatestAt, found.numbers], [0, 0, 4, 15, 23]);
  const neighbours = new s.Neighbours(table);
  assert.deepEqual([neighbours.step(5, 0, 1), neighbours.step(5, 1, -1), neighbours.step(5, 2, 1), neighbours.step(23, 0, 1)], [17, 1, 6, undefined]);
});

test("text reads back to the same numbers, with quotes if needed", () => {
  const table = s.sweepTable(sweep());
  const lines = s.pointsToText(table, [5, 23], table.fields).trimEnd().split("\n");
  assert.equal(lines[0].split(",")[2], "approach_angle [deg]");
  assert.match(lines[1], /^5,case 1,30,0\.1,unreachable,too far,NaN,NaN,NaN,6$/);
  assert.ok(lines[2].startsWith('23,"a, ""b""",60,0.3,ok,,7.5,4,7.5,6'));
});

test("geometric axes are distinguished from linear ones", () => {
  const axis = (values) => s.sweepTable({ ...sweep(), axes: [{ name: "m", unit: "", description: "" }], axis_values: [values], status: values.map(() => "ok"), reason: [], columns: [], values: [] }).axes[0];
  assert.ok(s.isGeometric(axis([1e-6, 1e-3, 1, 1e3])));
  assert.ok(!s.isGeometric(axis([1, 2, 3, 4])));
  assert.ok(!s.isGeometric(axis([0, 1, 10, 100])));
});

test("names are shortened and broken without losing their unit", () => {
  assert.deepEqual(s.wrapped("norm of base/angular_velocity_change [rad/s]", 18, 4).at(-1), "change [rad/s]");
  assert.ok(s.wrapped("x".repeat(200), 10, 3).every((line) => line.length <= 10));
  assert.equal(s.shortened("abcdefghijklmnop", 9).length, 9);
  assert.equal(s.counted(1234567), "1\u202f234\u202f567");
});

test("an optimization's best so far ignores unacceptable points", () => {
  const data = {
    comparison: { best: 3, objective: { name: "minimize x" }, variables: [{ name: "a" }] },
    command: "",
    columns: ["point", "a", "acceptable", "objective"].map((name) => ({ name, unit: "1", description: "" })),
    values: [[0, 1, 2, 3], [1, 2, 3, 4], [1, 0, 0, 1], [5, 1, null, 4]],
    search: ["sample", "sample", "sample", "local 1"],
    status: ["ok", "ok", "failed", "ok"],
    reason: ["", "", "x", ""],
  };
  const table = s.optimizationTable(data);
  assert.deepEqual(table.axes.map((a) => a.name), ["a"]);
  assert.equal(table.find("point"), undefined);
  const search = s.searchOf(table, data.comparison);
  assert.deepEqual(search.outcome, ["acceptable", "beyond", "none", "acceptable"]);
  assert.deepEqual([...search.bestSoFar], [5, 5, 5, 4]);
  const upward = s.searchOf(table, { ...data.comparison, objective: { name: "maximize x" } });
  assert.deepEqual([...upward.bestSoFar], [5, 5, 5, 5]);
});

test("tables without rows, columns or keys are tables too", () => {
  const empty = s.sweepTable({ axes: [], columns: [] });
  assert.deepEqual([empty.size, s.mainColumn(empty), s.linePlan(empty).x, s.mapPlan(empty)], [0, undefined, null, null]);
  const none = s.sweepTable({ ...sweep(), values: [] });
  assert.ok(Number.isNaN(s.mainColumn(none).values[0]));
});

test("columns have names for people, which stay distinct", () => {
  for (const [name, words] of [
    ["grasps/tip-1/impulse_magnitude", "tip-1: impulse magnitude"],
    ["grasps/tip-1/impulse/x", "tip-1: impulse x"],
    ["largest of grasps/*/mean_force", "largest of grasps: mean force"],
    ["norm of base/angular_velocity_change", "norm of base: angular velocity change"],
    ["margins/a_b/moment", "margin of a_b: moment"],
    ["joints/a_b/velocity_change", "a_b: velocity change"],
    ["contacts/a_b/tip of c/peak_force", "contact a_b – tip of c: peak force"],
    ["contacts/peak_force", "contacts: peak force"],
    ["grasps/end\nof/captured", "end\nof: captured"],
    ["", ""],
    ["approach_angle", "approach angle"],
    ["targets[0].mass", "targets[0].mass"],
  ])
    assert.equal(s.plainName(name), words);
  const data = sweep();
  data.columns.push({ name: "joints/tip-1/impulse_magnitude", unit: "N m s", description: "" });
  data.values.push(data.status.map(() => 0));
  const { fields } = s.sweepTable(data);
  assert.equal(new Set(fields.map((f) => f.words)).size, fields.length);
});
