// Pictures of reports' 3D replays, for the gallery: node stills.mjs LIST.json, a list of {report, out} with paths of files.
// Shows the instant of capture. Needs Chromium, and the packages that the build has put into GRAPNEL_WEB_MODULES.
import { readFileSync } from "node:fs";
import { launch, open } from "../../web/test/browser.mjs";

const kSize = { width: 560, height: 380 };

const browser = await launch();
for (const { report, out } of JSON.parse(readFileSync(process.argv[2], "utf8"))) {
  try {
    const { page, context } = await open(report, { viewport: kSize, colorScheme: "light" }, browser);
    await page.addStyleTag({
      content: `body > * { visibility: hidden }
        .replay-viewport { visibility: visible; position: fixed !important; inset: 0; z-index: 999; height: 100vh !important; max-height: none; border-radius: 0 }
        .replay-viewport > :not(canvas) { display: none !important }`,
    });
    await page.waitForFunction(() => window.__grapnel.replay !== null);
    await page.evaluate(() => {
      const { clock, runs } = window.__grapnel;
      const approach = runs[0].phases.find((phase) => phase.name === "approach");
      clock.time = approach ? approach.end : clock.begin;
    });
    await page.waitForTimeout(300); // the replay draws at the next frame
    await page.screenshot({ path: out, type: "jpeg", quality: 82 });
    await context.close();
  } catch (error) {
    console.error(`${report}: error: no picture: ${error.message.split("\n")[0]}`);
    process.exitCode = 1;
  }
}
await browser.close();
