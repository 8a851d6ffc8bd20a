// Header of the page: question, result, and source file. Uses the classes of the page of a run.
import { element } from "../dom";
import { unitText } from "../format";
import { mark } from "../page/table";
import { themeToggle } from "../page/theme";

export type Tone = "good" | "bad" | "warn" | "none"; // none: numbers without a verdict

export interface Tile {
  name: string;
  value: string;
  unit?: string;
  detail?: string;
  tone?: Tone;
}

export interface HeaderSpec {
  kind: string; // "Study"
  title: string;
  verdict: string;
  tone: Tone;
  said: string; // a sentence or two
  facts: string[]; // in one line under the title
  tiles: Tile[];
  about: [string, string][]; // settings; those without a text are left out
  text: string; // the file itself; "": not known
  more: Node | null; // below the settings
}

export function header(spec: HeaderSpec): HTMLElement {
  const about = spec.about.filter(([, value]) => value !== "").flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]);
  return element(
    "div",
    { class: "st-head" },
    element(
      "header",
      { class: "page-head" },
      element("div", { class: "brand" }, element("span", { class: "kind" }, `Grapnel · ${spec.kind}`), themeToggle()),
      element("h1", {}, spec.title || "untitled"),
      element("p", { class: "facts" }, ...spec.facts.filter((f) => f !== "").map((f) => element("span", {}, f))),
    ),
    element("div", { class: `st-verdict st-verdict-${spec.tone}`, id: "study-verdict" }, element("p", { class: "st-word" }, spec.tone === "none" ? element("strong", {}, spec.verdict) : mark(spec.tone, spec.verdict)), element("p", { class: "small" }, spec.said)),
    element("div", { class: "tiles st-tiles" }, ...spec.tiles.map(tile)),
    element(
      "details",
      { class: "st-about" },
      element("summary", {}, `About this ${spec.kind.toLowerCase()}`),
      element("dl", { class: "st-facts" }, ...about),
      spec.more,
      spec.text !== "" && element("pre", { class: "st-file", tabindex: "0", "aria-label": "The file" }, spec.text),
    ),
  );
}

function tile(spec: Tile): HTMLElement {
  return element(
    "div",
    { class: `tile ${spec.tone ?? ""}` },
    element("p", { class: "name" }, spec.name),
    element("p", { class: "value" }, spec.value, unitText(spec.unit ?? "") ? element("span", { class: "unit" }, ` ${unitText(spec.unit ?? "")}`) : null),
    spec.detail ? element("p", { class: "detail" }, spec.detail) : null,
  );
}

export function text(value: unknown): string {
  return value === null || value === undefined ? "" : String(value);
}
