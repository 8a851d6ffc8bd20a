// The documentation site opened from disk, without a server and without a network. scripts/docs runs this on its
// output: GRAPNEL_SITE is the folder, GRAPNEL_SITE_PICTURES a folder for screenshots.
import assert from "node:assert/strict";
import { existsSync, readFileSync, readdirSync } from "node:fs";
import path from "node:path";
import test from "node:test";
import { pathToFileURL } from "node:url";
import { launch } from "../../web/test/browser.mjs";

const site = process.env.GRAPNEL_SITE ?? "build/docs/html";
const pictures = process.env.GRAPNEL_SITE_PICTURES;
const theory = ["theory/README.html", "theory/index.html", "theory.html"].find((name) => existsSync(path.join(site, name)));
const address = (name, query = "") => pathToFileURL(path.resolve(site, name)).href + query;

const browser = await launch();
test.after(() => browser.close());

// Opens a page; `faults` are console errors, exceptions, and requests to the network or for missing files.
async function open(url, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  const page = await context.newPage();
  const faults = [];
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("request", (request) => request.url().startsWith("file:") || request.url().startsWith("data:") || faults.push(request.url()));
  page.on("requestfailed", (request) => faults.push(`${request.url()}: ${request.failure()?.errorText}`));
  await page.goto(url);
  return { page, faults, close: () => context.close() };
}

async function takeScreenshot(page, name) {
  if (pictures) await page.screenshot({ path: path.join(pictures, `${name}.png`) });
}

test("the first page leads to the tutorial", async () => {
  const { page, faults, close } = await open(address("index.html"));
  await takeScreenshot(page, "index");
  await page.locator("article a", { hasText: "tutorial" }).first().click();
  await page.waitForLoadState();
  assert.match(page.url(), /tutorial\.html$/);
  await takeScreenshot(page, "tutorial");
  assert.deepEqual(faults, []);
  await close();
});

for (const [words, expected] of [
  ["generalized_jacobian", /cpp\/dynamics|free_floating|theory/],
  ["campaign success", /campaign/],
  ["approach_direction", /formats\/scenario|how-to\/plan-an-approach/],
  ["reaction wheel", /how-to\/stabilize|theory/],
]) {
  test(`the search finds '${words}' from disk`, async () => {
    const { page, faults, close } = await open(address("search.html", `?q=${encodeURIComponent(words)}`));
    const found = page.locator("#search-results ul.search li a");
    await found.first().waitFor({ timeout: 20000 });
    const places = await found.evaluateAll((links) => links.map((link) => link.getAttribute("href")));
    assert.ok(places.some((place) => expected.test(place)), `${words}: ${places}`);
    await takeScreenshot(page, `search-${words.replace(/\W/g, "-")}`);
    assert.deepEqual(faults, []);
    await found.first().click();
    await page.waitForLoadState();
    assert.ok(await page.locator("article h1").count(), page.url());
    await close();
  });
}

test("pages of the documentation precede the C++ reference in search results, with excerpts", async () => {
  const { page, faults, close } = await open(address("search.html", "?q=impact"));
  await page.locator(".search-summary").getByText(/finished/).waitFor({ timeout: 20000 });
  const places = await page.locator("#search-results ul.search li a").evaluateAll((links) => links.map((link) => link.getAttribute("href")));
  const reference = places.findIndex((place) => place.startsWith("cpp/"));
  const last = places.findLastIndex((place) => /^(how-to|theory|formats)/.test(place));
  assert.ok(reference < 0 || last < reference, `${places}`);
  assert.ok(await page.locator("#search-results .context mark").count());
  await takeScreenshot(page, "search-impact");
  assert.deepEqual(faults, []);
  await close();
});

test("a search without results gives a message", async () => {
  const { page, close } = await open(address("search.html", "?q=xyzzyplugh"));
  await page.locator("#search-results").getByText(/did not match any documents/).waitFor({ timeout: 20000 });
  await close();
});

