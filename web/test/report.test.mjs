// Reports in a browser: every kind opens without errors and requests, the replay moves, plots and replay share one
// instant, and the drawing agrees with summary.json.
import assert from "node:assert/strict";
import { cpSync, mkdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import path from "node:path";
import { describe } from "node:test";
import { axeFaults, grapnel, kUndrawn, launch, open, scenario, scratch, scrollThrough, source, test } from "./browser.mjs";

const folder = scratch();

const made = new Map();
// Result folders, each created once: name -> folder.
function result(name, args, codes) {
  if (!made.has(name)) {
    const out = path.join(folder, name);
    grapnel([...args, "-o", out, "--quiet"], codes);
    made.set(name, out);
  }
  return made.get(name);
}
const openLoop = () => result("open-loop", ["run", scenario("thesis/open-loop-case-1.yaml")]);
// The first open-loop case without impact and post-impact motion.
function approachAlone() {
  const file = path.join(folder, "approach.yaml");
  const text = readFileSync(scenario("thesis/open-loop-case-1.yaml"), "utf8")
    .replace(/\.\.\/\.\.\/robots/g, path.join(source, "robots"))
    .replace(/^(impact|post_impact):.*\n(?:[ #].*\n)*/gm, "");
  writeFileSync(file, text);
  return file;
}
const kinds = {
  "open loop": openLoop,
  "closed loop": () => result("closed-loop", ["run", scenario("thesis/closed-loop.yaml")]),
  "a loop in space": () => result("handles", ["run", scenario("dual-arm-satellite-handles.yaml")]),
  "two targets in space": () => result("targets", ["run", scenario("dual-arm-tumbling-targets.yaml")]),
  "a compliant impact": () => result("compliant", ["run", scenario("compliant-grip.yaml")]),
  "a rebound": () => result("rebound", ["run", scenario("contact-rebound.yaml")]),
  "reaction wheels": () => result("wheels", ["run", scenario("wheels-keep-attitude.yaml")]),
  "an approach alone": () => result("approach", ["run", approachAlone()]),
  "a run that failed": () =>
    result("failed", ["run", scenario("thesis/open-loop-case-1-planned.yaml"), "--set", "targets[0].state.position=[9, 0, 0]"], [1]),
};
const sweepStudy = () => {
  const file = path.join(folder, "sweep.yaml");
  writeFileSync(
    file,
    `name: angles\nscenario: ${scenario("thesis/open-loop-case-1-planned.yaml")}\nsimulate: impact\nset: {approach.plan.starts: 1}\naxes:\n` +
      "  - {quantity: approach_angle, unit: deg, values: [-20, 0, 20, 170]}\n  - {quantity: relative_speed, values: [0, 0.05, 0.1]}\n",
  );
  return file;
};
const sweep = () => result("sweep", ["sweep", sweepStudy()], [0, 3]);
const optimization = () => {
  const file = path.join(folder, "optimize.yaml");
  writeFileSync(
    file,
    `name: angle\nscenario: ${scenario("thesis/open-loop-case-1-planned.yaml")}\nsimulate: impact\nset: {approach.plan.starts: 1, 'grasps.tip-1.relative_velocity': [0, -0.1, 0]}\n` +
      "minimize: grasps/tip-1/impulse_magnitude\nvariables: [{quantity: approach_angle, grasp: tip-1, from: -10, to: 30, unit: deg}]\nsearch: {evaluations: 20}\n",
  );
  return result("optimization", ["optimize", file]);
};
const comparison = () => {
  const file = path.join(folder, "comparison.html");
  grapnel(["report", openLoop(), kinds["closed loop"](), "-o", file]);
  return file;
};
const reportOf = (out) => path.join(out, "report.html");

// Compares the end of the replay with summary.json.
async function lastPoseIsThatOfTheSummary(page, out) {
  const summary = JSON.parse(readFileSync(path.join(out, "summary.json"), "utf8"));
  await page.evaluate(() => (window.__grapnel.clock.time = window.__grapnel.clock.end));
  const end = (summary.post_impact ?? summary.approach).end;
  const bodies = [end.base, ...end.targets];
  assert.ok(bodies.length >= 2);
  const worst = { position: 0, quaternion: 0, moved: 0 };
  for (const body of bodies) {
    const shown = await page.evaluate((name) => window.__grapnel.replay.bodyPose(name), body.name);
    const q = body.quaternion_wxyz;
    const sign = Math.sign(q.reduce((sum, value, i) => sum + value * shown.quaternion_wxyz[i], 0));
    worst.position = Math.max(worst.position, ...body.position.map((value, i) => Math.abs(value - shown.position[i])));
    worst.quaternion = Math.max(worst.quaternion, ...q.map((value, i) => Math.abs(value - sign * shown.quaternion_wxyz[i])));
    const start = summary.approach.start;
    const was = [start.base, ...start.targets].find((one) => one.name === body.name);
    worst.moved = Math.max(worst.moved, ...body.position.map((value, i) => Math.abs(value - was.position[i])));
  }
  assert.ok(worst.moved > 1e-3, "something must have moved");
  assert.ok(worst.position < 2e-6, `${worst.position} m`); // single precision of metres
  assert.ok(worst.quaternion < 1e-6, `${worst.quaternion}`);
}

describe("every kind of report opens without errors and requests, and runs end as computed", () => {
  const followed = ["open loop", "closed loop", "a loop in space", "two targets in space", "a compliant impact", "a rebound"];
  const files = Object.fromEntries(Object.entries(kinds).map(([name, make]) => [name, () => reportOf(make())]));
  files["a sweep"] = () => reportOf(sweep());
  files["an optimization"] = () => reportOf(optimization());
  files["a comparison"] = comparison;
  for (const [name, make] of Object.entries(files)) {
    test(name, async () => {
      const file = make();
      assert.ok(statSync(file).size < 3.5e6, `${statSync(file).size} bytes`);
      const { page, context, faults } = await open(file);
      await scrollThrough(page);
      assert.deepEqual(faults, []);
      assert.equal(await page.locator(".fault").count(), 0);
      // No section failed.
      assert.equal(await page.getByText("cannot be shown").count(), 0);
      if (followed.includes(name)) await lastPoseIsThatOfTheSummary(page, kinds[name]());
      if (["a sweep", "an optimization"].includes(name)) assert.deepEqual(await axeFaults(page), []);
      await context.close();
    });
  }
});

describe("the page matches the results", () => {
  test("the verdict has the impulses of summary.json", async () => {
    const out = openLoop();
    const { page, context } = await open(reportOf(out), kUndrawn);
    const text = await page.locator("body").innerText();
    for (const grasp of JSON.parse(readFileSync(path.join(out, "summary.json"), "utf8")).impact.grasps)
      assert.ok(text.includes(String(Number(grasp.impulse_magnitude.toPrecision(4)))), grasp.impulse_magnitude);
    await context.close();
  });
});

describe("the verdicts are those of the summary", () => {
  const verdictText = async (page) => (await page.locator("#verdict").innerText()).replace(/\s+/g, " ");
  test("of a run, with their remarks", async () => {
    for (const name of ["open loop", "a rebound", "reaction wheels", "a run that failed"]) {
      const { page, context } = await open(reportOf(kinds[name]()), kUndrawn);
      const text = await verdictText(page);
      const { verdicts } = JSON.parse(readFileSync(path.join(kinds[name](), "summary.json"), "utf8"));
      assert.equal(verdicts.length, 4);
      for (const one of verdicts)
        for (const part of [one.question, one.word, one.sentence, ...one.remarks.flatMap(({ of, text }) => [of, text])])
          assert.ok(text.includes(part.replace(/\s+/g, " ")), `${name}: ${part}`);
      await context.close();
    }
  });

  test("of two runs", async () => {
    const { page, context } = await open(comparison(), kUndrawn);
    const text = await verdictText(page);
    for (const out of [openLoop(), kinds["closed loop"]()])
      for (const { sentence } of JSON.parse(readFileSync(path.join(out, "summary.json"), "utf8")).verdicts)
        assert.ok(text.includes(sentence), sentence);
    await context.close();
  });
});

describe("control and actuators", () => {
  test("wheels against their capacity, by numbers and over time", async () => {
    const out = kinds["reaction wheels"]();
    const { page, context } = await open(reportOf(out), kUndrawn);
    const text = await page.locator("#driven").innerText();
    const { wheels } = JSON.parse(readFileSync(path.join(out, "summary.json"), "utf8"));
    assert.equal(wheels.length, 4);
    for (const wheel of wheels) {
      assert.ok(text.includes(wheel.name));
      assert.ok(text.includes(String(Number(((100 * wheel.largest_rate) / wheel.rate_limit).toPrecision(3)))), text);
      assert.ok(text.includes(String(Number(Math.abs(wheel.momentum_after).toPrecision(4)))), text);
    }
    const plots = await page.evaluate(() => window.__grapnel.plots.map((plot) => plot.id));
    for (const id of ["base-control_torque", "wheels-rate", "wheels-momentum", "wheels-capacity_used", "wheels-torque"])
      assert.ok(plots.includes(id), `${id} is not among ${plots.join(", ")}`);
    await context.close();
  });

  test("a run with only ideal joints has no such section", async () => {
    const { page, context } = await open(reportOf(openLoop()), kUndrawn);
    assert.equal(await page.locator("#driven").count(), 0);
    await context.close();
  });
});

describe("contacts between shapes", () => {
  // The open loop's result with two pairs, of which one touched.
  const touching = () => {
    const out = path.join(folder, "touching");
    cpSync(openLoop(), out, { recursive: true });
    const file = path.join(out, "summary.json");
    const none = { touches: 0, touches_at_end: false, duration: 0, impulse: 0, peak_force: 0, largest_depth: 0, slip_distance: 0, damping_loss: 0, friction_loss: 0, elastic_energy: 0, beyond_model: false };
    const contacts = [
      { ...none, bodies: ["palm", "debris"] },
      { ...none, bodies: ["finger", "debris"], touches: 3, first_time: 2.25, duration: 0.875, peak_force: 12.3, peak_time: 2.5, peak_point: [0.1, -0.2, 0.3], beyond_model: true },
    ];
    writeFileSync(file, JSON.stringify({ ...JSON.parse(readFileSync(file, "utf8")), contacts }));
    grapnel(["report", out]);
    return reportOf(out);
  };

  test("the section lists the pairs that touched, with units and a warning", async () => {
    const { page, context, faults } = await open(touching(), kUndrawn);
    const section = page.locator("#contacts");
    const text = (await section.innerText()).replace(/\s+/g, " ");
    for (const part of ["finger – debris", "12.3", "0.875", "Peak force [N]", "Largest depth [m]", "too deep for the contact model", "1 pair did not touch"])
      assert.ok(text.includes(part), `${part} is not in ${text}`);
    assert.equal(await section.locator("tbody tr").count(), 1);
    assert.match(await section.locator("details").textContent(), /palm – debris/);
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("a run without such pairs has no such section", async () => {
    const { page, context } = await open(reportOf(openLoop()), kUndrawn);
    assert.equal(await page.locator("#contacts").count(), 0);
    await context.close();
  });
});

describe("replay and plots share an instant", () => {
  test("playing moves the bodies and the clock", async () => {
    const { page, context, faults } = await open(reportOf(openLoop()));
    const before = await page.evaluate(() => [window.__grapnel.clock.time, window.__grapnel.replay.bodyPose("target-1")]);
    await page.evaluate(() => {
      window.__grapnel.clock.speed = 10;
      window.__grapnel.clock.play();
    });
    await page.waitForFunction((time) => window.__grapnel.clock.time > time + 1, before[0]);
    await page.evaluate(() => window.__grapnel.clock.pause());
    const now = await page.evaluate(() => [window.__grapnel.clock.time, window.__grapnel.replay.bodyPose("target-1")]);
    assert.ok(now[0] > before[0] + 1);
    assert.notDeepEqual(now[1], before[1]);
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("the keyboard plays, steps and jumps to the impact", async () => {
    const { page, context } = await open(reportOf(openLoop()));
    const time = () => page.evaluate(() => window.__grapnel.clock.time);
    await page.keyboard.press("End");
    assert.equal(await time(), 70);
    await page.keyboard.press("Home");
    assert.equal(await time(), 0);
    await page.keyboard.press("ArrowRight");
    const step = await time();
    assert.ok(step > 0 && step < 2, `${step}`);
    await page.keyboard.press("ArrowLeft");
    assert.equal(await time(), 0);
    await page.keyboard.press("]");
    assert.equal(await time(), 20);
    await page.keyboard.press(" ");
    assert.equal(await page.evaluate(() => window.__grapnel.clock.playing), true);
    await context.close();
  });

  test("scrubbing the slider moves bodies and the plots' cursor", async () => {
    const { page, context } = await open(reportOf(openLoop()));
    await scrollThrough(page);
    const slider = page.locator("input[type=range]").first();
    await slider.evaluate((input) => {
      input.value = String(Number(input.min) + 0.5 * (Number(input.max) - Number(input.min)));
      input.dispatchEvent(new Event("input", { bubbles: true }));
    });
    const time = await page.evaluate(() => window.__grapnel.clock.time);
    assert.ok(Math.abs(time - 35) < 0.5, `${time}`);
    // Plots are updated slightly later.
    await page.waitForFunction((now) => {
      const cursors = window.__grapnel.plots.map((plot) => plot.cursorTime()).filter((t) => t !== null);
      return cursors.length > 3 && cursors.every((cursor) => Math.abs(cursor - now) < 0.5);
    }, time);
    await context.close();
  });

  test("a click on a plot sets the instant", async () => {
    const { page, context } = await open(reportOf(openLoop()));
    await scrollThrough(page);
    const over = page.locator('[data-plot="base-angular_velocity"] .u-over'); // shows the whole run
    await over.scrollIntoViewIfNeeded();
    const box = await over.boundingBox();
    await page.mouse.click(box.x + 0.75 * box.width, box.y + 0.5 * box.height);
    const time = await page.evaluate(() => window.__grapnel.clock.time);
    assert.ok(Math.abs(time - 52.5) < 4, `${time}`);
    await context.close();
  });
});

describe("plots show the series", () => {
  test("each group of figures that the scenario has", async () => {
    const { page, context } = await open(reportOf(kinds["closed loop"]()), kUndrawn);
    const ids = await page.evaluate(() => window.__grapnel.plots.map((plot) => plot.id));
    for (const expected of [
      "joints-position-arm-1", "joints-velocity-arm-2", "joints-effort-arm-1", "end-effector-velocity-tip-1", "relative-speed",
      "momentum-linear-x", "momentum-angular-z", "base-attitude", "base-angular_velocity", "energy", "loop-position_defect",
      "loop-angle_defect", "grasp-force", "grasp-moment",
    ])
      assert.ok(ids.includes(expected), `${expected} is not among ${ids.join(", ")}`);
    const momentum = await page.evaluate(() => window.__grapnel.plots.find((plot) => plot.id === "momentum-linear-x").series);
    assert.deepEqual(momentum, ["robot", "sphere", "total"]);
    await context.close();
  });
});

describe("pages fit their medium", () => {
  for (const [name, options] of [
    ["a phone", { viewport: { width: 390, height: 844 }, isMobile: true, hasTouch: true, deviceScaleFactor: 2 }],
    ["a dark screen", { colorScheme: "dark" }],
    ["reduced motion", { reducedMotion: "reduce" }],
  ]) {
    test(name, async () => {
      for (const file of [reportOf(openLoop()), reportOf(sweep())]) {
        const { page, context, faults } = await open(file, options);
        await scrollThrough(page);
        const [wide, window_] = await page.evaluate(() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]);
        assert.ok(wide <= window_ + 1, `${wide} of ${window_} pixels`);
        assert.deepEqual(faults, []);
        await context.close();
      }
    });
  }

  test("paper", async () => {
    const { page, context, faults } = await open(reportOf(openLoop()));
    const pdf = await page.pdf({ format: "A4" });
    assert.ok(pdf.length > 50_000 && pdf.length < 20e6, `${pdf.length} bytes`);
    assert.deepEqual(faults, []);
    await context.close();
  });
});

describe("without WebGL", () => {
  test("everything except the drawing is shown", async () => {
    const plain = await launch(["--disable-3d-apis"]);
    const { page, context } = await open(reportOf(openLoop()), {}, plain);
    assert.ok((await page.locator("body").innerText()).match(/WebGL/));
    assert.ok((await page.evaluate(() => window.__grapnel.plots.length)) > 0);
    await context.close();
    await plain.close();
  });
});

describe("size", () => {
  test("a study of 100 000 points opens and responds", async () => {
    const out = path.join(folder, "large");
    mkdirSync(out);
    const axes = [
      { name: "speed", unit: "m/s", description: "", values: Array.from({ length: 400 }, (_, i) => i / 400) },
      { name: "angle", unit: "deg", description: "", values: Array.from({ length: 250 }, (_, i) => i) },
    ];
    const columns = Array.from({ length: 8 }, (_, i) => ({ name: `column-${i}`, unit: "N s", description: "" }));
    const settings = { schema: "grapnel-study-table/1", version: "0", study: { name: "large", sha256: "0".repeat(64), simulate: "impact" } };
    writeFileSync(path.join(out, "study.json"), JSON.stringify({ ...settings, points: 1e5, ok: 1e5, failed: 0, unreachable: 0, axes, columns }));
    const head = ["point", "speed [m/s]", "angle [deg]", "status", "reason", ...columns.map((c) => `${c.name} [N s]`)];
    const rows = axes[0].values.flatMap((speed, i) =>
      axes[1].values.map((angle, j) => [i * 250 + j, speed, angle, "ok", "", ...columns.map((_, k) => speed * Math.cos(angle + k))].join(",")),
    );
    writeFileSync(path.join(out, "table.csv"), [head.join(","), ...rows, ""].join("\n"));
    grapnel(["report", out]);
    const { page, context, faults } = await open(reportOf(out), kUndrawn);
    await scrollThrough(page);
    assert.equal(await page.evaluate(() => window.__grapnel.study.points), 1e5);
    assert.deepEqual(faults, []);
    await context.close();
  });
});

// ---- Damage ----

function damaged(name, change) {
  const text = readFileSync(reportOf(openLoop()), "utf8");
  const begin = text.indexOf('<script type="application/json" id="grapnel-data">');
  const first = text.indexOf(">", begin) + 1;
  const last = text.indexOf("</script>", first);
  const file = path.join(folder, `${name}.html`);
  writeFileSync(file, text.slice(0, first) + change(text.slice(first, last)) + text.slice(last));
  return file;
}

describe("damage is reported, never a blank page", () => {
  const changes = {
    "no data": () => "",
    "half the data": (text) => text.slice(0, text.length / 2),
    "another schema": (text) => text.replace("grapnel-report/1", "grapnel-report/9"),
    "no runs": () => '{"schema":"grapnel-report/1","kind":"run","version":"1","title":"x","runs":[]}',
  };
  for (const [name, change] of Object.entries(changes)) {
    test(name, async () => {
      const { page, context } = await open(damaged(name, change), kUndrawn);
      assert.match(await page.locator(".fault").innerText(), /cannot be shown/);
      await context.close();
    });
  }

  test("damaged series do not affect the numbers", async () => {
    const file = damaged("series", (text) => {
      const data = JSON.parse(text);
      data.runs[0].series.series[3].data = data.runs[0].series.series[3].data.slice(0, 400);
      return JSON.stringify(data).replaceAll("<", "\\u003c");
    });
    const { page, context } = await open(file, kUndrawn);
    const text = await page.locator("body").innerText();
    assert.match(text, /time series is damaged and not shown/);
    assert.match(text, /ledger/i);
    await context.close();
  });

  test("a summary without anything in it", async () => {
    const file = damaged("summary", (text) => {
      const data = JSON.parse(text);
      data.runs[0].summary = { schema: "grapnel-summary/1" };
      return JSON.stringify(data).replaceAll("<", "\\u003c");
    });
    const { page, context } = await open(file, kUndrawn);
    assert.ok((await page.locator("body").innerText()).length > 200);
    assert.match(await page.locator("#verdict").innerText(), /not in this summary/);
    await context.close();
  });

  test("results of earlier versions have no verdicts", async () => {
    const text = readFileSync(comparison(), "utf8");
    const file = path.join(folder, "earlier.html");
    writeFileSync(file, text.replaceAll(/"verdicts": ?\[/g, '"something":['));
    const { page, context, faults } = await open(file, kUndrawn);
    assert.match(await page.locator("#verdict").innerText(), /not in this summary/);
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("keys of the summary missing one by one", async () => {
    const plain = JSON.parse(readFileSync(path.join(openLoop(), "summary.json"), "utf8"));
    const paths = [];
    const walk = (value, at) => {
      if (at.length > 0 && at.length <= 3) paths.push(at);
      if (value && typeof value === "object" && !Array.isArray(value))
        for (const key of Object.keys(value)) walk(value[key], [...at, key]);
      else if (Array.isArray(value) && value.length > 0 && typeof value[0] === "object") walk(value[0], [...at, 0]);
    };
    walk(plain, []);
    // One page, rebuilt for every missing key.
    const { page, context, faults } = await open(reportOf(openLoop()), kUndrawn);
    const viewer = await page.evaluate(() => [...document.scripts].at(-1).textContent);
    await page.evaluate(`window.viewerAgain = function () {\n${viewer}\n}; undefined`); // compiled once for all pages
    const blank = await page.evaluate(async (all) => {
      const script = document.getElementById("grapnel-data");
      const whole = JSON.parse(script.textContent);
      Object.assign(whole.runs[0], { series: null, scene: null }); // the replay does not use the summary, and is slow
      const bad = [];
      for (const [number, at] of all.entries()) {
        // Every key is missing once, and every third has a wrong value once.
        for (const put of number % 3 ? [undefined] : [undefined, number % 2 ? null : "text"]) {
          const data = structuredClone(whole);
          let where = data.runs[0].summary;
          for (const key of at.slice(0, -1)) where = where?.[key];
          if (!where) continue;
          if (put === undefined) delete where[at.at(-1)];
          else where[at.at(-1)] = put;
          script.textContent = JSON.stringify(data);
          window.viewerAgain();
          const text = document.getElementById("report").innerText;
          if (text.length < 300 || document.querySelector(".fault")) bad.push(`${at.join(".")} = ${put}: ${text.slice(0, 200)}`);
        }
      }
      return bad;
    }, paths);
    assert.ok(paths.length > 100, `${paths.length} keys`);
    assert.deepEqual(blank, []);
    assert.deepEqual(faults, []);
    await context.close();
  });

  test("hostile names are texts", async () => {
    const hostile = `<img src=x onerror="window.hacked=1"></script><script>window.hacked=1</script>'"&\\u2028{{}}`;
    const file = path.join(folder, "hostile.yaml");
    const text = readFileSync(scenario("thesis/open-loop-case-1.yaml"), "utf8")
      .replace(/^name: .*$/m, `name: ${JSON.stringify(hostile)}`)
      .replace(/\.\.\/\.\.\/robots/g, path.join(source, "robots"))
      .replaceAll("target-1", "t<b>1<b>");
    writeFileSync(file, text);
    const out = result("hostile", ["run", file]);
    const { page, context, faults } = await open(reportOf(out), kUndrawn);
    await scrollThrough(page);
    assert.equal(await page.evaluate(() => window.hacked), undefined);
    assert.ok((await page.locator("body").innerText()).includes("<img src=x"));
    assert.deepEqual(faults, []);
    await context.close();
  });
});
