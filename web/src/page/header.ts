// Title of the report, and appearance of the page.
import type { ReportData } from "../data";
import { element } from "../dom";
import { number } from "../format";
import type { Run } from "../run";
import { num, text, withUnit } from "./read";
import { sourceOf } from "./scenario";
import { themeToggle } from "./theme";

export function header(data: ReportData, runs: Run[]): HTMLElement {
  const kind = data.kind === "comparison" ? "Comparison of two captures" : "Capture";
  return element(
    "header",
    { class: "page-head" },
    element("div", { class: "brand" }, element("span", { class: "kind" }, `Grapnel · ${kind}`), themeToggle()),
    element("h1", {}, data.title || "untitled"),
    ...runs.map((run) => facts(run, runs.length > 1)),
    ...(runs.length === 1 ? descriptionOf(runs[0]) : []),
  );
}

function descriptionOf(run: Run): HTMLElement[] {
  const said = sourceOf(run)?.description;
  return said ? [element("p", { class: "description" }, said)] : [];
}

function facts(run: Run, several: boolean): HTMLElement {
  const s = run.summary ?? {};
  const law = text(s.impact?.law, "");
  const entries: (Node | string | null)[] = [
    several ? element("strong", {}, `${run.data.label}: ${text(s.scenario?.name)}`) : null,
    law ? `impact law ${law.replace(/_/g, " ")}` : "no impact",
    num(s.impact?.time) !== null ? `impact at ${withUnit(num(s.impact?.time), "s")}` : null,
    run.samples > 1 ? `${number(run.end - run.begin)} s simulated` : null,
    `Grapnel ${text(s.version, "of unknown version")}`,
    run.data.folder ? `folder ${run.data.folder}` : null,
    hash(text(s.scenario?.sha256, "")),
  ];
  return element("p", { class: "facts" }, ...entries.filter(Boolean).map((entry) => element("span", {}, entry)));
}

// Short; complete on hover and when copied.
function hash(full: string): HTMLElement | null {
  if (full === "") return null;
  const button = element("button", {
    type: "button",
    class: "hash",
    title: `SHA-256 of the scenario: ${full}. Click to copy.`,
    "aria-label": `scenario ${full.slice(0, 12)}: copy its SHA-256`,
  });
  const shown = element("code", {}, full.slice(0, 12));
  const said = element("span", { class: "said", role: "status" });
  button.append("scenario ", shown);
  button.addEventListener("click", () => {
    copy(full).then(
      () => (said.textContent = " copied"),
      () => (shown.textContent = full),
    );
    setTimeout(() => (said.textContent = ""), 2500);
  });
  return element("span", {}, button, said, element("code", { class: "print-only" }, full));
}

// Pages opened from disk may lack the clipboard.
async function copy(content: string): Promise<void> {
  if (!navigator.clipboard) throw new Error("no clipboard");
  await navigator.clipboard.writeText(content);
}
