// The page over a folder of results: what is there, the newest first, with verdicts and links.
import type { IndexedResult, ReportData } from "./data";
import { element } from "./dom";
import { list, num, text } from "./page/read";
import { mark, sortableTable, type Cell, type Column } from "./page/table";
import { themeToggle } from "./page/theme";

const kKinds: Record<string, string> = { run: "Run", sweep: "Study", campaign: "Campaign", optimization: "Optimization" };

export function buildIndexPage(host: HTMLElement, data: ReportData): void {
  const results = list(data.index?.results);
  const broken = results.filter((one) => text(one.fault, "") !== "");
  const box = element("div", { class: "index-results" });
  const filter = element("input", { type: "search", placeholder: "Filter by name, folder or verdict", "aria-label": "Filter results" });
  const kinds = element("select", { "aria-label": "Kind of result" }, element("option", { value: "" }, "all kinds"));
  for (const kind of [...new Set(results.map((one) => text(one.kind)))]) kinds.append(element("option", { value: kind }, kKinds[kind] ?? kind));
  const status = element("span", { role: "status", class: "small" });
  const show = (): void => {
    const shown = results.filter((one) => matches(one, filter.value, kinds.value));
    status.textContent = `${shown.length} of ${results.length} results`;
    box.replaceChildren(shown.length > 0 ? resultTable(shown) : element("p", { class: "empty" }, "No result matches."));
  };
  filter.addEventListener("input", show);
  kinds.addEventListener("change", show);
  show();
  host.replaceChildren(
    element(
      "header",
      { class: "page-head" },
      element("div", { class: "brand" }, element("span", { class: "kind" }, "Grapnel · Results"), themeToggle()),
      element("h1", {}, data.title || "Results"),
      element("p", { class: "facts" }, ...counts(results).map((one) => element("span", {}, one))),
    ),
    ...(broken.length > 0
      ? [element("section", { class: "notices", "aria-label": "Warnings" }, element("ul", {}, element("li", {}, mark("bad", `${broken.length} ${broken.length === 1 ? "result" : "results"} cannot be read; the table names the errors`))))]
      : []),
    element("section", { id: "results", class: "part" }, element("h2", {}, "Results"), element("p", { class: "index-controls" }, filter, kinds, status), box),
    element("footer", { class: "page-foot" }, `Made by Grapnel ${text(data.version, "of unknown version")} from the folders of results; this page loads nothing until a link is followed.`),
  );
  (window as unknown as { __grapnel: unknown }).__grapnel = { index: results };
}

// "12 runs", "1 campaign".
export function counts(results: readonly IndexedResult[]): string[] {
  return Object.entries(kKinds).flatMap(([kind, name]) => {
    const count = results.filter((one) => one.kind === kind).length;
    const word = name.toLowerCase();
    const several = word === "study" ? "studies" : `${word}s`;
    return count > 0 ? [`${count} ${count === 1 ? word : several}`] : [];
  });
}

export function matches(one: IndexedResult, words: string, kind: string): boolean {
  if (kind !== "" && one.kind !== kind) return false;
  const all = [one.title, one.path, one.fault, ...list(one.answers).map((answer) => `${text(answer.word, "")} ${text(answer.sentence, "")}`)].join(" ").toLowerCase();
  return words.toLowerCase().split(/\s+/).every((word) => all.includes(word));
}

// A relative address of a file below the page's folder: names cannot be read as a scheme, a query or a parent.
export function linkTo(path: string, file: string): string {
  const parts = path.split("/").filter((part) => part !== "" && part !== ".");
  return ["." , ...parts, file].map((part) => (part === ".." ? part : encodeURIComponent(part))).join("/");
}

// The time in UTC, which sorts as text: "2026-11-30 20:41".
export function timeText(seconds: number | null | undefined): string {
  const time = num(seconds);
  return time === null || time <= 0 ? "–" : new Date(1000 * time).toISOString().slice(0, 16).replace("T", " ");
}

function resultTable(results: readonly IndexedResult[]): HTMLElement {
  const columns: Column[] = [{ head: "Changed (UTC)" }, { head: "Kind" }, { head: "Name" }, { head: "Verdicts" }, { head: "Folder" }];
  const rows = results.map((one): Cell[] => [timeText(one.time), kKinds[text(one.kind)] ?? text(one.kind), nameCell(one), verdictCell(one), element("code", {}, text(one.path))]);
  const keys = results.map((one) => [-(num(one.time) ?? 0), text(one.kind), text(one.title).toLowerCase(), rank(one), text(one.path)]);
  return sortableTable("All results, the newest first; the heads sort", columns, rows, keys.map((key) => key.map((value, i) => (i === 0 || i === 3 ? String(1e12 + Number(value)) : value))), 0);
}

function nameCell(one: IndexedResult): Cell {
  const name = text(one.title, "untitled");
  return one.report ? element("a", { href: linkTo(text(one.path, "."), "report.html") }, name) : element("span", {}, name, element("span", { class: "said-below" }, "no report.html: grapnel report makes it"));
}

const kTones = ["bad", "warn", "good", "none"] as const;
function toneOf(tone: unknown): (typeof kTones)[number] {
  return kTones.find((one) => one === tone) ?? "none";
}

// The worst verdict first.
function rank(one: IndexedResult): number {
  if (text(one.fault, "") !== "") return 0;
  return 1 + Math.min(3, ...list(one.answers).map((answer) => kTones.indexOf(toneOf(answer.tone))));
}

function verdictCell(one: IndexedResult): Cell {
  const fault = text(one.fault, "");
  if (fault !== "") return element("span", {}, mark("bad", "cannot be read"), element("span", { class: "said-below" }, fault));
  const answers = list(one.answers);
  if (answers.length === 0) return "–";
  return element(
    "span",
    { class: "index-verdicts" },
    ...answers.map((answer) => element("span", { title: text(answer.sentence, "") }, mark(toneOf(answer.tone), text(answer.word)), one.kind === "run" ? "" : element("span", { class: "said-below" }, text(answer.sentence, "")))),
  );
}
