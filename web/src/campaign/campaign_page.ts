// The page of a campaign: probability of success, decisive criteria and inputs, and cases of interest.
import "../study/study.css";
import "./campaign.css";
import type { CampaignData, ReportData } from "../data";
import { element } from "../dom";
import { number, pasted, withUnit } from "../format";
import { assemble } from "../study/assemble";
import { breakable, counted, plural } from "../study/describe";
import { filterBar } from "../study/filter_bar";
import { header, text, type Tile } from "../study/header";
import { ParallelCoordinates } from "../study/parallel";
import { pointCard } from "../study/point_card";
import { PointTable } from "../study/point_table";
import { StudyState } from "../study/state";
import { DistributionChart } from "./distribution";
import { SuccessCurve } from "./success_curve";
import { SuccessMapChart } from "./success_map_chart";
import { InfluenceChart } from "./influence";
import { InputsChart } from "./inputs_chart";
import { intervalCard } from "./interval_chart";
import type { CampaignModel, SuccessMap, Proportion } from "./model";
import { campaignModel } from "./read";
import { kSuccessLabels, type Sample, sampleOf } from "./sample";
import { SpreadChart } from "./spread_chart";
import { failuresCard, savedLink, worstCard } from "./worst";
import { interval, kCaptureProbability, percent, probability, samplingName, share, successName } from "./words";

export function buildCampaignPage(host: HTMLElement, data: ReportData): void {
  const campaign = data.campaign;
  if (!campaign) throw new Error("the report contains no campaign");
  const model = campaignModel(campaign);
  const sample = sampleOf(campaign);
  const state = new StudyState(sample.table);
  const name = model.name || data.title;
  const card = pointCard({ state, command: (k) => commandFor(campaign, sample.cases[k]), remark: (k) => remark(sample, k), more: (k) => savedLink(model, sample.cases[k]), steps: false });
  state.select(firstCase(model, sample));
  const many = sample.complete ? "" : `${plural(model.rows, "case")}, an even sample with failed and worst ones added`;
  const later: [string, () => HTMLElement | null][] = [
    ["influence", () => InfluenceChart.of(model, name)?.card.root ?? null],
    ["inputs", () => InputsChart.of(model, name)?.card.root ?? null],
    ["worst", () => worstCard(model, sample, state, name)],
    ["failures", () => failuresCard(model, name)],
    ["spread", () => SpreadChart.of(state, sample, model, name)?.card.root ?? null],
    ["parallel", () => (sample.table.size > 0 ? new ParallelCoordinates(state, name, null, sample.successField).card.root : null)],
  ];
  assemble(host, {
    state,
    head: campaignHeader(data, campaign, model),
    first: [
      ...(model.successMap ? [() => successMapOrNote(model, name, state)] : []),
      () => intervalCard(model, name),
      () => DistributionChart.of(model, name)?.card.root ?? emptyCard("No column has numbers."),
    ],
    filter: filterBar(state, many),
    later,
    table: () => new PointTable(state, name).root,
    card,
    empty: "",
  });
  exposeModel(model, sample);
}

export function commandFor(campaign: CampaignData, index: number): string {
  return pasted(text(campaign.command).split("{K}").join(String(index)));
}

function successMapOrNote(model: CampaignModel, name: string, state: StudyState): HTMLElement {
  const card = (SuccessMapChart.of(model, name, state) ?? SuccessCurve.of(model, name, state))?.card.root;
  return card ?? emptyCard("The design's axes have no values to draw over.");
}

function emptyCard(said: string): HTMLElement {
  return element("section", { class: "card st-card" }, element("p", { class: "st-note" }, said));
}

function remark(sample: Sample, row: number): string {
  const said = kSuccessLabels[sample.success[row]];
  return `${said[0].toUpperCase()}${said.slice(1)}.${sample.drawn[row] ? "" : " Not of the even sample: it is here because it failed, or is among the worst."}`;
}

// The worst case of the first list, else the first without success, else the first.
function firstCase(model: CampaignModel, sample: Sample): number | null {
  const worst = model.worst[0]?.cases[0]?.index;
  const row = sample.cases.indexOf(worst ?? NaN);
  if (row >= 0) return row;
  const failed = sample.success.indexOf(0);
  return failed >= 0 ? failed : sample.table.size > 0 ? 0 : null;
}

function campaignHeader(data: ReportData, campaign: CampaignData, model: CampaignModel): HTMLElement {
  const p = model.success;
  const lost = model.counts.filter((c) => c.status !== "ok" && c.count > 0);
  const partial = model.rows < model.total;
  const [verdict, said] = model.successMap ? successMapVerdict(model, model.successMap) : verdictOf(model, p);
  const head = header({
    kind: model.successMap ? "Success map" : "Campaign",
    title: data.title,
    verdict,
    tone: "none",
    said,
    tiles: tiles(model),
    facts: [
      `${plural(model.rows, "case")}`,
      model.sampling && `${samplingName(model.sampling)} sampling`,
      text(campaign.statistics?.campaign?.seed) && `seed ${text(campaign.statistics?.campaign?.seed)}`,
      `Grapnel ${text(campaign.statistics?.version) || data.version}`,
      text(campaign.statistics?.campaign?.sha256) && `campaign ${text(campaign.statistics?.campaign?.sha256).slice(0, 12)}`,
    ],
    about: model.settings,
    text: model.text,
    more: inputsList(model),
  });
  const notes = [
    ...(partial ? [`${counted(model.rows)} of ${plural(model.total, "case")} are complete: the campaign is not finished, or was extended. Rerun the command to continue.`] : []),
    ...(lost.length > 0 ? [`No result from ${lost.map((c) => `${plural(c.count, "case")} (${c.status})`).join(" and ")}: they do not count as a success. Their reasons are below.`] : []),
    ...model.warnings.map((w) => `${w[0].toUpperCase()}${w.slice(1)}.`),
    ...(campaign.notes ?? []),
  ];
  // Names are longer than numbers.
  for (const value of head.querySelectorAll(".tile .value")) value.classList.toggle("cp-name", /\p{L}{3}/u.test(value.firstChild?.textContent ?? ""));
  if (model.description) head.querySelector(".facts")?.before(element("p", { class: "cp-description" }, model.description));
  if (notes.length > 0) head.querySelector(".st-tiles")?.before(element("div", { class: "notices" }, element("ul", {}, ...notes.map((n) => element("li", {}, n)))));
  return head;
}

