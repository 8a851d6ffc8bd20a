// Reports of campaigns and success maps in a browser: no errors, no requests, and contents that agree with
// campaign.json.
import assert from "node:assert/strict";
import { mkdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import path from "node:path";
import { describe } from "node:test";
import { axeFaults, downloaded, grapnel, open, scenario, scratch, scrollThrough, test } from "./browser.mjs";
import { campaignData, campaignStatistics } from "./made_campaign.mjs";

const folder = scratch();

// A page with statistics only, written by the program.
function report(name, statistics) {
  const out = path.join(folder, name);
  mkdirSync(out, { recursive: true });
  writeFileSync(path.join(out, "campaign.json"), JSON.stringify(statistics));
  grapnel(["report", out]);
  return path.join(out, "report.html");
}

// The same page with other data.
function page(name, data) {
  const text = readFileSync(report(`${name}-shell`, campaignStatistics()), "utf8");
  const begin = text.indexOf(">", text.indexOf('id="grapnel-data"')) + 1;
  const all = { schema: "grapnel-report/1", version: "0.7.0", kind: "campaign", title: data.statistics?.campaign?.name ?? "", runs: [], campaign: data };
  const file = path.join(folder, `${name}.html`);
  writeFileSync(file, text.slice(0, begin) + JSON.stringify(all).replace(/</g, "\\u003c") + text.slice(text.indexOf("</script>", begin)));
  return file;
}

async function shown(file, options) {
  const opened = await open(file, options);
  await scrollThrough(opened.page);
  await opened.page.evaluate(() => window.dispatchEvent(new Event("beforeprint"))); // builds all deferred parts
  return opened;
}

const charts = (page) => page.evaluate(() => window.__grapnel.study.charts());

describe("campaigns open without errors and requests", () => {
  for (const [name, options] of Object.entries({ "on a desk": {}, "on a phone": { viewport: { width: 380, height: 800 } }, "in the dark": { colorScheme: "dark" } })) {
    test(name, async () => {
      const { page: p, context, faults } = await shown(page("plain", campaignData()), options);
      assert.deepEqual(faults, []);
      assert.equal(await p.getByText("cannot be shown").count(), 0);
      for (const id of ["probability", "distribution", "influence", "inputs", "worst", "failures", "spread", "parallel", "table", "point"]) assert.ok((await charts(p)).includes(id), id);
      assert.ok(await p.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), "wider than the screen");
      if (name !== "on a phone") assert.deepEqual(await axeFaults(p), []);
      await context.close();
    });
  }

  test("without a table the page shows the statistics and a note", async () => {
    const { page: p, context, faults } = await shown(report("bare", campaignStatistics()));
    assert.deepEqual(faults, []);
    assert.ok((await p.locator("body").innerText()).includes("table.h5"));
    const there = await charts(p);
    assert.ok(there.includes("probability") && there.includes("worst") && !there.includes("spread"));
    await context.close();
  });
});

