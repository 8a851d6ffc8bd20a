// The worst cases, by each column that a criterion or a rating limits, with the command that replays each.
import { download, element } from "../dom";
import { columnHead, label, number } from "../format";
import { breakable, plural } from "../study/describe";
import { rowsToText } from "../study/csv";
import { fileName } from "../study/export";
import type { StudyState } from "../study/state";
import { button, copyButton, select } from "../study/ui";
import type { CampaignModel, WorstList } from "./model";
import type { Sample } from "./sample";

// Null: the campaign has none.
export function worstCard(model: CampaignModel, sample: Sample, state: StudyState, study: string): HTMLElement | null {
  const lists = model.worst.filter((w) => w.cases.length > 0);
  if (lists.length === 0) return null;
  let now = lists[0];
  const host = element("div", { class: "st-scroll", tabindex: "0", role: "group", "aria-label": "Worst cases" });
  const title = element("h2", { class: "st-card-title" });
  const rowOf = new Map(Array.from(sample.cases, (k, row) => [k, row]));
  const draw = (): void => {
    title.textContent = breakable(`Worst cases: ${measureOf(now)}`);
    host.replaceChildren(tableOf(model, now, (k) => rowOf.get(k), state));
  };
  draw();
  return element(
    "section",
    { class: "card st-card", id: "study-worst", "aria-label": "Worst cases" },
    element("div", { class: "st-card-head" }, title, element("div", { class: "st-downloads" }, button("CSV", () => download(`${fileName(study, "worst")}.csv`, csv(model, now), "text/csv"), { title: "Download these cases" }))),
    element("div", { class: "st-controls" }, lists.length > 1 && select("By", lists.map((w, k) => ({ value: String(k), text: measureOf(w) })), "0", (k) => ((now = lists[Number(k)] ?? now), draw()))),
    host,
    lists[0].cases[0].command && element("p", { class: "st-note print-only" }, "To simulate one with a full report: ", element("code", {}, lists[0].cases[0].command)),
  );
}

function tableOf(model: CampaignModel, list: WorstList, rowOf: (k: number) => number | undefined, state: StudyState): HTMLElement {
  const heads = ["case", label(list.by, list.unit), "success", ...model.inputs.map((d) => label(d.name, d.unit)), "replay"];
  const head = element("tr", {}, ...heads.map((text, k) => element("th", { scope: "col", ...(k > 2 && k < heads.length - 1 ? { class: "cp-input-head", title: model.inputs[k - 3].description } : {}) }, breakable(text))));
  const rows = list.cases.map((one) => {
    const row = rowOf(one.index);
    const name = row === undefined ? String(one.index) : button(String(one.index), () => state.select(row), { class: "st-link", title: "Show this case" });
    return element(
      "tr",
      {},
      element("th", { scope: "row" }, name),
      element("td", {}, number(one.value)),
      element("td", { class: one.success === false ? "cp-bad" : "" }, one.success === null ? "–" : one.success ? "yes" : "no"),
      ...model.inputs.map((_, k) => element("td", {}, number(one.inputs[k]))),
      element("td", { class: "cp-replay" }, one.command && copyButton(() => one.command, `Copy: ${one.command}`), savedLink(model, one.index, "report")),
    );
  });
  return element("table", { class: "st-grid cp-worst" }, element("thead", {}, head), element("tbody", {}, ...rows));
}

function csv(model: CampaignModel, list: WorstList): string {
  const head = ["case", columnHead(list.by, list.unit), "success", ...model.inputs.map((d) => columnHead(d.name, d.unit)), "replay"];
  return rowsToText([head, ...list.cases.map((c) => [c.index, c.value, c.success === null ? "" : c.success ? 1 : 0, ...model.inputs.map((_, k) => c.inputs[k] ?? NaN), c.command])]);
}

