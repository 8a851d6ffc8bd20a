// The page of impulses from a log: contacts, impulses at grasps, rates, momentum over time.
import { knownRole } from "./colors";
import type { MomentumCurve, Partly, ReportData } from "./data";
import { element } from "./dom";
import { number, unitText } from "./format";
import type { MeasuredComponent, MeasuredContact } from "./impulses_types";
import { doubles, section, warnings } from "./log_page";
import { list, num, text, withUnit } from "./page/read";
import { mark, pairs, table, type Cell } from "./page/table";
import { themeToggle } from "./page/theme";
import { svgPlot, type SvgLine } from "./plots/svg";

type Contact = Partly<MeasuredContact>;

export function buildImpulsesPage(host: HTMLElement, data: ReportData): void {
  const report = data.impulses?.report;
  if (!report) throw new Error("the report contains no impulses");
  const contacts = list(report.contacts);
  host.replaceChildren(
    element(
      "header",
      { class: "page-head" },
      element(
        "div",
        { class: "brand" },
        element("span", { class: "kind" }, "Grapnel · Impulses of a measurement"),
        themeToggle(),
      ),
      element("h1", {}, data.title || "untitled"),
    ),
    ...warnings(list(report.warnings)),
    section(
      "summary",
      "Summary",
      pairs([
        ["momentum balance", verdictMark(report.consistent)],
        ["run", text(report.scenario)],
        ["log", text(report.log)],
        ["contacts", number(contacts.length)],
        ["expected false alarms", number(num(report.false_alarms), 3)],
      ]),
    ),
    ...contacts.map((one, i) => section(`contact-${i}`, title(one), reason(one), impulses(one), rates(one))),
    section("momentum", "Momentum and kinetic energy", ...curves(list(data.impulses?.momentum))),
    element(
      "footer",
      { class: "page-foot" },
      `Made by Grapnel ${data.version || "of unknown version"}; this page loads nothing. `,
      "Impulses act on the robot, along the axes of the world frame.",
    ),
  );
  (window as unknown as { __grapnel: object }).__grapnel = { impulses: report }; // for tests and for the browser's console
}

function verdictMark(verdict: unknown): HTMLElement {
  if (verdict === "yes") return mark("good", "consistent");
  return verdict === "no" ? mark("bad", "inconsistent") : mark("none", "not checked");
}

function title(c: Contact): string {
  return `Contact at ${withUnit(num(c.time), "s", 7)}`;
}

function reason(c: Contact): HTMLElement {
  const assumed = list(c.assumed).map((one) => text(one));
  return element(
    "p",
    {},
    verdictMark(c.consistent),
    ` ${text(c.reason, "")}. `,
    c.detected ? `The time was detected, with the standard uncertainty ${withUnit(num(c.time_uncertainty), "s", 3)}. ` : "",
    assumed.length > 0 ? `Not measured, and therefore as in the run: ${assumed.join(", ")}.` : "",
  );
}

function impulses(c: Contact): HTMLElement {
  const row = (owner: string, one: Partly<MeasuredComponent>): Cell[] => [
    owner,
    `${text(one.name)} [${unitText(text(one.unit, ""))}]`,
    one.determined ? number(num(one.value), 4) : "not determined",
    one.determined ? number(num(one.uncertainty), 2) : null,
    num(one.simulated) === null ? null : number(num(one.simulated), 4),
  ];
  const rows = [
    ...list(c.grasps).flatMap((g) => list(g.components).map((one) => row(text(g.end_effector), one))),
    ...list(c.drives).map((one) => row("drive", one)),
  ];
  return table(
    "Impulses on the robot",
    [
      { head: "Grasp" },
      { head: "Component" },
      { head: "Estimate", numeric: true },
      { head: "Standard uncertainty", numeric: true },
      { head: "Run", numeric: true },
    ],
    rows,
  );
}

function rates(c: Contact): HTMLElement {
  const rows: Cell[][] = list(c.rates).map((r) => [
    [text(r.quantity), text(r.component, "")].filter((one) => one !== "").join(" "),
    unitText(text(r.unit, "")),
    number(num(r.before), 4),
    number(num(r.after), 4),
    number(num(r.uncertainty), 2),
    number(num(r.residual), 3),
    number(num(r.window), 3),
  ]);
  return table(
    "Measured rates at the contact",
    [
      { head: "Rate" },
      { head: "Unit" },
      { head: "Before", numeric: true },
      { head: "After", numeric: true },
      { head: "Uncertainty of the change", numeric: true },
      { head: "Residual, in uncertainties", numeric: true },
      { head: "Window", unit: "s", numeric: true },
    ],
    rows,
  );
}

// The value and the band of two standard uncertainties.
function curves(momentum: MomentumCurve[]): HTMLElement[] {
  const pictures = momentum.flatMap((curve, i) => {
    const time = doubles(curve.time);
    if (time.length < 2) return [];
    return curve.components.map((one, k) => {
      const value = doubles(one.value);
      const deviation = doubles(one.deviation);
      const line = (label: string, role: string, values: Float64Array, width: number): SvgLine => ({
        label,
        color: knownRole(role, "light") ?? "#000000",
        dash: [],
        width,
        time,
        values,
      });
      const lines = [
        line("+2 u", "arm 1", value.map((x, n) => x + 2 * deviation[n]), 0.6),
        line("−2 u", "arm 1", value.map((x, n) => x - 2 * deviation[n]), 0.6),
        line("measured", "arm 0", value, 1.2),
      ];
      const svg = svgPlot({
        id: `momentum-${i}-${k}`,
        title: `${curve.body}: ${one.name}`,
        xTitle: "time of the run [s]",
        yTitle: `[${unitText(one.unit)}]`,
        window: { min: time[0], max: time[time.length - 1] },
        log: false,
        lines,
        phases: [],
        width: 760,
        height: 220,
      });
      const url = URL.createObjectURL(new Blob([svg], { type: "image/svg+xml" }));
      return element("figure", { class: "log-plot" }, element("img", { src: url, alt: `${curve.body}: ${one.name}` }));
    });
  });
  if (pictures.length > 0) return pictures;
  return [element("p", {}, "The log does not determine a momentum; impulses.json lists what would.")];
}
