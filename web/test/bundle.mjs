// Modules of the viewer for tests without a browser: bundled into one file and imported.
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import os from "node:os";
import path from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const here = path.dirname(fileURLToPath(import.meta.url));
const modules = process.env.GRAPNEL_WEB_MODULES ?? path.join(here, "..");

// All exports of the named modules of src/: bundle(["plots/jumps"]).
export async function bundle(names) {
  const folder = mkdtempSync(path.join(os.tmpdir(), "grapnel-viewer-"));
  process.on("exit", () => rmSync(folder, { recursive: true, force: true }));
  const entry = path.join(folder, "all.ts");
  const source = path.join(here, "..", "src");
  writeFileSync(entry, names.map((name) => `export * from ${JSON.stringify(path.join(source, name))};`).join("\n"));
  const { build } = createRequire(path.join(modules, "package.json"))("esbuild");
  const outfile = path.join(folder, "all.mjs");
  await build({ entryPoints: [entry], outfile, bundle: true, format: "esm", logLevel: "warning", nodePaths: [path.join(modules, "node_modules")] });
  return import(pathToFileURL(outfile).href);
}