function verdictOf(model: CampaignModel, p: Proportion): [string, string] {
  if (p.trials === 0) return ["No cases yet", ""];
  const assumed = model.assumed > 0 ? (model.assumed === p.successes ? ", assumed without an envelope" : `, ${counted(model.assumed)} of them assumed without an envelope`) : "";
  return [`${successName(model)} ${probability(p.estimate)}${model.assumed > 0 ? " (assumed)" : ""}`, `${percent(model.confidence)} interval ${interval(p)}; ${share(p)} cases meet ${criteriaInWords(model)}${assumed}.${capturesInWords(model)}`];
}

// If success requires more than a capture, the share of cases with a capture.
function capturesInWords(model: CampaignModel): string {
  const share = model.columns.find((c) => c.name === "captured")?.mean;
  if (share === undefined || !Number.isFinite(share) || successName(model) === kCaptureProbability) return "";
  return ` All grasps close in ${percent(share)} of the cases with a result.`;
}

// A single probability over all points of a design would be meaningless.
function successMapVerdict(model: CampaignModel, e: SuccessMap): [string, string] {
  const sure = (level: number): number => e.points.filter((p) => p.trials > 0 && p.lower >= level).length;
  const reach = [0.99, 0.9, 0.5].map((level) => `${counted(sure(level))} at ${level} or more`);
  const open = e.points.filter((p) => p.trials === 0).length;
  return [`${counted(sure(0.9))} of ${plural(e.points.length, "point")} ${successName(model) === kCaptureProbability ? "capture" : "succeed"} with probability 0.9 or more`,
    `By the lower end of the ${percent(model.confidence)} interval: ${reach.join(", ")}.${open > 0 ? ` ${plural(open, "point")} without cases.` : ""}`];
}

function criteriaInWords(model: CampaignModel): string {
  if (model.criteria.length === 0) return "no criteria: all completed cases";
  return model.criteria.length === 1 ? `“${model.criteria[0].name}”` : `all ${model.criteria.length} criteria`;
}

function tiles(model: CampaignModel): Tile[] {
  const made: Tile[] = [{ name: "cases", value: counted(model.rows), detail: model.successMap ? `${plural(model.successMap.points.length, "point")} of the design` : `${plural(model.inputs.length, "drawn input")}` }];
  const without = model.success.trials - model.success.successes;
  made.push({ name: "without success", value: counted(without), detail: lostInWords(model) });
  if (model.successMap) return made;
  const strict = [...model.criteria].filter((c) => Number.isFinite(c.onlyThis)).sort((a, b) => b.onlyThis - a.onlyThis)[0];
  if (strict && model.criteria.length > 1 && strict.onlyThis > 0)
    made.push({ name: "most restrictive", value: breakable(strict.name), detail: `${plural(strict.onlyThis, "case")} in which no other criterion fails` });
  const success = model.sensitivities.find((s) => s.output === "success");
  const known = (success && success.groups.length > 0 ? success.groups : (success?.influences ?? [])).filter((i) => Number.isFinite(i.firstOrder));
  const first = known.length > 0 ? known.reduce((best, i) => (i.firstOrder > best.firstOrder ? i : best)) : undefined;
  if (first && first.firstOrder > 2 * (first.error || 0)) made.push({ name: "most influential for success", value: breakable(first.input), detail: `first-order index ${number(first.firstOrder, 2)} ± ${number(first.error, 1)}` });
  const worst = model.worst[0];
  if (worst?.cases[0]) made.push({ name: `${worst.direction} of all`, value: number(worst.cases[0].value), unit: worst.unit, detail: `${breakable(worst.by)}, case ${worst.cases[0].index}` });
  return made;
}

function lostInWords(model: CampaignModel): string {
  const lost = model.counts.filter((c) => c.status !== "ok" && c.count > 0).map((c) => `${counted(c.count)} ${c.status}`);
  return lost.length > 0 ? lost.join(", ") : "all completed";
}

function inputsList(model: CampaignModel): HTMLElement | null {
  if (model.inputs.length === 0) return null;
  const rows = model.inputs.map((d) => element("tr", {}, element("th", { scope: "row" }, breakable(d.name)), element("td", { class: "st-left" }, d.description), element("td", {}, `${number(d.mean)} ± ${withUnit(d.deviation, d.unit)}`)));
  const head = element("tr", {}, ...["drawn", "distribution", "mean ± standard deviation"].map((t) => element("th", { scope: "col" }, t)));
  return element("div", { class: "st-scroll" }, element("table", { class: "st-grid" }, element("thead", {}, head), element("tbody", {}, ...rows)));
}

// For tests and for the browser's console.
function exposeModel(model: CampaignModel, sample: Sample): void {
  const page = window as unknown as { __grapnel?: Record<string, unknown> };
  page.__grapnel = { ...page.__grapnel, campaign: { model, sampled: sample.table.size, cases: Array.from(sample.cases) } };
}