test("the gallery shows a picture of every scenario", async () => {
  const { page, faults, close } = await open(address("gallery.html"));
  const images = page.locator('article img[alt^="Picture of"]'); // copy buttons have pictures, too
  await images.evaluateAll((all) => all.forEach((image) => image.scrollIntoView()));
  const sizes = await images.evaluateAll((all) => Promise.all(all.map(async (image) => {
    await image.decode();
    return image.naturalWidth;
  })));
  const source = process.env.GRAPNEL_SOURCE ?? ".";
  const scenarios = ["scenarios", "scenarios/thesis"]
    .flatMap((folder) => readdirSync(path.join(source, folder)).filter((name) => name.endsWith(".yaml")));
  if (process.env.GRAPNEL_SITE_SAMPLE) assert.ok(sizes.length >= Math.floor(scenarios.length / 8), `${sizes.length} pictures`);
  else assert.equal(sizes.length, scenarios.length);
  assert.ok(sizes.every((width) => width > 100), `${sizes}`);
  await page.evaluate(() => window.scrollTo(0, 0));
  await takeScreenshot(page, "gallery");
  await images.first().click();
  await page.waitForLoadState();
  assert.match(page.url(), /scenarios\//);
  await takeScreenshot(page, "gallery-scenario");
  const report = page.locator("article a", { hasText: "Report" }).first();
  assert.ok(existsSync(new URL(await report.getAttribute("href"), page.url())));
  assert.deepEqual(faults, []);
  await close();
});

test("equations are typeset", { skip: !existsSync(path.join(site, "_static", "katex")) }, async () => {
  const name = existsSync(path.join(site, "theory", "07-impact.html")) ? "theory/07-impact.html" : "theory.html";
  const { page, faults, close } = await open(address(name));
  const equation = page.locator(".equations").first();
  assert.ok((await equation.locator(".katex").count()) > 0);
  assert.ok((await page.evaluate(() => document.fonts.ready.then((fonts) => [...fonts].filter((font) => font.family.startsWith("KaTeX") && font.status === "loaded").length))) > 0);
  await page.evaluate(() => document.querySelector(".equations").scrollIntoView({ block: "start" }));
  await takeScreenshot(page, "equations");
  assert.deepEqual(faults, []);
  await close();
});

const notebooks = readdirSync(path.join(process.env.GRAPNEL_SOURCE ?? ".", "examples", "notebooks")).filter((name) => name.endsWith(".ipynb")).map((name) => name.replace(".ipynb", ""));
const text = (name) => readFileSync(path.join(site, "notebooks", `${name}.html`), "utf8");

test("every notebook has a page, which leads to the next and to its file", () => {
  assert.ok(notebooks.length >= 5);
  for (const name of notebooks) {
    assert.match(text(name), new RegExp(`href="[^"]*/${name}\\.ipynb"`), name);
    assert.ok(!/(src|href)="https?:[^"]*\.(js|css)"/.test(text(name)), `${name} loads from the network`);
  }
  assert.match(text("first-capture"), /<a [^>]*href="your-urdf\.html"/);
});

test("notebooks show their outputs and replays from disk", { skip: !text(notebooks[0]).includes("notebook-output") }, async () => {
  for (const name of notebooks) {
    const { page, faults, close } = await open(address(`notebooks/${name}.html`));
    const images = page.locator('.notebook-output img[alt^="Figure"]'); // copy buttons have pictures, too
    assert.ok(await images.count(), `${name} has no figure`);
    const sizes = await images.evaluateAll((all) => Promise.all(all.map(async (image) => {
      await image.decode();
      return [image.naturalWidth, image.getBoundingClientRect().width];
    })));
    assert.ok(sizes.every(([width, shown]) => width > 400 && shown > 200), `${name}: ${sizes}`);
    assert.ok(await page.locator(".notebook-output", { hasText: "Conservation checks: passed" }).count(), name);
    await takeScreenshot(page, `notebook-${name}`);
    const frame = page.locator(".notebook-output iframe").first();
    await frame.scrollIntoViewIfNeeded();
    const report = await (await frame.elementHandle()).contentFrame();
    await report.waitForFunction(() => window.__grapnel?.replay, undefined, { timeout: 60000 });
    const drawn = await report.evaluate(() => window.__grapnel.replay.renderCount());
    await report.evaluate(() => { window.__grapnel.clock.time = 0.5 * window.__grapnel.clock.end; });
    await report.waitForFunction((n) => window.__grapnel.replay.renderCount() > n, drawn, { timeout: 60000 });
    await takeScreenshot(page, `notebook-${name}-replay`);
    assert.deepEqual(faults, [], name);
    await close();
  }
});

test("no page scrolls sideways", async () => {
  const pages = readdirSync(site, { recursive: true }).map((name) => name.replaceAll("\\", "/"))
    .filter((name) => name.endsWith(".html") && !/^(doxygen|reports|_static|scenarios)\//.test(name));
  const { page, close } = await open("about:blank");
  for (const name of pages) {
    await page.goto(address(name), { waitUntil: "domcontentloaded" });
    for (const [width, height] of [[1366, 768], [1600, 900]]) {
      await page.setViewportSize({ width, height });
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= width, `${name} is ${wide} px wide on a screen of ${width}`);
    }
  }
  await close();
});

test("pages are readable on a phone and in dark mode", async () => {
  for (const name of ["index.html", "formats/scenario.html", "formats/scenario/impact.html", "notebooks/first-capture.html", theory]) {
    const { page, faults, close } = await open(address(name), { viewport: { width: 390, height: 800 }, colorScheme: "dark" });
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(width <= 391, `${name} is ${width} px wide on a screen of 390`);
    const [text, background] = await page.evaluate(() => ["color", "backgroundColor"].map((key) => getComputedStyle(document.body)[key].match(/\d+/g).map(Number)));
    assert.ok(background[0] < 60 && text[0] > 150, `${name}: ${text} on ${background}`);
    await takeScreenshot(page, `phone-${name.replace(/\W/g, "-")}`);
    assert.deepEqual(faults, []);
    await close();
  }
});

test("the references have their contents", async () => {
  assert.ok(existsSync(path.join(site, "doxygen", "index.html")));
  const commands = readFileSync(path.join(site, "commands.html"), "utf8");
  for (const word of ["grapnel run", "--extend", "Exit codes"]) assert.ok(commands.includes(word), word);
  const { page, faults, close } = await open(address("cpp/capture.html"));
  assert.ok(await page.locator("dt.sig", { hasText: "simulate_capture" }).count());
  await takeScreenshot(page, "cpp-capture");
  assert.deepEqual(faults, []);
  await close();
});
