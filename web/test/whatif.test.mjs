// The panel "What if" in a browser, with variants that the program has computed: fields, errors, the variant in replay,
// plots and tables, kept variants, links, accessibility, phone width. Without an engine the page has no panel.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import path from "node:path";
import { before, describe } from "node:test";
import { axeContrastFaults, axeFaults, downloaded, grapnel, open, program, scenario, scratch, source, test } from "./browser.mjs";
import { bundle } from "./bundle.mjs";
import { dataOf, settablesOf, variantPage } from "./variant_page.mjs";

const v = await bundle(["whatif/yaml_places", "format"]);
const folder = scratch();
const kScenario = scenario("thesis/closed-loop.yaml");
const kSpin = ["targets.sphere.state.angular_velocity", [0, 0, 0.4]];
const kMass = (mass) => ["targets.sphere.mass", mass];

let report, page_;
const results = {};
before(async () => {
  const run = (name, ...overrides) => {
    const out = path.join(folder, name);
    const settings = overrides.flatMap(([at, value]) => ["--set", `${at}=${JSON.stringify(value)}`]);
    grapnel(["run", kScenario, "-o", out, "--quiet", "--set", "post_impact.duration=4", ...settings]);
    return { summary: JSON.parse(readFileSync(path.join(out, "summary.json"), "utf8")), run: dataOf(path.join(out, "report.html")).runs[0] };
  };
  results.base = run("base");
  results.spin = run("spin", kSpin);
  results.longer = run("longer", ["approach.duration", 30]);
  report = path.join(folder, "base", "report.html");
  const values = v.plainValue(v.readYaml(readFileSync(kScenario, "utf8")));
  values.robot = v.plainValue(v.readYaml(readFileSync(path.join(source, "robots/planar-dual-arm-forks.yaml"), "utf8")));
  const key = (...overrides) => JSON.stringify(overrides);
  // A map of two by two cells, one of which is an error.
  const cell = (rate, mass) => key([kSpin[0], [0, 0, rate]], kMass(mass));
  results.heavy = run("heavy", kMass(20));
  const errors = { [cell(0.4, 20)]: "no configuration reaches the grasp points", [key(kMass(-10))]: messages(kMass(-10)), [key(["approach.durration", 5])]: messages(["approach.durration", 5]) };
  const variants = { [cell(0.2, 10)]: results.base, [cell(0.4, 10)]: results.spin, [cell(0.2, 20)]: results.heavy, [key(kSpin)]: results.spin, [key(["approach.duration", 30])]: results.longer };
  page_ = await variantPage(report, path.join(folder, "whatif.html"), { paths: settablesOf(values), variants, errors });
});

// The program's messages for an override with an error.
function messages([at, value]) {
  try {
    execFileSync(program, ["check", kScenario, "--set", `${at}=${JSON.stringify(value)}`], { stdio: ["ignore", "pipe", "pipe"] });
  } catch (error) {
    return String(error.stderr).trim();
  }
  throw new Error(`${at}: no error`);
}

const exact = (page, name) => page.locator(`.wi input[type="number"][aria-label^="${name}"]`).first(); // the target's before the base's
const shows = (page, text) => page.locator(".wi-status", { hasText: text }).waitFor();