describe("the page matches campaign.json", () => {
  test("the probability and its interval, as text and as a bar", async () => {
    const statistics = campaignStatistics();
    const { page: p, context } = await shown(page("numbers", campaignData()));
    const verdict = await p.locator("#study-verdict").innerText();
    for (const key of ["estimate", "lower", "upper"]) assert.ok(verdict.includes(statistics.success[key].toFixed(4)), `${key} in ${verdict}`);
    assert.ok(verdict.includes(`${statistics.counts.success} of 200`));
    const label = await p.locator("#study-probability svg").getAttribute("aria-label");
    for (const c of statistics.criteria) assert.ok(label.includes(`${c.name}: ${c.estimate.toFixed(4)}`), label);
    await context.close();
  });

  test("bars of the histogram count all cases", async () => {
    const { page: p, context } = await shown(page("bars", campaignData()));
    const text = await csv(p, "#study-distribution");
    const counts = text.trim().split("\n").slice(1).map((line) => Number(line.split(",")[2]));
    assert.equal(counts.reduce((a, b) => a + b, 0), 196);
    await context.close();
  });

  test("the distribution function, other columns and outputs", async () => {
    const { page: p, context, faults } = await shown(page("choices", campaignData()));
    for (const id of ["distribution", "influence", "spread"]) {
      for (const box of await p.locator(`#study-${id} select`).all()) {
        for (const value of await box.locator("option").evaluateAll((all) => all.map((o) => o.value))) await box.selectOption(value);
      }
    }
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("a worst case is shown with its numbers and the command that replays it", async () => {
    const { page: p, context } = await shown(page("worst", campaignData()));
    await p.locator("#study-worst button", { hasText: /^5$/ }).click();
    const card = await p.locator("#study-point").innerText();
    assert.ok(card.includes("Case 5"), card);
    assert.ok(card.includes("--only 5"), card);
    await context.close();
  });

  test("no download is empty", async () => {
    const { page: p, context, faults } = await shown(page("downloads", campaignData()));
    for (const id of ["probability", "distribution", "influence", "inputs", "spread"]) {
      for (const kind of ["SVG", "PNG", "CSV"]) {
        const [got] = await Promise.all([p.waitForEvent("download"), p.locator(`#study-${id}`).getByRole("button", { name: kind, exact: true }).click()]);
        assert.ok((await downloaded(got)).length > 60, `${kind} of ${id}`);
      }
    }
    assert.deepEqual(faults, []);
    await context.close();
  });
});

async function csv(p, card) {
  const [got] = await Promise.all([p.waitForEvent("download"), p.locator(card).getByRole("button", { name: "CSV", exact: true }).click()]);
  return (await downloaded(got)).toString("utf8");
}

describe("success maps", () => {
  test("a map with its lines, walked by the keyboard", async () => {
    const { page: p, context, faults } = await shown(page("map", campaignData("map")));
    const map = p.locator("#study-success-map .cp-success-map > svg");
    assert.equal(await map.locator("rect[shape-rendering]").count(), 12);
    for (const level of [0.5, 0.9]) assert.ok((await map.locator(`path[data-level="${level}"]`).count()) > 0, `line at ${level}`);
    await map.focus();
    await p.keyboard.press("ArrowRight");
    await p.keyboard.press("ArrowUp");
    const status = await p.locator("#study-success-map [role=status]").innerText();
    assert.match(status, /success 0\.9500 · 95\u202f% ?: 0\.8882 to 0\.9785 · 95 of 100 cases · most frequent failure: soft \(5 cases\) · targets\.target-1\.mass: 10 kg · relative_speed: 0\.1 m\/s/);
    const lines = (await csv(p, "#study-success-map")).trim().split("\n");
    assert.equal(lines.length, 13);
    assert.ok(lines[6].startsWith("0.1,10,95,100,0.95,0.888"), lines[6]);
    assert.deepEqual(await axeFaults(p), []);
    assert.deepEqual(faults, []);
    await context.close();
  });
});

describe("a success map over one axis", () => {
  function one() {
    const data = campaignData("map");
    const { success_map: map } = data.statistics;
    const [trials, successes] = [[100, 100, 0], [99, 40, 0]];
    data.statistics.success_map = { axes: [map.axes[0]], trials, ok: trials, successes, unmet: [{ criterion: "soft", counts: [1, 60, 0] }], deciding: ["soft", "soft", null] };
    data.sample.design = data.sample.design.slice(0, 1);
    return data;
  }

  test("is a curve with its intervals, walked by the keyboard", async () => {
    const { page: p, context, faults } = await shown(page("map-curve", one()));
    const plot = p.locator("#study-success-map .st-chart svg").first();
    assert.equal(await plot.locator("circle").count(), 2, "a point without cases is none");
    await plot.focus();
    await p.keyboard.press("ArrowRight");
    const status = await p.locator("#study-success-map [role=status]").innerText();
    assert.match(status, /success 0\.4000 · 95\u202f% ?: 0\.3094 to 0\.4980 · 40 of 100 cases · most frequent failure: soft \(60 cases\) · relative_speed: 0\.1 m\/s/);
    await p.keyboard.press("Enter");
    assert.equal(await p.evaluate(() => window.__grapnel.study.passing), 68, "cases 4 to 7, 16 to 19 and so on");
    await p.locator("#study-success-map").getByLabel("what fails").check();
    assert.ok((await p.locator("#study-success-map .st-legend").innerText()).includes("share of cases that fail “soft”"));
    const lines = (await csv(p, "#study-success-map")).trim().split("\n");
    assert.equal(lines.length, 4);
    assert.ok(lines[2].startsWith("0.1,40,100,0.4,0.309"), lines[2]);
    assert.deepEqual(await axeFaults(p), []);
    assert.deepEqual(faults, []);
    await context.close();
  });
});

describe("success maps lead to their cases", () => {
  test("the map shows what the headline counts, a cell keeps its cases, saved ones are linked", async () => {
    const { page: p, context, faults } = await shown(page("map-cells", campaignData("map")));
    assert.match(await p.locator("#study-verdict").innerText(), /^4 of 12 points succeed with probability 0\.9 or more/);
    assert.match(await p.locator("#study-success-map .st-card-title").innerText(), /lower end of its interval/);
    assert.deepEqual(await p.locator("#study-success-map .cp-success-map svg .cp-cell").evaluateAll((all) => all.filter((t) => !t.textContent.startsWith("<") && Number(t.textContent.replace(">", "0")) >= 0.9).length) <= 4, true);
    const map = p.locator("#study-success-map .cp-success-map > svg");
    await map.focus();
    await p.keyboard.press("ArrowRight");
    await p.keyboard.press("Enter");
    assert.equal(await p.evaluate(() => window.__grapnel.study.passing), 17, "cases 1, 13, 25 and so on");
    assert.match(await p.locator("#study-point").innerText(), /^Case 1\b/);
    await map.focus();
    await p.keyboard.press("Enter");
    assert.equal(await p.evaluate(() => window.__grapnel.study.passing), 200);
    const links = await p.locator("a.cp-saved").evaluateAll((all) => [...new Set(all.map((a) => a.getAttribute("href")))].sort());
    assert.deepEqual(links, ["series/case-13/report.html", "series/case-2/report.html"]);
    await p.locator("#study-success-map select").selectOption("deciding");
    const legend = await p.locator("#study-success-map .st-legend").innerText();
    for (const name of ["captured", "soft", "nothing fails"]) assert.ok(legend.includes(name), legend);
    assert.ok((await p.locator("#study-influence").evaluate((e) => e.textContent)).includes("Unexplained by them one by one: 12 %"));
    assert.match((await p.locator("#study-spread .st-card-title").innerText()).replace(/\u200b/g, ""), /against relative speed/, "what matters most is the design's");
    assert.deepEqual(faults, []);
    await context.close();
  });
});

describe("elements do not overlap", () => {
  // Names of realistic length.
  function long() {
    const names = { mass: "targets.target-1.state.angular_velocity/length", rate: "targets.target-2.state.angular_velocity/length" };
    return JSON.parse(JSON.stringify(campaignData()).replace(/"(mass|rate)"/g, (_, name) => JSON.stringify(names[name])));
  }

  for (const [width, beside] of [[1400, true], [1280, true], [1024, true], [700, true], [420, false]]) {
    test(`what matters: rank correlations ${beside ? "beside" : "below"} the indices at ${width} px, both named`, async () => {
      const { page: p, context, faults } = await shown(page(`influence-${width}`, long()), { viewport: { width, height: 900 } });
      const panels = await p.locator("#study-influence .st-panel").evaluateAll((all) =>
        all.map((one) => {
          const box = one.getBoundingClientRect();
          const svg = one.querySelector("svg");
          const texts = [...svg.querySelectorAll("text")].map((t) => ({ text: t.textContent, y: t.getBoundingClientRect().top - svg.getBoundingClientRect().top }));
          return { left: box.left, right: box.right, top: box.top, bottom: box.bottom, texts };
        }),
      );
      assert.equal(panels.length, 2);
      const [first, second] = panels;
      if (beside) assert.ok(second.left >= first.right && Math.abs(second.top - first.top) < 1, JSON.stringify(panels));
      else assert.ok(second.top >= first.bottom, JSON.stringify(panels));
      const named = panels.map((one) => one.texts.filter((t) => /target-[12]/.test(t.text)).sort((a, b) => a.y - b.y));
      assert.deepEqual(named.map((rows) => rows.map((t) => t.text.match(/target-\d/)[0])), [["target-1", "target-2"], ["target-1", "target-2"]]);
      for (const k of [0, 1]) assert.ok(Math.abs(named[0][k].y - named[1][k].y) < 2, "the same rows at the same heights");
      for (const [k, title] of ["first-order Sobol index", "Spearman's rank correlation"].entries()) assert.ok(panels[k].texts.some((t) => t.text === title), title);
      assert.deepEqual(faults, []);
      await context.close();
    });
  }

  for (const width of [1400, 420]) {
    test(`numbers and names of lines in a steep success map at ${width} px`, async () => {
      const { page: p, context, faults } = await shown(page(`steep-${width}`, steep()), { viewport: { width, height: 900 } });
      const texts = await p.locator("#study-success-map .cp-success-map > svg").locator(".cp-level, .cp-cell").evaluateAll((all) =>
        all.map((t) => {
          const { left, right, top, bottom } = t.getBoundingClientRect();
          return { text: t.textContent, level: t.classList.contains("cp-level"), left, right, top, bottom };
        }),
      );
      const levels = texts.filter((t) => t.level).map((t) => t.text);
      assert.deepEqual([...new Set(levels)].sort(), ["0.5", "0.9", "0.99"]);
      if (width > 1000) assert.ok(texts.length > 60, `${texts.length} texts`);
      // One pixel of each text's box is margin.
      const overlap = (a, b) => a.left + 1 < b.right && b.left + 1 < a.right && a.top + 1 < b.bottom && b.top + 1 < a.bottom;
      texts.forEach((a, k) => texts.slice(k + 1).forEach((b) => assert.ok(!overlap(a, b), `${a.text} on ${b.text}`)));
      const ramp = p.locator("#study-success-map .st-ramp svg");
      assert.equal(await ramp.count(), 1);
      assert.match(await ramp.first().evaluate((svg) => svg.textContent), /0\.0.*probability of success|probability of success.*1\.0/);
      assert.deepEqual(faults, []);
      await context.close();
    });
  }

  // Probabilities that fall from 1 to 0 within three cells, with many cases, so that the initially displayed lower
  // bounds do so too.
  function steep() {
    const data = campaignData("map");
    const size = 13;
    const successes = Array.from({ length: size * size }, (_, k) => Math.round(10000 / (1 + Math.exp(3.2 * (Math.floor(k / size) - 8 + 0.2 * (k % size))))));
    const axis = (name, unit) => ({ name, unit, description: "", is_numeric: true, values: Array.from({ length: size }, (_, k) => k / 100) });
    data.statistics.success_map = { axes: [axis("relative_speed", "m/s"), axis("target_spin", "rad/s")], trials: successes.map(() => 10000), ok: successes.map(() => 10000), successes };
    return data;
  }

  test("a dark page is printed in light colours and becomes dark again", async () => {
    const { page: p, context, faults } = await open(page("paper", campaignData()), { colorScheme: "dark" });
    await scrollThrough(p);
    const bar = p.locator("#study-distribution svg rect").first();
    const seen = async () => {
      await bar.waitFor({ state: "attached" });  // charts are drawn when they come into view
      return p.evaluate(() => [getComputedStyle(document.documentElement).getPropertyValue("--scheme").trim(), getComputedStyle(document.querySelector("#study-distribution svg rect")).fill, document.documentElement.dataset.theme ?? "auto"]);
    };
    const print = (event) => p.evaluate((name) => window.dispatchEvent(new Event(name)), event);
    const dark = await seen();
    assert.deepEqual(dark, ["dark", "rgb(90, 143, 245)", "auto"]);
    await print("beforeprint");
    assert.deepEqual((await seen()).slice(0, 2), ["light", "rgb(0, 114, 178)"]);
    await print("afterprint");
    assert.deepEqual(await seen(), dark);
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("units are readable on the page, in files those of table.csv", async () => {
    const data = campaignData();
    for (const one of [data.statistics.inputs[0], data.sample.inputs[0]]) one.unit = "kg m^2";
    const { page: p, context, faults } = await shown(page("units", data));
    await p.locator("#study-distribution select").first().selectOption("input:mass");
    const all = await p.evaluate(() => [...document.querySelectorAll("body *")].filter((e) => !e.closest("script")).flatMap((e) => [e.getAttribute("aria-label"), ...[...e.childNodes].filter((n) => n.nodeType === 3).map((n) => n.textContent)]).join("\n"));
    assert.ok(!all.includes("m^2"), all.match(/.*m\^2.*/)?.[0]);
    for (const card of ["inputs", "worst", "point", "distribution", "parallel", "table"]) assert.match(await p.locator(`#study-${card}`).evaluate((e) => e.textContent), /kg\u00a0m²/, card);
    for (const card of ["inputs", "worst", "spread", "table"]) assert.match(await csv(p, `#study-${card}`), /kg m\^2|^from/, card);
    assert.deepEqual(faults, []);
    await context.close();
  });
});

describe("hostile and unusual campaigns", () => {
  test("names are texts", async () => {
    const hostile = `<img src=x onerror="window.hacked=1"></script><script>window.hacked=1</script>'"&\\u2028{{}}`;
    const data = JSON.parse(JSON.stringify(campaignData("campaign", hostile)).replaceAll('"mass"', JSON.stringify(hostile)).replaceAll('"impulse"', JSON.stringify(`i${hostile}`)).replaceAll('"no convergence"', JSON.stringify(hostile)));
    const { page: p, context, faults } = await shown(page("hostile", data));
    assert.equal(await p.evaluate(() => window.hacked), undefined);
    assert.ok((await p.locator("body").innerText()).includes("<img src=x"));
    assert.deepEqual(faults, []);
    await context.close();
  });

  const odd = {
    "no cases": (d) => Object.assign(d.statistics, { rows: 0, counts: { ok: 0, failed: 0, unreachable: 0, success: 0 }, success: { estimate: null, lower: 0, upper: 1, confidence: 0.95 } }),
    "nothing but a schema": (d) => (d.statistics = { schema: "grapnel-campaign-report/1" }),
    "all the same": (d) => d.statistics.columns.forEach((c) => Object.assign(c, { least: 1, largest: 1, histogram: { begin: 1, end: 1, counts: [196], successes: [196], below: 0, above: 0 }, quantiles: [{ probability: 0.5, value: 1 }] })),
    "no criteria, no inputs": (d) => Object.assign(d.statistics, { criteria: [], inputs: [], sensitivity: { inputs: [], measures: [] } }),
    "numbers that do not exist": (d) => d.statistics.columns.forEach((c) => Object.assign(c, { mean: null, histogram: null, quantiles: null, count: 0 })),
    "an unfinished campaign": (d) => (d.statistics.campaign.total = 1000),
    "a certain success": (d) => Object.assign(d.statistics, { success: { estimate: 1, lower: 0.98, upper: 1, confidence: 0.95 } }),
  };
  for (const [name, change] of Object.entries(odd)) {
    test(name, async () => {
      const data = campaignData();
      change(data);
      const { page: p, context, faults } = await shown(page(name.replace(/\W+/g, "-"), data));
      assert.deepEqual(faults, []);
      assert.equal(await p.locator(".fault").count(), 0);
      assert.equal(await p.getByText("cannot be shown").count(), 0);
      await context.close();
    });
  }
});

describe("a complete campaign", () => {
  test("its report shows its numbers", async () => {
    const study = path.join(folder, "study.yaml");
    writeFileSync(
      study,
      `schema: grapnel-campaign/1\nname: mass\nscenario: ${scenario("thesis/open-loop-case-1-planned.yaml")}\nsimulate: impact\nset: {approach.plan.starts: 1}\n` +
        "cases: 300\nseed: 3\nuncertain:\n  - {path: targets.target-1.mass, as: factor, uniform: {from: 0.5, to: 1.5}}\n" +
        "success:\n  - captured\n  - {name: soft, holds: grasps/*/impulse_magnitude < 0.18}\nkeep: {columns: [captured, grasps]}\n",
    );
    const out = path.join(folder, "campaign");
    grapnel(["campaign", study, "-o", out, "--quiet"], [0, 3]);
    const statistics = JSON.parse(readFileSync(path.join(out, "campaign.json"), "utf8"));
    const file = path.join(out, "report.html");
    assert.ok(statSync(file).size < 3.5e6, `${statSync(file).size} bytes`);
    const { page: p, context, faults } = await shown(file);
    assert.deepEqual(faults, []);
    assert.equal(await p.evaluate(() => window.__grapnel.study.points), 300);
    const model = await p.evaluate(() => window.__grapnel.campaign.model);
    assert.equal(model.success.estimate, statistics.success.estimate);
    for (const d of [...model.columns, ...model.inputs]) {
      if (d.histogram) assert.equal(d.histogram.counts.reduce((a, b) => a + b, 0) + d.histogram.below + d.histogram.above, d.count, d.name);
    }
    assert.ok((await p.locator("#study-verdict").innerText()).includes(`${statistics.counts.success} of 300`));
    await context.close();
  });
});
