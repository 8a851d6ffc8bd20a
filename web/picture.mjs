// A picture of a report's first screen: node picture.mjs REPORT.html OUT.jpg TIME [WIDTH HEIGHT]. For the documentation;
// needs Chromium, and the packages that the build has put into GRAPNEL_WEB_MODULES.
import { launch, open } from "./test/browser.mjs";

const [report, out, time, width = "1400", height = "890"] = process.argv.slice(2);
const browser = await launch();
const { page, faults } = await open(report, { viewport: { width: Number(width), height: Number(height) } }, browser);
await page.evaluate((t) => {
  window.__grapnel.clock.time = t;
}, Number(time));
await page.waitForTimeout(500); // the replay draws at the next frame
await page.screenshot({ path: out, type: "jpeg", quality: 80 });
await browser.close();
if (faults.length > 0) {
  console.error(faults.join("\n"));
  process.exitCode = 1;
}
