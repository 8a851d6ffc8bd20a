// The page of a comparison with a log of measurements: verdicts, overlays and residuals.
import { knownRole } from "./colors";
import type { ComparedQuantity } from "./comparison_types";
import type { ComparedCurve, Partly, ReportData } from "./data";
import { element } from "./dom";
import { number, unitText } from "./format";
import { list, num, text, withUnit } from "./page/read";
import { absent, mark, pairs, table, type Cell } from "./page/table";
import { themeToggle } from "./page/theme";
import { gapped } from "./plots/gaps";
import { svgPlot, type SvgLine } from "./plots/svg";
import { bytesOf } from "./run";

type Quantity = Partly<ComparedQuantity>;

export function buildLogPage(host: HTMLElement, data: ReportData): void {
  const comparison = data.log?.comparison;
  if (!comparison) throw new Error("the report contains no comparison");
  const quantities = list(comparison.quantities);
  host.replaceChildren(
    element(
      "header",
      { class: "page-head" },
      element(
        "div",
        { class: "brand" },
        element("span", { class: "kind" }, "Grapnel · Comparison with a measurement"),
        themeToggle(),
      ),
      element("h1", {}, data.title || "untitled"),
    ),
    ...warnings(list(comparison.warnings)),
    section("verdict", "Verdict", summary(data), verdicts(quantities)),
    ...quantities.map((one, i) =>
      section(`quantity-${i}`, text(one.name), reason(one), components(one), ...plots(one, i, list(data.log?.curves))),
    ),
    element(
      "footer",
      { class: "page-foot" },
      `Made by Grapnel ${data.version || "of unknown version"}; this page loads nothing. `,
      "Residuals are measured minus simulated, in SI units.",
    ),
  );
  (window as unknown as { __grapnel: object }).__grapnel = { comparison }; // for tests and for the browser's console
}

export function section(id: string, title: string, ...content: (Node | null)[]): HTMLElement {
  return element(
    "section",
    { id, "aria-labelledby": `${id}-title`, class: "part" },
    element("h2", { id: `${id}-title` }, title),
    ...content,
  );
}

export function warnings(texts: (string | undefined)[]): HTMLElement[] {
  if (texts.length === 0) return [];
  const items = texts.map((one) => element("li", {}, mark("warn", text(one))));
  return [element("section", { class: "notices", "aria-label": "Warnings" }, element("ul", {}, ...items))];
}

function verdictMark(verdict: unknown): HTMLElement {
  if (verdict === "yes") return mark("good", "agrees");
  return verdict === "no" ? mark("bad", "disagrees") : mark("none", "not checked");
}

function summary(data: ReportData): HTMLElement {
  const c = data.log?.comparison;
  const clock = c?.clock;
  const found = clock?.found
    ? `found, standard uncertainty ${withUnit(num(clock.uncertainty), "s", 3)}`
    : "as stated";
  const ppm = (value: unknown, digits: number) => withUnit(1e6 * (num(value) ?? NaN), "ppm", digits);
  const drift = clock?.drift_found
    ? `${ppm(clock.drift, 4)}, found, standard uncertainty ${ppm(clock.drift_uncertainty, 3)}`
    : num(clock?.drift)
      ? `${ppm(clock?.drift, 4)}, as stated`
      : "none";
  return pairs([
    ["result", verdictMark(c?.agrees)],
    ["checked", `${number(num(c?.checked))} of ${list(c?.quantities).length} quantities`],
    ["run", text(c?.run?.scenario)],
    ["log", text(c?.log?.file)],
    ["run time minus log time", `${withUnit(num(clock?.offset), "s", 7)}, ${found}`],
    ["drift", drift],
  ]);
}

