// The scenario: description and texts; for two runs their differences.
import type { SourceTexts } from "../data";
import { element } from "../dom";
import type { Run } from "../run";
import { hunks, lineDiff, type DiffLine } from "./line_diff";
import { valueChanges, yamlValues } from "./yaml_values";
import { list, num, text } from "./read";
import { absent, fold, pairs, table } from "./table";

interface Part {
  part: string;
  text: string;
  bytes: number;
}

export function sourceOf(run: Run): (SourceTexts & { files: Part[] }) | null {
  const source = run.data.source;
  if (!source || typeof source !== "object") return null;
  const files = list(source.files).map((file) => ({ part: text(file?.part, "file"), text: text(file?.text, ""), bytes: num(file?.bytes) ?? 0 }));
  return { description: text(source.description, ""), settings: list(source.settings).map(String), files };
}

const kMissing = "The result does not contain its scenario's text: it was made by an earlier version, or without a file.";

export function scenarioSection(run: Run): HTMLElement[] {
  const source = sourceOf(run);
  if (!source) return [absent(kMissing)];
  const shown: HTMLElement[] = [];
  if (source.description) shown.push(element("p", { class: "lead" }, source.description));
  if (source.settings.length > 0) shown.push(pairs([["changed by --set", settingsList(source.settings)]]));
  return [...shown, ...source.files.map((file) => fold(`${titleOf(file.part)}, ${linesIn(file)}`, textBlock(file)))];
}

function settingsList(settings: string[]): HTMLElement {
  return element("span", {}, ...settings.flatMap((one, i) => [i > 0 ? element("br") : null, element("code", {}, one)]));
}

function titleOf(part: string): string {
  const names: Record<string, string> = { scenario: "Scenario file", robot: "Robot file", trajectory: "Trajectory file" };
  return Object.hasOwn(names, part) ? names[part] : part;
}

function linesIn(file: Part): string {
  return file.text === "" && file.bytes > 0 ? `${file.bytes} bytes` : `${file.text.split("\n").length - 1} lines`;
}

function textBlock(file: Part): HTMLElement {
  if (file.text === "" && file.bytes > 0) return absent(`The file (${file.bytes} bytes) is too large to be stored here.`);
  return element("pre", { class: "source", tabindex: "0", role: "group", "aria-label": titleOf(file.part) }, file.text);
}

// ---- Two runs ----

export function scenarioDifferences(runs: Run[]): HTMLElement[] {
  const [a, b] = runs.map(sourceOf);
  if (!a || !b) {
    const who = [a ? "" : "A", b ? "" : "B"].filter(Boolean).join(" and ");
    return [absent(`The scenarios cannot be compared: the result of ${who} does not contain its scenario's text.`)];
  }
  const shown: HTMLElement[] = [];
  if (a.description !== b.description)
    shown.push(pairs([["A", a.description || "no description"], ["B", b.description || "no description"]]));
  const settings = lineDiff(a.settings.join("\n"), b.settings.join("\n")) ?? [];
  if (settings.some((line) => line.side !== "both")) shown.push(difference("Changed by --set", settings));
  const parts = [...new Set([...a.files, ...b.files].map((file) => file.part))];
  for (const part of parts) shown.push(partDifference(part, fileOf(a.files, part), fileOf(b.files, part)));
  return shown;
}

function fileOf(files: Part[], part: string): Part | undefined {
  return files.find((file) => file.part === part);
}

function partDifference(part: string, a: Part | undefined, b: Part | undefined): HTMLElement {
  const title = titleOf(part);
  if (!a || !b) return element("p", {}, `${title}: only ${a ? "A" : "B"} has one.`);
  const isStored = (file: Part) => file.text !== "" || file.bytes === 0;
  if (!isStored(a) || !isStored(b)) return element("p", {}, `${title}: too large to be stored and compared here.`);
  if (a.text === b.text) return element("p", {}, `${title}: identical in both.`);
  const [valuesA, valuesB] = [yamlValues(a.text), yamlValues(b.text)];
  const lines = lineDiff(a.text, b.text);
  if (valuesA && valuesB) {
    const changes = valueChanges(valuesA, valuesB);
    const code = (value: string | null) => (value === null ? "absent" : element("code", {}, value));
    const shown =
      changes.length > 0
        ? table(`${title}: ${changes.length} different values`, [{ head: "Key" }, { head: "A" }, { head: "B" }], changes.map((one) => [element("code", {}, one.path || "file"), code(one.a), code(one.b)]))
        : element("p", {}, `${title}: the same values, written differently.`);
    return element("div", {}, shown, lines && fold("The lines that differ", difference(title, lines)));
  }
  return lines ? difference(title, lines) : element("p", {}, `${title}: the texts differ too much for a comparison by lines.`);
}

function difference(title: string, lines: DiffLine[]): HTMLElement {
  const [removed, added] = ["a", "b"].map((side) => lines.filter((line) => line.side === side).length);
  const rows = hunks(lines, 2).map((line) => (line ? diffRow(line) : element("tr", { class: "skipped" }, element("td", { colspan: "4" }, "⋯"))));
  const head = element("tr", {}, ...["A", "B", "in", "text"].map((name) => element("th", { scope: "col" }, name)));
  const table = element("table", { class: "diff" }, element("caption", {}, `${title}: ${removed} lines only in A, ${added} only in B`), element("thead", {}, head), element("tbody", {}, ...rows));
  return element("div", { class: "table-box", tabindex: "0", role: "group", "aria-label": `Differences: ${title}` }, table);
}

function diffRow(line: DiffLine): HTMLElement {
  const sign = { both: "", a: "− A", b: "+ B" }[line.side];
  return element(
    "tr",
    { class: `diff-${line.side}` },
    element("td", { class: "numeric" }, line.a === null ? "" : String(line.a)),
    element("td", { class: "numeric" }, line.b === null ? "" : String(line.b)),
    element("td", {}, sign),
    element("td", {}, element("code", {}, line.text)),
  );
}
