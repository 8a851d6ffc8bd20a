// Data of plots and numbers, without a browser: attitude, velocities of grasp points, jumps, ticks, files.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { bundle } from "./bundle.mjs";

let v;
before(async () => {
  v = await bundle(["plots/kinematics", "plots/jumps", "plots/axes", "plots/svg", "plots/gaps", "plots/csv", "format", "run", "clock"]);
});

const near = (a, b, bound) => assert.ok(Math.abs(a - b) < bound, `${a} is not ${b}`);

test("the rotation vector of three turns is continuous, for either sign of the quaternion", () => {
  const n = 400;
  const q = new Float64Array(4 * n);
  for (let i = 0; i < n; ++i) {
    const half = (3 * Math.PI * i) / (n - 1);
    q[4 * i] = Math.cos(half);
    q[4 * i + 3] = Math.sin(half);
  }
  near(v.rotationVectors(q)[3 * (n - 1) + 2], 6 * Math.PI, 1e-9);
  near(v.rotationVectors(q.map((x) => -x))[3 * (n - 1) + 2], 6 * Math.PI, 1e-9);
});

test("a point of a rotated spinning body moves by w x R p", () => {
  // Rotated by 90 degrees about z: (1, 0, 0) is at (0, 1, 0), and w = 2 z moves it along -x.
  const moving = v.pointVelocity([0.5, 0, 0], [0, 0, 2], [Math.SQRT1_2, 0, 0, Math.SQRT1_2], [1, 0, 0]);
  [-1.5, 0, 0].forEach((expected, i) => near(moving[i], expected, 1e-12));
});

test("at samples of equal times a value is that before or after", () => {
  const time = [0, 1, 1, 1, 2];
  const values = [0, 1, 1, 5, 6];
  assert.equal(v.valueAt(time, values, 1), 5);
  assert.equal(v.valueAt(time, values, 1, true), 1);
  assert.equal(v.valueAt(time, values, 1.5), 5.5);
  assert.ok(Number.isNaN(v.valueAt(time, values, 3)));
  const apart = v.setApart([0, 0, 1, 1, 1, 1, 2], 2);
  for (let i = 1; i < apart.length; ++i) assert.ok(apart[i] > apart[i - 1]);
});

test("differences of two runs keep the jumps of both", () => {
  const a = { time: [0, 1, 1, 1, 2], values: [0, 1, 1, 5, 6] };
  const b = { time: [0, 1, 1, 2], values: [1, 2, 7, 8] };
  assert.deepEqual([...v.difference(a, b)], [1, 1, 1, 2, 2]);
});

test("at an impact with four samples the states before and after are compared separately", () => {
  // The last of the approach, the first and last of the contact, the first of the next phase. Earlier versions compared
  // the third one with the state before the impact.
  const time = [0, 20, 20, 20, 20, 30];
  const a = { time, values: [0, 1, 1, 1.5, 1.5, 2], ranks: [0, 0, 0, 1, 1, 0] };
  const b = { time, values: [0, 1.25, 1.25, 1.75, 1.75, 2.25], ranks: [0, 0, 0, 1, 1, 0] };
  assert.deepEqual([...v.difference(a, b)], [0, 0.25, 0.25, 0.25, 0.25, 0.25]);
  // Impacts whose times differ by rounding errors are one instant; a brake is a third state.
  const late = { time: [0, 20.000000001, 20.000000001, 20.000000001, 30], values: [0, 1, 5, 7, 7] };
  assert.deepEqual([...v.difference(a, late)], [0, 0, 0, 5.5, 5.5, 5]);
});

test("lines are interrupted at gaps of the log", () => {
  const samples = Float64Array.from([0, 1, 2, 7, 8, 20]);
  const drawn = (breaks) => {
    const gaps = v.gapped(samples, breaks);
    const line = { label: "a", color: "#000000", dash: [], width: 1, time: gaps.time, values: gaps.values(samples) };
    const svg = v.svgPlot({ id: "g", title: "", xTitle: "", yTitle: "", window: { min: 0, max: 20 }, log: false, lines: [line], phases: [], width: 760, height: 260 });
    return svg.match(/<path d="([^"]*)"[^>]*><title>a</)[1];
  };
  assert.equal(drawn([]).match(/M/g).length, 1);
  assert.equal(drawn([3, 5]).match(/M/g).length, 3);
  assert.deepEqual([...v.gapped(samples, [3]).time], [0, 1, 2, 4.5, 7, 8, 20]);
});

