// Typesets TeX with KaTeX: reads a JSON list of {tex, display} from standard input and prints a JSON list of {html} or {error}.
// The package lies in the folder SITE_PACKAGES.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const katex = createRequire(path.join(process.env.SITE_PACKAGES, "package.json"))("katex");
const results = JSON.parse(readFileSync(0, "utf8")).map(({ tex, display }) => {
  try {
    // Left aligned beside its number: displaystyle within a line.
    const html = katex.renderToString(display ? `\\displaystyle ${tex}` : tex, { output: "html", strict: "ignore" });
    return { html };
  } catch (error) {
    return { error: error.message };
  }
});
process.stdout.write(JSON.stringify(results));
