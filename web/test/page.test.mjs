// The page of a run: text size on high-resolution screens, keyboard and screen readers, forced colours, order of
// contents, replay beside plots, states of an impact, texts of scenarios, video, and restrictions of its policy.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import path from "node:path";
import { before, describe } from "node:test";
import { axeContrastFaults, axeFaults, downloaded, grapnel, kUndrawn, open, scenario, scratch, scrollThrough, source, test } from "./browser.mjs";

const folder = scratch();
let handles, planned, comparison;
before(async () => {
  const run = (name, file) => {
    const out = path.join(folder, name);
    grapnel(["run", scenario(file), "-o", out, "--quiet"]);
    return out;
  };
  handles = path.join(run("handles", "dual-arm-satellite-handles.yaml"), "report.html");
  planned = run("planned", "thesis/closed-loop.yaml");
  const published = run("published", "thesis/closed-loop-published-angles.yaml");
  comparison = path.join(folder, "comparison.html");
  grapnel(["report", planned, published, "-o", comparison]);
});

// The report with other data and its original script.
function changed(file, name, change) {
  const text = readFileSync(file, "utf8");
  const tag = '<script type="application/json" id="grapnel-data">';
  const first = text.indexOf(tag) + tag.length;
  const last = text.indexOf("</script>", first);
  const data = JSON.parse(text.slice(first, last));
  change(data);
  const made = path.join(folder, name);
  writeFileSync(made, text.slice(0, first) + JSON.stringify(data).replaceAll("<", "\\u003c") + text.slice(last));
  return made;
}

const seen = (page, selector) => page.locator(selector).evaluateAll((all) => all.filter((one) => one.checkVisibility({ visibilityProperty: true })).map((one) => one.textContent));

describe("letters", () => {
  for (const ratio of [1, 1.5, 2, 3]) {
    test(`of axes have 12 px on a screen with ${ratio} pixels per px`, async () => {
      const { page, context } = await open(handles, { ...kUndrawn, deviceScaleFactor: ratio, viewport: { width: 800, height: 600 } });
      const sizes = await page.evaluate(async () => {
        const met = new Set();
        const fill = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (...args) {
          if (this.canvas.closest(".uplot")) met.add(Number(/([\d.]+)px/.exec(this.font)[1]) / devicePixelRatio);
          return fill.apply(this, args);
        };
        document.querySelector(".plot").scrollIntoView();
        window.dispatchEvent(new Event("grapnel-theme")); // redraws
        await new Promise((done) => setTimeout(done, 600));
        return [...met];
      });
      assert.ok(sizes.length > 0);
      for (const size of sizes) assert.ok(size >= 10.9, `${size} px`); // 5.5 at a ratio of 2 in earlier versions
      await context.close();
    });
  }
});

describe("accessibility", () => {
  test("axe finds no violation: one run, light and dark", async () => {
    const { page, context } = await open(handles, { colorScheme: "light" });
    assert.deepEqual(await axeFaults(page), []);
    const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    const light = await ground();
    await page.emulateMedia({ colorScheme: "dark" });
    await page.waitForFunction((was) => getComputedStyle(document.body).backgroundColor !== was, light);
    assert.deepEqual(await axeContrastFaults(page), []); // only the colours differ
    await context.close();
  });

  test("axe finds no violation: two runs", async () => {
    const { page, context } = await open(comparison, { colorScheme: "light" });
    assert.deepEqual(await axeFaults(page), []);
    await context.close();
  });

  test("few Tab stops, and the first skips the header", async () => {
    const { page, context } = await open(handles);
    await page.waitForTimeout(500);
    const stops = await page.evaluate(
      () => [...document.querySelectorAll("a[href], button, input, select, summary, [tabindex]")].filter((one) => one.tabIndex >= 0 && !one.disabled && one.checkVisibility({ visibilityProperty: true })).length,
    );
    assert.ok(stops < 90, `${stops} stops`); // measured 55
    await page.keyboard.press("Tab");
    assert.equal(await page.evaluate(() => document.activeElement.textContent), "Skip to the results");
    await page.keyboard.press("Enter");
    assert.equal(await page.evaluate(() => document.activeElement.id), "verdict");
    await context.close();
  });

  test("arrow keys move within a group of buttons", async () => {
    const { page, context } = await open(handles);
    await page.locator(".replay-chips button").first().focus();
    const named = () => page.evaluate(() => document.activeElement.textContent);
    assert.equal(await named(), "Trails");
    await page.keyboard.press("ArrowRight");
    assert.equal(await named(), "Grasps");
    await page.keyboard.press("End");
    assert.equal(await named(), "Names");
    await page.keyboard.press("ArrowRight");
    assert.equal(await named(), "Trails");
    assert.equal(await page.evaluate(() => window.__grapnel.clock.time), 0); // the replay has not stepped
    await context.close();
  });

  test("keys rotate the replay", async () => {
    const { page, context } = await open(handles);
    const at = () => page.evaluate(() => window.__grapnel.replay.cameraDirection());
    const before = await at();
    await page.locator(".replay-canvas").focus();
    await page.keyboard.press("d");
    await page.keyboard.press("w");
    const now = await at();
    assert.ok(now[2] > before[2] + 0.03, `${before} to ${now}`);
    const turned = Math.atan2(now[1], now[0]) - Math.atan2(before[1], before[0]);
    assert.ok(Math.abs(turned - Math.PI / 36) < 1e-6, `${turned}`);
    await context.close();
  });

  test("colours of the system setting are kept", async () => {
    const { page, context, faults } = await open(handles, { forcedColors: "active" });
    await scrollThrough(page);
    const [ink, page_, pressed] = await page.evaluate(() => {
      const style = getComputedStyle(document.body);
      return [style.color, style.backgroundColor, getComputedStyle(document.querySelector('.replay-chip[aria-pressed="true"]')).backgroundColor];
    });
    assert.notEqual(pressed, page_); // pressed buttons are visibly pressed
    // Plots use the system's text colour, not the page's.
    assert.match(await page.evaluate(() => getComputedStyle(document.documentElement).getPropertyValue("--ink")), /CanvasText/);
    assert.notEqual(ink, page_);
    assert.deepEqual(faults, []);
    await context.close();
  });
});

