// The verdicts of summary.json, which the program words; and the key numbers.
import { element } from "../dom";
import { number, unitText } from "../format";
import type { Run } from "../run";
import type { Answer } from "../summary_types";
import { envelopeBars, envelopeShares } from "./envelope_bars";
import { goalFirst, keyFacts, type Fact } from "./facts";
import { list, text, type Partly } from "./read";
import { absent, mark } from "./table";

export function verdict(run: Run): HTMLElement[] {
  const s = run.summary ?? {};
  const answers = goalFirst(list(s.verdicts));
  return [
    answers.length > 0 ? element("div", { class: "verdicts" }, ...answers.map((answer) => card(answer, run))) : absent(kNoVerdicts),
    element("div", { class: "tiles" }, ...tiles(keyFacts(run))),
  ];
}

export const kNoVerdicts = "The verdicts are not in this summary: it is damaged or of an earlier version.";

// Sections with the details of an answer.
const kDetails: Record<string, { id: string; title: string }> = {
  Ledger: { id: "ledger", title: "All checks" },
  Feasibility: { id: "feasibility", title: "All events and limits" },
};

function card(answer: Partly<Answer>, run: Run): HTMLElement {
  const s = run.summary ?? {};
  const shares = answer.question === "Capture" ? envelopeShares(run) : [];
  const more = s.ledger ? kDetails[text(answer.question)] : undefined;
  const remarks = list(answer.remarks).map((one) =>
    element("li", {}, mark(toneOf(one), text(one.of, "")), element("span", { class: "reason" }, text(one.text))),
  );
  return element(
    "div",
    { class: `verdict ${toneOf(answer)}` },
    element("div", {}, element("h3", {}, text(answer.question)), element("p", { class: "word" }, answerMark(answer))),
    element(
      "div",
      {},
      element("p", {}, text(answer.sentence)),
      shares.length > 0 ? envelopeBars(shares) : remarks.length > 0 ? element("ul", { class: "grasps" }, ...remarks) : null,
      more ? element("p", { class: "more" }, element("a", { href: `#${more.id}` }, more.title)) : null,
    ),
  );
}

export function answerMark(answer: Partly<Answer>): HTMLElement {
  return mark(toneOf(answer), text(answer.word, "not in this summary"));
}

function toneOf({ tone }: { tone?: string }): "good" | "bad" | "warn" | "none" {
  return tone === "good" || tone === "bad" || tone === "warn" ? tone : "none";
}

// ---- Numbers ----

export function factText(fact: Fact): string {
  return number(fact.value, fact.percent ? 3 : 4);
}

// A force is shown in the tile of its impulse: the peak if there is one.
function tiles(facts: Fact[]): HTMLElement[] {
  const byKey = new Map(facts.map((fact) => [fact.key, fact]));
  return facts
    .filter((fact) => !/^(mean|peak) force /.test(fact.key))
    .map((fact) => {
      const grasp = fact.key.replace(/^impulse /, "");
      return tile(
        fact,
        grasp === fact.key ? undefined : (byKey.get(`peak force ${grasp}`) ?? byKey.get(`mean force ${grasp}`)),
      );
    });
}

function tile(fact: Fact, force?: Fact): HTMLElement {
  const peak = force?.key.startsWith("peak") ?? false; // its tile has a note
  const sign = fact.tone ? mark(fact.tone, fact.word ?? "") : null;
  const details = [peak ? force!.detail : "", fact.detail].filter(Boolean).join("; ");
  return element(
    "div",
    { class: `tile ${fact.tone ?? ""}` },
    element("p", { class: "name" }, fact.name),
    valueLine(fact, "value"),
    force &&
      element(
        "p",
        { class: "second" },
        `${force.name.split(",")[0].toLowerCase()} `,
        valueLine(force, ""),
        peak ? null : element("span", { class: "detail" }, ` ${force.detail}`),
      ),
    element("p", { class: "detail" }, sign, sign && " ", details),
  );
}

function valueLine(fact: Fact, name: string): HTMLElement {
  const line = element(name ? "p" : "strong", name ? { class: name } : {}, factText(fact));
  if (fact.value !== null) line.append(element("span", { class: "unit" }, ` ${unitText(fact.unit)}`));
  return line;
}
