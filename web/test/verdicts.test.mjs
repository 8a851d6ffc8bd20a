// What the page says first, without a browser: three answers to each question, and where validity ends.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { bundle } from "./bundle.mjs";

let v;
before(async () => {
  globalThis.ResizeObserver ??= class {}; // tables watch their sizes
  v = await bundle(["page/verdict", "plots/phases", "colors"]);
});

const grasp = (captured, more = {}) => ({ end_effector: "tip", target: "debris", captured, judged: captured !== "assumed", distance: 0.106, time: 20, target_moved: 0, ...more });
const capture = (captured, more) => ({ status: "completed", capture: { captured, time: 20, grasps: [grasp(captured, more)] }, ledger: {} });
const answer = (summary, question) => v.shortVerdicts(summary).find((one) => one.question === question);

test("a capture without an envelope is assumed, with its gap", () => {
  const assumed = answer(capture("assumed"), "Capture");
  assert.equal(assumed.tone, "warn");
  assert.match(assumed.word, /Assumed/);
  assert.match(assumed.said, /gap 0\.106\u00a0?\s?m/);
  assert.match(assumed.said, /No envelope says what tip can close on/);
  assert.match(answer(capture("assumed", { target_moved: 0.106 }), "Capture").said, /closed by moving debris by 0\.106/);
  assert.equal(answer(capture("yes"), "Capture").tone, "good");
  assert.equal(answer(capture("no"), "Capture").tone, "bad");
  assert.equal(answer(capture(true), "Capture").tone, "good"); // grapnel-summary/1
});

const row = (pass, more = {}) => ({ value: 0, bound: 0, pass, unit: "m", note: "", applies: true, kind: "feasibility", ...more });
const watched = (feasible, clearance, feasibility) => ({ status: "completed", ledger: { clearance_violation: clearance, feasible }, feasibility });

test("unchecked runs are neither feasible nor infeasible", () => {
  const reason = "switched off by clearance.enabled";
  const unseen = answer(
    watched("not checked", row(null, { applies: false, not_checked: reason }), {
      verdict: "not checked",
      sentence: `feasible: not checked; clearance: ${reason}`,
      not_checked: [`clearance: ${reason}`],
    }),
    "Feasibility",
  );
  assert.equal(unseen.word, "Not checked");
  assert.match(unseen.said, /switched off/);
  assert.equal(answer(watched("yes", row(true), { verdict: "yes", sentence: "feasible: yes, clearance is kept" }), "Feasibility").tone, "good");
  assert.equal(answer(watched(true, row(true, { applies: false })), "Feasibility").word, "Not checked"); // grapnel-summary/1
});

test("the first overlap is reported first", () => {
  const sentence = "feasible: NO, valid until 35.46 s: base and debris overlap from then on (post_impact)";
  const bad = answer(watched("no", row(false), { verdict: "no", sentence, by_phase: [], valid_until: 35.46 }), "Feasibility");
  assert.equal(bad.tone, "bad");
  assert.match(bad.said, /^Valid until 35\.46 s: base and debris overlap/);
  // After a capture that came before it, the capture stands; one that came later is beyond validity.
  const late = capture("yes");
  late.feasibility = { valid_until: 12 };
  assert.equal(answer(late, "Capture").tone, "warn");
});

test("time after the first overlap is shaded", () => {
  const run = { phases: [{ name: "approach", begin: 0, end: 40 }], end: 40, validUntil: 35.46, data: { label: "" } };
  assert.deepEqual(v.shades([run]).at(-1), { name: v.kBeyond, begin: 35.46, end: 40 });
  assert.notEqual(v.phaseTint(v.kBeyond), "transparent");
  assert.equal(v.shades([{ ...run, validUntil: null }]).length, 1);
});

test("loads and control: negative findings are reported first", () => {
  const of = (summary) => answer({ status: "completed", ledger: {}, ...summary }, "Loads and control");
  assert.equal(of({}).word, "Not evaluated");
  assert.equal(of({}).tone, "none");
  const load = (margin, quantity = "force") => ({ of: "elbow", quantity, phase: "contact", peak: 1, time: 0, rating: 1, margin, assumed_duration: false });
  assert.equal(of({ loads: [load(0.2)] }).tone, "good");
  const exceeded = of({ loads: [load(-2.137), load(0.2)] });
  assert.equal(exceeded.tone, "bad");
  assert.match(exceeded.said, /^Ratings exceeded: elbow \(force\)\.$/);
  // A drive at its effort limit is saturated, and exceeds nothing.
  const saturation = [{ actuator: "wheel", name: "wheel-1", quantity: "rate", limit: 418.88, first_time: 10, duration: 52, share: 0.44, at_end: true }];
  const saturated = of({ loads: [load(0, "driving")], saturation });
  assert.equal(saturated.tone, "warn");
  assert.match(saturated.said, /wheel wheel-1, rate, for 52\s?s \(44\s?%\), first at 10\s?s, and at the end/);
  const stability = [{ phase: "post_impact", verdict: "unstable", reason: "the oscillation grows", of: "base x", period: 0.4, amplitude_before: 0.1, amplitude_after: 0.3, saturated_share: 0 }];
  const unstable = of({ saturation, stability });
  assert.equal(unstable.word, "Unstable");
  assert.match(unstable.said, /base x oscillates with a period of 0\.4/);
  const rest = { at_rest: false, time: null, angular_velocity: 0.02, angular_velocity_limit: 0.01, joint: "", joint_rate: 0, joint_rate_limit: null };
  assert.equal(of({ post_impact: { at_rest: rest } }).word, "Not at rest");
  const stable = [{ ...stability[0], verdict: "stable" }];
  assert.equal(of({ stability: stable, post_impact: { at_rest: { ...rest, at_rest: true, time: 31 } } }).word, "At rest");
});