describe("layout", () => {
  test("seven plots initially, the others in collapsed groups", async () => {
    const { page, context } = await open(handles, { ...kUndrawn, viewport: { width: 1600, height: 1000 } });
    await page.waitForSelector(".plot");
    const titles = await seen(page, ".plot h3");
    assert.deepEqual(titles, ["Distance to the grasp points", "Speed relative to the grasp points", "Grasp force", "Base rate", "Minimum clearance", "Energy and work", "Worst margin to a rating"]);
    await page.getByText("Open all groups").click();
    assert.ok((await seen(page, ".plot h3")).length > 20);
    await page.getByText("Fold all groups").click();
    assert.equal((await seen(page, ".plot h3")).length, 7);
    await context.close();
  });

  test("on a narrow screen a small replay stays visible", async () => {
    const { page, context } = await open(handles, { viewport: { width: 800, height: 900 } });
    await page.waitForSelector(".plot");
    await page.evaluate(() => window.scrollTo(0, document.querySelectorAll(".plot")[2].getBoundingClientRect().top + window.scrollY - 500));
    await page.waitForTimeout(300);
    const box = await page.locator(".replay-viewport").boundingBox();
    assert.ok(box.y >= 0 && box.y + box.height < 0.6 * 900, `${box.y} + ${box.height}`);
    await context.close();
  });

  test("the picture has a grid, a scale and the axes of W, and may have a sky", async () => {
    const { page, context, faults } = await open(handles);
    await page.waitForTimeout(500);
    assert.match((await seen(page, ".replay-legend")).join(), /grid \d/);
    assert.match((await seen(page, ".replay-scale")).join(), /^[\d.]+ m$/);
    assert.deepEqual(await page.locator(".replay-compass text").evaluateAll((all) => all.map((one) => one.textContent).sort()), ["x", "y", "z"]);
    await page.locator(".replay-chip", { hasText: "Sky" }).click();
    await page.waitForTimeout(800);
    assert.equal(await page.locator(".replay-viewport").getAttribute("data-theme"), "dark");
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("published values of the thesis are shown only in their section", async () => {
    const { page, context } = await open(changed(handles, "own.html", (data) => (data.runs[0].summary.impact.show_as_published = false)), kUndrawn);
    assert.equal(await page.locator("#published").count(), 0);
    assert.doesNotMatch(await page.locator("body").innerText(), /as published/i);
    await context.close();
  });
});

describe("flexible links", () => {
  test("are drawn with or without magnification", async () => {
    const out = path.join(folder, "bent");
    grapnel(["run", scenario("thesis/closed-loop-flexible.yaml"), "-o", out, "--quiet", "--set", "approach.duration=4", "--set", "post_impact.duration=0.2"], [0, 1]);
    const { page, context, faults } = await open(path.join(out, "report.html"));
    const turns = () =>
      page.evaluate(() => {
        window.__grapnel.clock.time = 2;
        const pose = (name) => window.__grapnel.replay.bodyPose(name);
        const about = (q) => 2 * Math.atan2(q[3], q[0]); // z
        const names = ["arm-1-link-1", "arm-1-link-1:1", "arm-1-link-1:2", "arm-1-link-2"].map(pose);
        return { segment: about(names[1].quaternion_wxyz) - about(names[0].quaternion_wxyz), next: Math.hypot(...names[3].position.map((x, k) => x - names[2].position[k])), base: pose("base").position };
      });
    const true_ = await turns();
    assert.ok(Math.abs(true_.segment) > 1e-5, `${true_.segment} rad`);
    const range = page.getByLabel("Bending drawn so many times");
    await range.fill("1");
    const larger = await turns();
    assert.ok(Math.abs(larger.segment / true_.segment - 10) < 1e-2, `${larger.segment} after ${true_.segment}`); // single precision
    assert.ok(Math.abs(larger.next - true_.next) < 1e-5); // segments remain connected
    assert.deepEqual(larger.base, true_.base);
    assert.ok((await seen(page, ".replay-legend li")).includes("bending drawn 10 times"));
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("only with flexible bodies, for any names of links", async () => {
    const robot = readFileSync(path.join(source, "robots", "planar-dual-arm.yaml"), "utf8");
    const named = path.join(folder, "named.yaml");
    writeFileSync(named, robot.replaceAll("arm-1-link-2", '"arm-1-link-1:1"'));
    const out = path.join(folder, "named");
    grapnel(["run", scenario("thesis/closed-loop.yaml"), "-o", out, "--quiet", "--set", `robot=${named}`, "--set", "clearance.enabled=false"], [0, 1]);
    const { page, context } = await open(path.join(out, "report.html"));
    assert.equal(await page.getByLabel("Bending drawn so many times").count(), 0);
    await context.close();
  });
});

describe("an impact", () => {
  const labels = (page) => page.locator(".replay-label:not([hidden])").evaluateAll((all) => all.map((one) => one.textContent));

  test("has its arrows from contact on, and two states at one instant", async () => {
    const { page, context } = await open(handles);
    const go = async (time, back) => {
      const drawn = await page.evaluate(([t, k]) => (window.__grapnel.clock.show(t, k), window.__grapnel.replay.renderCount()), [time, back]);
      await page.waitForFunction((n) => window.__grapnel.replay.renderCount() > n, drawn);
    };
    await go(44.9, 0);
    assert.deepEqual(await labels(page), []);
    await go(45, 0);
    assert.equal((await labels(page)).filter((text) => / N s$/.test(text)).length, 2);
    assert.match(await page.locator(".replay-phase").textContent(), /just after/);
    await page.locator(".replay-canvas").focus();
    const drawn = await page.evaluate(() => window.__grapnel.replay.renderCount());
    await page.keyboard.press("ArrowLeft"); // "previous sample"
    await page.waitForFunction((n) => window.__grapnel.replay.renderCount() > n, drawn);
    assert.equal(await page.evaluate(() => window.__grapnel.clock.time), 45);
    assert.match(await page.locator(".replay-phase").textContent(), /just before/);
    assert.deepEqual(await labels(page), []);
    await context.close();
  });
});

describe("the scenario", () => {
  const texts = (text, settings = []) => ({ description: "Two hands & <b>one</b> satellite", settings, files: [{ part: "scenario", bytes: text.length, text }] });

  test("is shown on the page as text", async () => {
    const file = changed(handles, "texts.html", (data) => (data.runs[0].source = texts("name: x\n# <script>\n", ["approach.duration=10"])));
    const { page, context } = await open(file, kUndrawn);
    assert.match(await page.locator(".page-head").innerText(), /Two hands & <b>one<\/b> satellite/);
    await page.locator("#scenario summary").click();
    assert.match(await page.locator("#scenario pre").innerText(), /# <script>/);
    assert.match(await page.locator("#scenario").innerText(), /approach\.duration=10/);
    await context.close();
  });

  test("is compared by lines, or reported as missing", async () => {
    const file = changed(comparison, "differ.html", (data) => {
      data.runs[0].source = texts("a: 1\nb: 2\nc: 3\n");
      data.runs[1].source = texts("a: 1\nb: 5\nc: 3\n");
    });
    const one = await open(file, kUndrawn);
    assert.deepEqual(await one.page.locator(".diff-a code, .diff-b code").allTextContents(), ["b: 2", "b: 5"]);
    await one.context.close();
    const two = await open(changed(comparison, "missing.html", (data) => data.runs.forEach((run) => delete run.source)), kUndrawn);
    assert.match(await two.page.locator("#verdict").innerText(), /does not contain its scenario's text/);
    assert.deepEqual(two.faults, []);
    await two.context.close();
  });
});

describe("files", () => {
  test("a video of the replay", async () => {
    const { page, context, faults } = await open(handles);
    await page.evaluate(() => {
      window.__grapnel.clock.speed = 10;
      window.__grapnel.clock.slowAround = [];
      window.__grapnel.clock.time = window.__grapnel.clock.end - 12;
    });
    const saved = page.waitForEvent("download");
    await page.getByText("Record video").click();
    const video = await downloaded(await saved);
    assert.deepEqual([...video.subarray(0, 4)], [0x1a, 0x45, 0xdf, 0xa3]); // EBML: WebM
    assert.match(await page.locator(".replay-said").textContent(), /Video saved/);
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("the policy allows only the viewer's script", async () => {
    const text = readFileSync(handles, "utf8");
    assert.doesNotMatch(/script-src ([^;]*)/.exec(text)[1], /unsafe/);
    const file = path.join(folder, "planted.html");
    writeFileSync(file, text.replace("</head>", "<script>window.planted = 1</script></head>").replace("<main", "<img src=x onerror='window.planted = 2'><main"));
    const { page, context } = await open(file, kUndrawn);
    await page.waitForTimeout(200);
    assert.equal(await page.evaluate(() => window.planted), undefined);
    assert.equal(await page.locator(".fault").count(), 0);
    await context.close();
  });
});

describe("capture window", () => {
  test("a chart shows all evaluated times and the selected one", async () => {
    const out = path.join(folder, "window");
    grapnel(["run", scenario("tumbling-window.yaml"), "-o", out, "--quiet", "--set", "post_impact.duration=1"]);
    const { window } = JSON.parse(readFileSync(path.join(out, "summary.json"), "utf8")).approach.plan;
    const reached = window.points.filter((point) => point.reachable).length;
    assert.ok(reached > 0 && reached < window.points.length);
    const { page, faults } = await open(path.join(out, "report.html"), kUndrawn);
    // Share of the reach, direction, speed and, where there is a plan, objective.
    assert.equal(await page.locator(".window-chart .reached").count(), 4 * reached);
    assert.equal(await page.locator(".window-chart .missed").count(), 3 * (window.points.length - reached));
    assert.equal(await page.locator(".window-chart .chosen").count(), 1);
    assert.equal(await page.locator(".window-chart .limit").count(), 2);
    assert.match(await page.locator("main").innerText(), new RegExp(`selected from ${window.points.length} times between 30 and 150.s; ${reached} reachable`));
    assert.deepEqual(faults, []);
    await page.context().close();
  });
});

describe("comparison with a log", () => {
  test("shows verdicts, reasons and plots of each quantity", async () => {
    grapnel(["export", planned, "--csv"]);
    const map = path.join(folder, "map.yaml");
    const columns = ["x", "y", "z"].map((c) => `base/angular_velocity/${c}`);
    writeFileSync(
      map,
      `schema: grapnel-mapping/1
quantities:
  - {name: gyro, run: base/angular_velocity, log: [${columns}], uncertainty: 0.001}
  - {name: exchanged, run: base/angular_velocity, log: [${columns[2]}, ${columns[1]}, ${columns[0]}], uncertainty: 0.0001}
  - {name: unknown, run: base/angular_velocity/z, log: ${columns[2]}}
`,
    );
    const out = path.join(folder, "compare-log");
    grapnel(["compare", planned, path.join(planned, "timeseries.csv"), "--map", map, "-o", out, "--quiet"], [1]);
    const { page, context, faults } = await open(path.join(out, "comparison.html"));
    const results = await page.locator("#verdict table tbody tr").evaluateAll((rows) => rows.map((row) => row.cells[1].textContent.trim()));
    assert.deepEqual(results.map((one) => one.replace(/^[^a-z]+/, "")), ["agrees", "disagrees", "not checked"]);
    assert.match(await page.locator("#quantity-1").innerText(), /chi-square .* is above the bound/);
    assert.equal(await page.locator("figure.log-plot img").count(), 2 * 3 + 2 * 3 + 2);
    assert.deepEqual(await axeFaults(page), []);
    assert.deepEqual(faults, []);
    await context.close();
  });
});
