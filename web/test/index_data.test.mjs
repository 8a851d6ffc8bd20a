// The page over a folder of results, without a browser: counts, filter, addresses, times.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { bundle } from "./bundle.mjs";

let v;
before(async () => {
  globalThis.ResizeObserver ??= class {};
  v = await bundle(["index_page"]);
});

const run = { kind: "run", path: "a/b", title: "first", answers: [{ word: "Captured", sentence: "All grasps closed." }], fault: "" };

test("kinds are counted in words", () => {
  assert.deepEqual(v.counts([run, run, { kind: "sweep" }, { kind: "campaign" }, { kind: "optimization" }]), ["2 runs", "1 study", "1 campaign", "1 optimization"]);
  assert.deepEqual(v.counts([{ kind: "sweep" }, { kind: "sweep" }]), ["2 studies"]);
});

test("the filter needs all words, in name, folder or verdict", () => {
  assert.equal(v.matches(run, "captured FIRST", ""), true);
  assert.equal(v.matches(run, "captured second", ""), false);
  assert.equal(v.matches(run, "", "sweep"), false);
  assert.equal(v.matches(run, "", "run"), true);
});

test("addresses are relative, whatever folders are named", () => {
  assert.equal(v.linkTo("a/b", "report.html"), "./a/b/report.html");
  assert.equal(v.linkTo(".", "report.html"), "./report.html");
  assert.equal(v.linkTo("../out/x", "report.html"), "./../out/x/report.html");
  assert.equal(v.linkTo("javascript:alert(1)/a?b#c", "report.html"), "./javascript%3Aalert(1)/a%3Fb%23c/report.html");
  assert.equal(v.linkTo('x"><img onerror=1>', "r"), "./x%22%3E%3Cimg%20onerror%3D1%3E/r");
});

test("times are in UTC and sort as text", () => {
  assert.equal(v.timeText(1796071292), "2026-11-30 20:41");
  assert.equal(v.timeText(0), "–");
});
