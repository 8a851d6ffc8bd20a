// Functions shared by tests of reports in a headless browser. A page counts console errors and requests: a
// self-contained report has none of either.
import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import os from "node:os";
import path from "node:path";
import { after, test as nodeTest } from "node:test";
import { setTimeout as delay } from "node:timers/promises";
import { fileURLToPath, pathToFileURL } from "node:url";

// Packages are in the build folder, not beside this file.
const modules = process.env.GRAPNEL_WEB_MODULES ?? path.join(path.dirname(fileURLToPath(import.meta.url)), "..");
const { chromium } = createRequire(path.join(modules, "package.json"))("playwright-core");

export const program = process.env.GRAPNEL_PROGRAM ?? "build/release/bin/grapnel";
export const source = process.env.GRAPNEL_SOURCE_DIR ?? path.resolve(modules, "..");
// Without its windows Chromium takes half the time.
const kBrowsers = ["/usr/bin/chromium-headless-shell", "/usr/bin/chromium"];
export const chromiumPath = process.env.CHROMIUM ?? kBrowsers.find(existsSync) ?? kBrowsers[0];

const kArguments = [
  "--no-sandbox", // containers run as root
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--use-angle=swiftshader", // WebGL without a graphics card
  "--enable-unsafe-swiftshader",
  "--ignore-gpu-blocklist",
  "--disable-gpu-compositing", // painting without emulated shaders scrolls five times as fast
];

// A browser as its own process, which can be ended even if it no longer answers.
export async function launch(more = []) {
  if (!existsSync(chromiumPath)) throw new Error(`no browser at ${chromiumPath}: scripts/setup test installs it`);
  const server = await chromium.launchServer({ executablePath: chromiumPath, args: [...kArguments, ...more] });
  const browser = await chromium.connect(server.wsEndpoint());
  return { newContext: (options) => browser.newContext(options), close: () => server.kill() };
}

// The browser of all tests of a file.
let shared;
async function closeShared() {
  const browser = await shared?.catch(() => undefined);
  shared = undefined;
  await browser?.close();
}
after(closeShared);

// Seconds after which a test counts as hung.
const kHung = 180;

// A test that opens pages. Chromium occasionally stops answering, for which its interface has no timeout. Such a test is
// run once more in a new browser, and fails if it hangs again.
export function test(name, body) {
  nodeTest(name, async (context) => {
    const ends = async () => {
      const timer = new AbortController();
      const late = delay(kHung * 1000, false, { signal: timer.signal }).catch(() => false);
      return Promise.race([body(context).then(() => true), late]).finally(() => timer.abort());
    };
    if (await ends()) return;
    context.diagnostic(`hung for ${kHung} s, and run again in a new browser`);
    await closeShared();
    if (!(await ends())) {
      await closeShared();
      throw new Error(`hung twice for ${kHung} s`);
    }
  });
}

// A folder that is removed at the end of the process.
export function scratch() {
  const folder = mkdtempSync(path.join(os.tmpdir(), "grapnel-report-"));
  process.on("exit", () => rmSync(folder, { recursive: true, force: true }));
  return folder;
}

// Runs the program; throws with its messages unless it ends with one of `codes`.
export function grapnel(args, codes = [0]) {
  try {
    return execFileSync(program, args, { encoding: "utf8", stdio: ["ignore", "pipe", "pipe"], maxBuffer: 1 << 28 });
  } catch (error) {
    if (codes.includes(error.status)) return error.stdout;
    throw new Error(`grapnel ${args.join(" ")}: exit ${error.status}\n${error.stderr}`);
  }
}

export function scenario(name) {
  return path.join(source, "scenarios", name);
}

// Options of open() for tests without the replay: its drawing without a graphics card takes half of a page's time.
export const kUndrawn = { webgl: false };

// Pixels per px of a screen, unless a test states another number: drawing without a graphics card takes a time in
// proportion to the pixels, and layout does not depend on them.
const kPixelRatio = 0.5;

// Opens a file as a user does. `faults`: console errors, exceptions and requests; tests expect none. `webgl` false: no
// canvas has WebGL, so the page has no replay. The other options are those of the browser's context.
export async function open(file, { webgl = true, ...options } = {}, browser = undefined) {
  const context = await (browser ?? (await (shared ??= launch()))).newContext({ viewport: { width: 1280, height: 900 }, deviceScaleFactor: kPixelRatio, acceptDownloads: true, ...options });
  if (!webgl)
    await context.addInitScript(() => {
      const original = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
        return /webgl/.test(kind) ? null : original.call(this, kind, ...more);
      };
    });
  const page = await context.newPage();
  const faults = [];
  page.on("console", (message) => {
    if (message.type() === "error") faults.push(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => faults.push(`exception: ${error.message}`));
  const url = pathToFileURL(path.resolve(file)).href;
  page.on("request", (request) => {
    const address = request.url();
    if (address !== url && !address.startsWith("blob:") && !address.startsWith("data:")) faults.push(`request: ${address}`);
  });
  await page.goto(url, { timeout: 120_000 });
  await page.waitForFunction(() => window.__grapnel || document.querySelector(".fault"), null, { timeout: 120_000 }); // busy machines are slow
  return { page, context, faults };
}

// The content of a downloaded file, as a buffer.
export async function downloaded(download) {
  const folder = scratch();
  const file = path.join(folder, "download");
  await download.saveAs(file);
  return readFileSync(file);
}

// Accessibility violations found by axe, with everything unfolded.
export async function axeFaults(page) {
  await page.evaluate(() => document.querySelectorAll("details").forEach((one) => (one.open = true)));
  await scrollThrough(page);
  // Text inserted through the browser's interface, since the page's policy forbids scripts.
  await page.evaluate(readFileSync(createRequire(path.join(modules, "package.json")).resolve("axe-core/axe.min.js"), "utf8"));
  return axeRun(page, {});
}

// After axeFaults(), on the same page: only the violations of colour contrast.
export function axeContrastFaults(page) {
  return axeRun(page, { runOnly: ["color-contrast"] });
}

async function axeRun(page, options) {
  // Details of violations only: describing thousands of elements without violations takes a third of the time.
  const { violations } = await page.evaluate((chosen) => window.axe.run(document, { ...chosen, resultTypes: ["violations"] }), options);
  return violations.flatMap((one) => one.nodes.map((node) => `${one.id}: ${node.html.slice(0, 120)}`));
}

// Scrolls through the page, so that deferred parts are built.
export async function scrollThrough(page) {
  await page.evaluate(async () => {
    for (let y = 0; y <= document.body.scrollHeight; y += 500) {
      window.scrollTo(0, y);
      // The page determines the visible parts once per frame, after drawing: wait for two frames.
      await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 10))));
    }
    window.scrollTo(0, 0);
  });
}