// Reasons for failures; similar reasons are grouped.
export function failuresCard(model: CampaignModel, study: string): HTMLElement | null {
  if (model.failures.length === 0) return null;
  const most = Math.max(...model.failures.map((f) => f.count));
  const cases = model.success.trials;
  const rows = model.failures.map((f) =>
    element(
      "tr",
      {},
      element("td", {}, String(f.count)),
      element("td", { class: "st-left" }, bar(f.count, most, cases)),
      element("td", { class: "st-left" }, element("span", { class: `st-status-${/^\w+$/.test(f.status) ? f.status : "other"}` }, f.status)),
      element("td", { class: "st-left" }, f.reason, element("div", { class: "cp-examples" }, ...f.examples.map((e) => example(model, e)))),
    ),
  );
  const head = element("tr", {}, ...["cases", "share", "status", "reason"].map((text, k) => element("th", { scope: "col", ...(k > 0 ? { class: "st-left" } : {}) }, text)));
  const text = (): string => rowsToText([["cases", "status", "reason", "examples"], ...model.failures.map((f) => [f.count, f.status, f.reason, f.examples.map((e) => e.index).join(" ")])]);
  return element(
    "section",
    { class: "card st-card", id: "study-failures", "aria-label": "Reasons for failures" },
    element("div", { class: "st-card-head" }, element("h2", { class: "st-card-title" }, model.failuresAreAll ? "Cases without success, by reason" : "Cases without a result, by reason"), element("div", { class: "st-downloads" }, button("CSV", () => download(`${fileName(study, "failures")}.csv`, text(), "text/csv"), { title: "Download the reasons" }))),
    element("div", { class: "st-scroll" }, element("table", { class: "st-grid cp-failures" }, element("thead", {}, head), element("tbody", {}, ...rows))),
    graspTable(model),
    element("p", { class: "st-note" }, `${model.failuresAreAll ? "Every case is in one line." : "They count as no success."}${model.failuresLeftOut > 0 ? ` ${plural(model.failuresLeftOut, "case")} with rarer reasons are left out.` : ""}`),
  );
}

// A failure mode's share of all cases, as a bar relative to the most frequent one.
function bar(count: number, most: number, cases: number): HTMLElement {
  const share = element("span", {});
  share.style.width = `${(100 * count) / Math.max(1, most)}%`;
  const text = cases > 0 ? `${number((100 * count) / cases, 3)} %` : "";
  return element("span", { class: "cp-mode" }, element("span", { class: "bar", role: "img", "aria-label": text }, share), element("span", {}, text));
}

// How often each grasp fails, and the most frequent tolerance; only for grasps that fail.
function graspTable(model: CampaignModel): HTMLElement | null {
  const missed = model.grasps.filter((g) => g.missed > 0);
  if (missed.length === 0) return null;
  const names = [...new Set(missed.flatMap((g) => g.tolerances.map((t) => t.name)))];
  const head = element("tr", {}, ...["grasp", "missed", "of", ...names.map((n) => `most by ${n.replace(/_/g, " ")}`)].map((t) => element("th", { scope: "col" }, t)));
  const rows = missed.map((g) => element("tr", {}, element("th", { scope: "row" }, g.endEffector), ...[g.missed, g.captured + g.missed, ...names.map((n) => g.tolerances.find((t) => t.name === n)?.limiting ?? 0)].map((v) => element("td", {}, String(v)))));
  return element("div", { class: "st-scroll" }, element("table", { class: "st-grid cp-grasps" }, element("thead", {}, head), element("tbody", {}, ...rows)));
}

// Link to the complete results of a case, if they are stored; else null.
export function savedLink(model: CampaignModel, index: number, linkText = "its full report"): HTMLElement | null {
  return model.saved.has(index) ? element("a", { href: `series/case-${index}/report.html`, class: "cp-saved" }, linkText) : null;
}

function example(model: CampaignModel, e: { index: number; reason: string; command: string }): HTMLElement {
  const made = element("span", { class: "cp-example", title: e.reason }, `case ${e.index} `);
  if (e.command) made.append(copyButton(() => e.command, `Copy: ${e.command}`));
  const saved = savedLink(model, e.index, "report");
  if (saved) made.append(" ", saved);
  return made;
}

// "largest magnitude of base/angular_velocity_change/z"
export function measureOf(list: WorstList): string {
  return `${list.direction || "extreme"} ${list.magnitude ? "magnitude of " : ""}${list.by}`;
}