describe("what if", () => {
  test("a run without an engine has no panel", async () => {
    const { page, context } = await open(report, { webgl: false });
    assert.equal(await page.locator("#whatif, .wi").count(), 0);
    await context.close();
  });

  test("a variant stands beside the base case in tables, replay and plots", async () => {
    const { page, context, faults } = await open(page_);
    await exact(page, "Spin rate").fill("0.4");
    await shows(page, "The variant captures");
    const row = page.locator(".wi-results table tr", { hasText: "Impulse, tip-1" });
    const [base, spin] = [results.base, results.spin].map((one) => one.summary.impact.grasps[0].impulse_magnitude);
    const cells = await row.locator("td").allTextContents();
    assert.deepEqual(cells.slice(0, 4), [base, spin, spin - base].map((x) => v.number(x)).concat(v.number((100 * (spin - base)) / base, 3)));
    assert.ok(Math.abs(spin / base - 2) < 0.2); // the impulse grows with the spin
    assert.match(await page.locator(".wi-results").innerText(), /Ledgers of both/);
    // Replay: the variant's end is the end in its summary.
    const end = await page.evaluate(() => {
      window.__grapnel.clock.time = window.__grapnel.clock.end;
      return [0, 1].map((run) => window.__grapnel.replay.bodyPose("sphere", run).quaternion_wxyz);
    });
    [results.base, results.spin].forEach(({ summary }, run) => {
      const q = summary.post_impact.end.targets[0].quaternion_wxyz;
      assert.ok(Math.abs(Math.abs(q.reduce((sum, x, k) => sum + x * end[run][k], 0)) - 1) < 1e-6, `run ${run}`);
    });
    assert.match(await page.locator(".replay-legend").innerText(), /variant: translucent/);
    const series = () => page.evaluate(() => window.__grapnel.plots.flatMap((plot) => plot.series));
    assert.ok((await series()).some((one) => one.endsWith(" variant")));
    await page.locator("#overlay-or-difference").selectOption("difference");
    assert.ok(!(await series()).some((one) => one.endsWith(" variant")));
    // A longer variant extends the time.
    await page.getByRole("button", { name: "Spin rate: value of the base case" }).click();
    await shows(page, "The base case is shown");
    assert.equal(await page.evaluate(() => window.__grapnel.replay.bodyPose("sphere", 1)), null);
    await exact(page, "Time to capture").fill("30");
    await shows(page, "The variant captures");
    assert.equal(await page.evaluate(() => window.__grapnel.clock.end), results.longer.summary.post_impact.end.time);
    await page.getByRole("button", { name: "Back to the base case" }).click();
    assert.equal(await page.evaluate(() => window.__grapnel.clock.end), results.base.summary.post_impact.end.time);
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("errors stand beside their field; cancelling and keys work; variants are kept, named and shared", async () => {
    const { page, context, faults } = await open(page_, { webgl: false });
    await exact(page, "Mass, times").fill("-1");
    const error = page.locator(".wi-field", { hasText: "Mass, times" }).first().locator(".wi-error");
    await error.filter({ hasText: /mass/ }).waitFor();
    assert.equal(await exact(page, "Mass, times").getAttribute("aria-invalid"), "true");
    await page.getByRole("button", { name: "Mass, times: value of the base case" }).first().click();
    assert.equal(await error.isVisible(), false);
    // A path by keyboard.
    await page.getByText("Any other value by its path").click();
    const combobox = page.getByRole("combobox", { name: "Path of a value" });
    await combobox.fill("appr durat");
    await combobox.press("ArrowDown");
    assert.equal(await page.locator('.wi-options [aria-selected="true"] code').innerText(), "approach.duration");
    await combobox.press("Enter");
    assert.equal(await page.getByRole("textbox", { name: "Value" }).inputValue(), "20");
    await page.getByRole("textbox", { name: "Value" }).fill("30");
    await page.evaluate(() => (window.__engine.delay = 60_000));
    await page.keyboard.press("Enter");
    await page.getByRole("button", { name: "Cancel" }).click();
    await shows(page, "Cancelled.");
    await page.evaluate(() => (window.__engine.delay = 0));
    assert.equal(await exact(page, "Time to capture").inputValue(), "30"); // a path that has a field moves it
    await combobox.fill("approach.durration");
    await page.getByRole("textbox", { name: "Value" }).fill("5");
    await page.getByRole("button", { name: "Time to capture: value of the base case" }).click();
    await page.getByRole("textbox", { name: "Value" }).press("Enter");
    await page.locator(".wi-others .wi-error", { hasText: "durration" }).waitFor();
    await page.getByRole("button", { name: "Remove approach.durration" }).click();
    // Kept, named, shared and removed.
    await exact(page, "Spin rate").fill("0.4");
    await shows(page, "The variant captures");
    await page.getByRole("textbox", { name: "Name of this variant" }).fill("<b>fast</b>");
    await page.getByRole("button", { name: "Keep this variant" }).click();
    const kept = page.locator(".wi-kept tbody tr");
    assert.equal(await kept.count(), 2);
    assert.equal(await kept.nth(1).getByRole("textbox").inputValue(), "<b>fast</b>");
    const [file] = await Promise.all([page.waitForEvent("download"), kept.nth(1).getByRole("button", { name: /^Overrides/ }).click()]);
    assert.match((await downloaded(file)).toString(), /--set 'targets\.sphere\.state\.angular_velocity=\[0, 0, 0\.4\]'/);
    assert.deepEqual(await axeFaults(page), []);
    await page.emulateMedia({ colorScheme: "dark" });
    assert.deepEqual(await axeContrastFaults(page), []);
    await page.setViewportSize({ width: 390, height: 800 });
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
    await kept.nth(1).getByRole("button", { name: /^Remove/ }).click();
    assert.equal(await kept.count(), 0);
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("a link computes its variant; a hostile one stays text", async () => {
    const fragment = (name, set) => `#variant=${encodeURIComponent(JSON.stringify({ name, plan: "again", set }))}`;
    const { page, context, faults } = await open(page_, { webgl: false });
    const follow = (hash) => page.evaluate((to) => (location.hash = to), hash);
    await follow(fragment("<img src=x onerror=planted=1>", [kSpin]));
    await shows(page, "The variant captures");
    assert.match(await page.locator(".wi-results h3").innerText(), /^<img src=x/);
    assert.equal(await exact(page, "Spin rate").inputValue(), "0.4");
    await follow(fragment("x", [["<img src=x onerror=planted=1>", "</script><script>planted=1</script>"]]));
    await page.locator(".wi-others .wi-error", { hasText: "no variant" }).waitFor();
    await follow("#variant=%7B");
    await page.locator(".wi-errors", { hasText: "not JSON" }).waitFor();
    assert.equal(await page.evaluate(() => window.planted), undefined);
    assert.equal(await page.locator("main img").count(), 0);
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("maps are computed cell by cell, and a cell becomes the variant", async () => {
    const { page, context, faults } = await open(page_, { webgl: false });
    await page.getByText("Maps over two quantities").click();
    const axis = async (side, name, from, to) => {
      const set = page.getByRole("group", { name: `Axis ${side}` });
      await set.getByRole("combobox").selectOption({ label: name });
      for (const [field, value] of [["from", from], ["to", to], ["cells", 2]]) await set.getByRole("spinbutton", { name: field }).fill(String(value));
    };
    await axis("across", "Spin rate", 0.2, 0.4);
    await axis("up", "Mass, times", 1, 2);
    const compute = async () => {
      await page.getByRole("button", { name: "Compute the map" }).click();
      await page.locator(".wi-maps .wi-status", { hasText: /^All \d+ variants computed/ }).waitFor();
    };
    await page.locator(".wi-maps").getByLabel("Map of").selectOption({ label: "Impulse, tip-1" });
    await axis("across", "Spin rate", 0.2, 0.4);
    await axis("up", "Mass, times", 1, 2);
    await compute();
    assert.equal(await page.locator(".wi-map svg rect").count() >= 3, true);
    const [file] = await Promise.all([page.waitForEvent("download"), page.locator(".wi-map").getByRole("button", { name: "CSV" }).click()]);
    const numbers = (await downloaded(file)).toString().trim().split("\n").slice(1).map((line) => line.split(",").map(Number));
    const impulse = ({ summary }) => summary.impact.grasps[0].impulse_magnitude;
    assert.deepEqual(numbers.map((line) => line.at(-1)).filter(Number.isFinite), [results.base, results.spin, results.heavy].map(impulse));
    // By keyboard and by a click.
    await page.getByRole("combobox", { name: "Spin rate" }).selectOption({ label: "0.4 rad/s" });
    await page.getByRole("button", { name: "Show this cell as the variant" }).click();
    await shows(page, "The variant captures");
    assert.equal(await exact(page, "Spin rate").inputValue(), "0.4");
    // Probabilities, here without scatter: three cells succeed always, one never.
    await page.locator(".wi-maps").getByLabel("Map of").selectOption({ label: "Probability of success" });
    await axis("across", "Spin rate", 0.2, 0.4);
    await axis("up", "Mass, times", 1, 2);
    for (const [field, value] of [["Draws per cell", 3], ["Error of the target's position", 0], ["Error of its mass", 0]]) await page.getByLabel(field).fill(String(value));
    await page.getByRole("button", { name: "Back to the base case" }).click();
    await compute();
    const [counts] = await Promise.all([page.waitForEvent("download"), page.locator(".wi-map").getByRole("button", { name: "CSV" }).click()]);
    const rows = (await downloaded(counts)).toString().trim().split("\n").map((line) => line.split(",").slice(-6, -4));
    assert.deepEqual(rows, [["successes", "cases"], ["3", "3"], ["3", "3"], ["3", "3"], ["0", "3"]]);
    assert.deepEqual(await axeFaults(page), []);
    const map = page.locator(".wi-map svg[role=application]");
    const { width, height } = await map.boundingBox();
    await map.click({ position: { x: width * 0.3, y: height * 0.75 } }); // low spin, low mass: the base case
    await shows(page, "The variant captures");
    assert.equal(await exact(page, "Spin rate").inputValue(), "0.2");
    assert.deepEqual(faults, []);
    await context.close();
  });
});
