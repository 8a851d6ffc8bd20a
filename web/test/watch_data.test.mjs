// The live page's numbers: shares, time left, and the running estimate.
import assert from "node:assert/strict";
import { test } from "node:test";
import { bundle } from "./bundle.mjs";

const { share, timeLeft, estimates, durationText } = await bundle(["watch/progress"]);

const state = (more) => ({ elapsed: 10, stopping: false, ending: null, report: false, samples: 0, phases: [], messages: [], notes: "", unit: "", history: [], ...more });

test("a phase's share and time left follow its rate", () => {
  const phase = { name: "approach", from: 2, at: 4, end: 10, begun: 1, latest: 5, unit: "s" };
  assert.equal(share(phase), 0.25);
  assert.equal(share({ ...phase, end: 2 }), 1);
  assert.equal(timeLeft(state({ phases: [phase] })), 12); // 0.5 simulated s per s
  assert.equal(timeLeft(state({ phases: [{ ...phase, unit: "evaluations" }] })), null);
  assert.equal(timeLeft(state({ phases: [phase], ending: "done" })), null);
});

test("a resumed campaign's time left counts only its own cases", () => {
  assert.equal(timeLeft(state({ unit: "case", total: 100, begun_with: 40, history: [[5, 40, 30, 0], [15, 60, 50, 0]] })), 20); // since the first entry
  assert.equal(timeLeft(state({ unit: "case", total: 100, begun_with: 40, history: [[1, 40, 30, 0]] })), null);
});

test("estimates have Wilson's interval and growing counts", () => {
  const made = estimates(state({ unit: "case", total: 20, history: [[1, 10, 8, 0], [2, 10, 8, 0], [3, 20, 15, 1]] }), 0.95);
  assert.deepEqual(made.cases, [10, 20]);
  assert.deepEqual(made.estimate, [0.8, 0.75]);
  assert.ok(Math.abs(made.lower[0] - 0.4902) < 1e-4 && Math.abs(made.upper[0] - 0.9433) < 1e-4); // Wilson 1927
});

test("durations have a unit of their size", () => {
  assert.deepEqual([45, 600, 10800].map(durationText), ["45 s", "10 min", "3.0 h"]);
});
