// Bundles src/main.ts and its style into OUT/viewer.js and OUT/viewer.css: node build.mjs [OUT] (default: dist).
// The C++ build embeds both into the program; nothing is loaded from anywhere when a report is opened. That build runs a
// copy of this file beside its own node_modules: --source DIR says where src/ is, --depfile FILE lists what was read.
import { build } from "esbuild";
import { writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import path from "node:path";

const here = path.dirname(fileURLToPath(import.meta.url));
const { out, source, depfile } = options(process.argv.slice(2));

const { metafile } = await build({
  absWorkingDir: source,
  nodePaths: [path.join(here, "node_modules")],
  entryPoints: { viewer: "src/main.ts" },
  outdir: out,
  bundle: true,
  minify: true,
  format: "iife",
  target: ["es2022"],
  charset: "utf8",
  legalComments: "eof",
  loader: { ".css": "css" },
  logLevel: "warning",
  metafile: true,
});
if (depfile) writeFileSync(depfile, makeRule(path.join(out, "viewer.js"), Object.keys(metafile.inputs)));

function options(words) {
  const found = { out: path.join(here, "dist"), source: here, depfile: undefined };
  while (words.length > 0) {
    const word = words.shift();
    if (word === "--source") found.source = path.resolve(words.shift());
    else if (word === "--depfile") found.depfile = path.resolve(words.shift());
    else found.out = path.resolve(word);
  }
  return found;
}

// As make and Ninja read it.
function makeRule(target, inputs) {
  const escaped = (file) => path.resolve(source, file).replace(/([ #])/g, "\\$1").replace(/\$/g, "$$$$");
  return `${escaped(target)}: ${inputs.map(escaped).join(" \\\n  ")}\n`;
}