test("ticks have enough digits to be distinct", () => {
  assert.deepEqual(v.tickTexts(v.ticks({ min: -0.13, max: 0.21 }, 5)), ["−0.1", "0.0", "0.1", "0.2"]);
  assert.deepEqual(v.tickTexts([0, 2e-5, 4e-5]), ["0", "2e−5", "4e−5"]);
});

test("numbers for people", () => {
  assert.equal(v.number(0.1281402), "0.1281");
  assert.equal(v.number(10000), "10000");
  assert.equal(v.number(-70), "−70");
  assert.equal(v.number(1e-10), "10⁻¹⁰");
  assert.equal(v.number(-6.42e-12), "−6.42·10⁻¹²");
  assert.equal(v.number(null), "–");
  assert.equal(v.number(NaN), "–");
});

test("CSV numbers read back to the same single, fields are quoted", () => {
  assert.equal(v.numberText(Math.fround(0.1)), "0.1");
  assert.equal(v.field('a"b,c'), '"a""b,c"');
});

test("an exported SVG has no markup from names and no NaN", () => {
  const svg = v.svgPlot({
    id: "a b",
    title: '<x>"&',
    xTitle: "t",
    yTitle: "</svg>",
    window: { min: 0, max: 2 },
    log: false,
    width: 400,
    height: 250,
    phases: [{ name: "a<b", begin: 0, end: 1, tint: "rgba(0,114,178,0.07)" }],
    lines: [{ label: "<script>", color: "#000", dash: [2], width: 1, time: [0, 1, 1, 1, 2], values: [0, NaN, 2, 3, 1e30] }],
  });
  assert.doesNotMatch(svg, /<script>|<x>|NaN|Infinity/);
});

const base64 = (array) => Buffer.from(array.buffer).toString("base64");
function run() {
  const time = Float64Array.of(0, 1, 1, 3);
  return new v.Run({
    label: "",
    summary: {},
    scene: null,
    notes: [],
    series: {
      samples: 4,
      of: 4,
      bound: 0,
      time: base64(time),
      phase: base64(Uint8Array.of(0, 0, 1, 1)),
      phases: ["approach", "post_impact"],
      series: [{ path: "a", unit: "m", description: "", components: ["x", "y"], data: base64(Float32Array.of(0, 1, 2, 3, 5, 5, 9, 7)) }],
    },
  });
}

test("a run is sampled between its samples, and after an impact at the impact", () => {
  const one = run();
  const a = one.series("a");
  assert.deepEqual(one.at(a, one.locate(0.5)), [1, 2]);
  assert.deepEqual(one.at(a, one.locate(1)), [5, 5]);
  assert.deepEqual(one.at(a, one.locate(2)), [7, 6]);
  assert.deepEqual(one.at(a, one.locate(99)), [9, 7]);
  assert.deepEqual(one.at(a, one.locate(-1)), [0, 1]);
  assert.deepEqual(one.phases.map((p) => [p.name, p.begin, p.end]), [["approach", 0, 1], ["post_impact", 1, 3]]);
});

test("series of the wrong length are refused", () => {
  const data = run().data;
  data.series.series[0].data = base64(Float32Array.of(1, 2, 3));
  assert.throws(() => new v.Run(data), /a: damaged data/);
});

test("a clock stays within its run", () => {
  const clock = new v.Clock(0, 10);
  let notified = 0;
  const end = clock.listen(() => ++notified);
  clock.time = 99;
  assert.equal(clock.time, 10);
  clock.time = NaN;
  assert.equal(clock.time, 0);
  end();
  clock.time = 5;
  assert.equal(notified, 2);
});
