// Headlines of studies and campaigns, without a browser: none says more than was judged.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { bundle } from "./bundle.mjs";

let m;
before(async () => {
  globalThis.ResizeObserver ??= class {};
  m = await bundle(["study/badge", "campaign/words"]);
});

const table = (columns, status) => {
  const size = Object.values(columns)[0].length;
  const fields = new Map(Object.entries(columns).map(([name, values]) => [name, { name, role: "column", values: Float64Array.from(values) }]));
  return { size, status: status ?? Array(size).fill("ok"), fields: [...fields.values()], find: (name) => fields.get(name) };
};

test("completed points with a negative verdict are not good", () => {
  const points = table({ worst_margin: [-2.137, 0.3, NaN], "ledger/feasible": [1, 0, 1], captured: [1, 1, 1] });
  assert.deepEqual(m.verdictsOf(points), { against: ["1 are not feasible", "1 exceed a rating"], clean: 1 });
  assert.deepEqual(m.badgeOf(points, 0), { text: "rating exceeded", kind: "unreachable" });
  assert.deepEqual(m.badgeOf(points, 1), { text: "not feasible", kind: "unreachable" });
  assert.deepEqual(m.badgeOf(points, 2), { text: "ok", kind: "ok" });
});

test("margins count even if the worst margin is not a column", () => {
  const points = table({ "margins/elbow/force": [0.5, -0.1, NaN], "margins/elbow/moment": [0.2, 0.4, NaN] });
  assert.deepEqual(m.verdictsOf(points), { against: ["1 exceed a rating"], clean: 2 });
  assert.equal(m.badgeOf(points, 0).kind, "ok");
  assert.equal(m.badgeOf(points, 1).text, "rating exceeded");
  assert.equal(m.badgeOf(points, 2).text, "completed, not evaluated");
});

test("a point without verdict columns is only completed", () => {
  assert.deepEqual(m.badgeOf(table({ energy: [1] }), 0), { text: "completed, not evaluated", kind: "other" });
  assert.deepEqual(m.badgeOf(table({ captured: [NaN] }), 0), { text: "completed, not evaluated", kind: "other" });
  assert.deepEqual(m.badgeOf(table({ captured: [1] }, ["failed"]), 0), { text: "failed", kind: "failed" });
});

test("success is a capture probability only if it requires nothing else", () => {
  const name = (...texts) => m.successName({ criteria: texts.map((text) => ({ text, name: text })) });
  assert.equal(name("captured"), "Capture probability");
  assert.equal(name("captured == 1"), "Capture probability");
  assert.equal(name("captured", "kinetic_energy_after < 3"), "Success probability");
  assert.equal(name("kinetic_energy_after < 3"), "Success probability");
  assert.equal(name(), "Success probability");
});