function verdicts(quantities: Quantity[]): HTMLElement {
  const rows: Cell[][] = quantities.map((q) => [
    text(q.name),
    verdictMark(q.agrees),
    number(num(q.compared)),
    withUnit(num(q.rms), text(q.unit, ""), 3),
    withUnit(num(q.peak), text(q.unit, ""), 3),
    number(num(q.peak_time)),
    num(q.lag) === null ? null : number(Math.round(1e7 * num(q.lag)!) / 1e4, 3),
    num(q.chi_square) === null ? null : number(num(q.chi_square), 3),
  ]);
  return table(
    "Residuals by quantity",
    [
      { head: "Quantity" },
      { head: "Verdict" },
      { head: "Samples", numeric: true },
      { head: "RMS", numeric: true },
      { head: "Peak", numeric: true },
      { head: "Time of the peak", unit: "s", numeric: true },
      { head: "Lag", unit: "ms", numeric: true },
      { head: "Chi-square", numeric: true },
    ],
    rows,
  );
}

function reason(q: Quantity): HTMLElement {
  return element("p", {}, verdictMark(q.agrees), ` ${text(q.reason, "")}`);
}

function components(q: Quantity): HTMLElement {
  const unit = text(q.unit, "");
  return table(
    `Components of ${text(q.name)}`,
    [
      { head: "Component" },
      { head: "Bias", unit, numeric: true },
      { head: "RMS", unit, numeric: true },
      { head: "Peak", unit, numeric: true },
      { head: "Time of the peak", unit: "s", numeric: true },
    ],
    list(q.components).map((c) => [
      text(c.name, text(q.name)),
      number(num(c.bias), 3),
      number(num(c.rms), 3),
      number(num(c.peak), 3),
      number(num(c.peak_time)),
    ]),
  );
}

export function doubles(base64: string): Float64Array {
  const bytes = bytesOf(base64);
  return new Float64Array(bytes.buffer, bytes.byteOffset, bytes.byteLength / 8);
}

function plots(q: Quantity, index: number, curves: ComparedCurve[]): HTMLElement[] {
  return curves
    .filter((curve) => curve.quantity === index)
    .flatMap((curve, k) => {
      const samples = doubles(curve.time);
      if (samples.length < 2) return [absent("There are too few samples for a plot.")];
      const { time, values: withGaps } = gapped(samples, list(curve.breaks));
      const several = list(q.components).length > 1;
      const name = several ? `${text(q.name)} ${curve.component}` : text(q.name);
      const line = (label: string, role: string, values: Float64Array): SvgLine => ({
        label,
        color: knownRole(role, "light") ?? "#000000",
        dash: [],
        width: 1.2,
        time,
        values,
      });
      const id = `${index}-${k}`;
      const unit = unitText(text(q.unit, ""));
      const pictures: HTMLElement[] = [];
      if (curve.measured !== "") {
        const measured = line("measured", "arm 1", withGaps(doubles(curve.measured)));
        const lines = [measured, line("simulated", "arm 0", withGaps(doubles(curve.simulated)))];
        pictures.push(picture(`overlay-${id}`, `${name}: measured and simulated`, unit, time, lines));
      }
      const outliers = new Set(curve.outliers); // they would set the scale
      const residual = withGaps(doubles(curve.residual)).map((value, i) => (outliers.has(time[i]) ? NaN : value));
      pictures.push(picture(`residual-${id}`, `${name}: residual`, unit, time, [line("residual", "system", residual)]));
      if (curve.samples < curve.of) {
        const note = `${curve.samples} of ${curve.of} samples are shown; all are in comparison.csv.`;
        pictures.push(element("p", { class: "lead" }, note));
      }
      return pictures;
    });
}

function picture(id: string, title: string, unit: string, time: Float64Array, lines: SvgLine[]): HTMLElement {
  const svg = svgPlot({
    id,
    title,
    xTitle: "time of the run [s]",
    yTitle: unit ? `[${unit}]` : "",
    window: { min: time[0], max: time[time.length - 1] },
    log: false,
    lines,
    phases: [],
    width: 760,
    height: 260,
  });
  const url = URL.createObjectURL(new Blob([svg], { type: "image/svg+xml" }));
  return element("figure", { class: "log-plot" }, element("img", { src: url, alt: title }));
}
