// Makes a report whose viewer has the engine of fake_engine.mjs, with the same policy as reports of the program.
import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import { fileURLToPath } from "node:url";

const here = path.dirname(fileURLToPath(import.meta.url));
const modules = process.env.GRAPNEL_WEB_MODULES ?? path.join(here, "..");

export async function variantPage(report, file, known) {
  const { build } = createRequire(path.join(modules, "package.json"))("esbuild");
  const { outputFiles } = await build({ entryPoints: [path.join(here, "fake_engine.mjs")], outdir: "out", write: false, bundle: true, minify: true, format: "iife", charset: "utf8", logLevel: "warning", nodePaths: [path.join(modules, "node_modules")] });
  const output = (ending) => outputFiles.find((one) => one.path.endsWith(ending)).text.replace(/<\/(script|style)|<!--/gi, "$&\\");
  const script = output(".js");
  const page = readFileSync(report, "utf8");
  const policy = `'sha256-${createHash("sha256").update(script).digest("base64")}'`;
  const variants = JSON.stringify(known).replaceAll("<", "\\u003c");
  const parts = [
    [/(<style>)[^]*?(<\/style><\/head>)/, output(".css")],
    [/(script-src )'sha256-[^']*'()/, policy],
    [/(\n<script>)[^]*?(<\/script><\/body>)/, script],
    [/(<\/main>\n)()/, `<script type="application/json" id="variants">${variants}</script>\n`],
  ];
  writeFileSync(file, parts.reduce((text, [place, content]) => text.replace(place, (_, before, after) => before + content + after), page));
  return file;
}

// The data of a report.
export function dataOf(report) {
  const [, text] = /<script type="application\/json" id="grapnel-data">([^]*?)<\/script>/.exec(readFileSync(report, "utf8"));
  return JSON.parse(text);
}

// Values of a scenario and of its robot as the engine lists them: items by index, without names.
export function settablesOf(value, at = "") {
  if (Array.isArray(value) && value.some((item) => item !== null && typeof item === "object")) return value.flatMap((item, i) => settablesOf(item, `${at}[${i}]`));
  if (value !== null && typeof value === "object" && !Array.isArray(value)) return Object.entries(value).flatMap(([key, item]) => settablesOf(item, at ? `${at}.${key}` : key));
  return /(^|\.)(name|end_effector|target|point|robot)$/.test(at) ? [] : [{ path: at, unit: "", text: `meaning of ${at}`, value }];
}
