// The verdicts: capture, conservation checks, feasibility; and the key numbers.
import { element } from "../dom";
import { number, unitText } from "../format";
import type { Run } from "../run";
import type { ClearanceEvent, GraspOutcome } from "../summary_types";
import { keyFacts, ledgerRows, limitUnit, tightest, type Fact, type LedgerRow } from "./facts";
import { list, num, text, withUnit, words, type Partly, type PartlySummary } from "./read";
import { mark } from "./table";

export function verdict(run: Run): HTMLElement[] {
  const s = run.summary ?? {};
  return [
    element("div", { class: "verdicts" }, captureCard(s), ledgerCard(s), feasibleCard(run), controlCard(s)),
    element("div", { class: "tiles" }, ...tiles(keyFacts(run))),
  ];
}

// The verdicts in short form, for two runs side by side.
export function shortVerdicts(s: PartlySummary): { question: string; tone: Tone; word: string; said: string }[] {
  return [captureAnswer(s), ledgerAnswer(s), feasibleAnswer(s), controlAnswer(s)].map(({ question, tone, word, said }) => ({
    question,
    tone,
    word,
    said,
  }));
}

interface Answer {
  question: string;
  tone: Tone;
  word: string;
  said: string;
}

export type Tone = "good" | "bad" | "warn" | "none";

function card({ question, tone, word, said }: Answer, ...content: (HTMLElement | null)[]): HTMLElement {
  const head = element("div", {}, element("h3", {}, question), element("p", { class: "word" }, mark(tone, word)));
  return element("div", { class: `verdict ${tone}` }, head, element("div", {}, element("p", {}, said), ...content));
}

// ---- Capture ----

function captureAnswer(s: PartlySummary): Answer {
  const question = "Capture";
  if (s.status === "failed")
    return { question, tone: "bad", word: "Run failed", said: text(s.failure, "no reason is given") };
  if (s.status !== undefined && s.status !== "completed")
    return { question, tone: "warn", word: "Not run", said: `status: ${text(s.status)}` };
  if (s.status === undefined && !s.capture)
    return { question, tone: "warn", word: "Not known", said: "The summary has no status." };
  if (!s.capture)
    return {
      question,
      tone: "none",
      word: "Nothing to grasp",
      said: "This run has no grasps, or its summary does not list them.",
    };
  const answer = capturedAnswer(s.capture.captured);
  const captured = answer !== "no";
  // Contacts are not meant to hold.
  const met = list(s.impact?.grasps);
  if (!captured && met.length > 0 && met.every((grasp) => grasp.model === "contact"))
    return { question, tone: "none", word: "Contact, no grasp", said: captureSentence(s) };
  const words = { yes: "Captured", assumed: "Assumed, no envelope", no: "Not captured" };
  const tones: Record<string, Tone> = { yes: isBeyond(s, s.capture.time) ? "warn" : "good", assumed: "warn", no: "bad" };
  return { question, tone: tones[answer], word: words[answer], said: captureSentence(s) };
}

// Summaries of grapnel-summary/1 have true and false.
function capturedAnswer(value: unknown): "yes" | "no" | "assumed" {
  if (value === true || value === "yes") return "yes";
  return value === "assumed" ? "assumed" : "no";
}

// Whether a time is after the first overlap of bodies.
function isBeyond(s: PartlySummary, time: unknown): boolean {
  const until = num(s.feasibility?.valid_until);
  return until !== null && (num(time) ?? 0) > until;
}

function captureCard(s: PartlySummary): HTMLElement {
  const before = s.capture ? captureSentence(s) : "The run ended before the capture was evaluated.";
  return card(captureAnswer(s), s.status === "failed" ? element("p", { class: "small" }, before) : null, graspList(s));
}

export function captureSentence(s: PartlySummary): string {
  const grasps = list(s.capture?.grasps);
  const closed = grasps.filter((grasp) => capturedAnswer(grasp.captured) !== "no");
  const [strongest] = list(s.impact?.grasps)
    .filter((one) => num(one.impulse_magnitude) !== null)
    .sort((a, b) => num(b.impulse_magnitude)! - num(a.impulse_magnitude)!);
  const impulse = strongest
    ? `, impulse up to ${withUnit(num(strongest.impulse_magnitude), "N s")} (${text(strongest.end_effector)})`
    : "";
  return `${closed.length} of ${grasps.length} grasps closed${movedTargets(closed)}${closingTimes(s, closed)}${gapText(closed)}${impulse}.${unjudged(closed)}`;
}

// contact.gap: translate_target moves the target before it is captured.
function movedTargets(closed: Partly<GraspOutcome>[]): string {
  const moved = new Map<string, number>();
  for (const grasp of closed) if ((num(grasp.target_moved) ?? 0) > 0) moved.set(text(grasp.target), num(grasp.target_moved)!);
  const each = [...moved].map(([target, by]) => `${target} by ${withUnit(by, "m", 3)}`);
  return each.length > 0 ? ` by moving ${each.join(" and ")}` : "";
}

function gapText(closed: Partly<GraspOutcome>[]): string {
  const gaps = closed.map((grasp) => num(grasp.distance)).filter((gap) => gap !== null);
  if (gaps.length === 0) return "";
  return `, ${gaps.length > 1 ? "largest gap" : "gap"} ${withUnit(Math.max(...gaps), "m", 3)}`;
}

function unjudged(closed: Partly<GraspOutcome>[]): string {
  const endEffectors = closed.filter((grasp) => grasp.judged === false).map((grasp) => text(grasp.end_effector));
  return endEffectors.length > 0 ? ` No capture envelope is given for ${endEffectors.join(" and ")}: the grasp is assumed to hold.` : "";
}

// Grasps may close one after the other.
function closingTimes(s: PartlySummary, closed: Partly<GraspOutcome>[]): string {
  if (closed.length === 0) return "";
  const times = closed.map((grasp) => num(grasp.time) ?? num(s.capture?.time)).filter((time) => time !== null);
  if (times.length === 0) return "";
  const [first, last] = [Math.min(...times), Math.max(...times)];
  return first === last
    ? ` at ${withUnit(first, "s")}`
    : `, the first at ${withUnit(first, "s")}, the last at ${withUnit(last, "s")}`;
}

function isContact(s: PartlySummary, grasp: Partly<GraspOutcome>): boolean {
  return list(s.impact?.grasps).some((one) => one.end_effector === grasp.end_effector && one.model === "contact");
}

function graspList(s: PartlySummary): HTMLElement | null {
  const grasps = list(s.capture?.grasps);
  if (grasps.length === 0) return null;
  const rows = grasps.map((grasp) => {
    const answer = capturedAnswer(grasp.captured);
    const tone: Tone = answer === "yes" ? "good" : answer === "assumed" ? "warn" : isContact(s, grasp) ? "none" : "bad";
    const released = num(grasp.released) !== null ? `; release at ${withUnit(num(grasp.released), "s")}` : "";
    return element(
      "li",
      {},
      mark(tone, `${text(grasp.end_effector)} → ${text(grasp.target)}`),
      element("span", { class: "reason" }, `${text(grasp.reason, "no reason is given")}${released}`),
    );
  });
  return element("ul", { class: "grasps" }, ...rows);
}

// ---- Conservation ----

function checked(s: PartlySummary): LedgerRow[] {
  return ledgerRows(s).filter((row) => row.kind !== "feasibility" && row.applies);
}

function ledgerAnswer(s: PartlySummary): Answer {
  const question = "Ledger";
  const rows = checked(s);
  if (rows.length === 0)
    return { question, tone: "warn", word: "No ledger", said: "The summary has no conservation checks." };
  const passed = rows.filter((row) => row.pass).length;
  const good = s.ledger?.pass === true && passed === rows.length;
  return {
    question,
    tone: good ? "good" : "bad",
    word: good ? "Passes" : "Fails",
    said: good
      ? `${passed} of ${rows.length} conservation checks within their bounds.`
      : `${rows.length - passed} of ${rows.length} conservation checks are outside their bounds: the result is not valid.`,
  };
}

function ledgerCard(s: PartlySummary): HTMLElement {
  const rows = checked(s);
  const worst = tightest(rows);
  const failing = rows.filter((row) => !row.pass);
  const unit = worst && worst.row.unit !== "1" ? `\u00a0${unitText(worst.row.unit)}` : "";
  return card(
    ledgerAnswer(s),
    failing.length > 0
      ? element(
          "ul",
          { class: "events" },
          ...failing.map((row) =>
            element(
              "li",
              {},
              `${words(row.key)}: ${row.value === null ? "not a number" : `${number(row.value)} > ${withUnit(row.bound, row.unit)}`}${row.advice ? `. Advice: ${row.advice}` : ""}`,
            ),
          ),
        )
      : worst &&
          element(
            "p",
            { class: "small" },
            `Closest to its bound: ${words(worst.row.key)}, ${number(worst.row.value, 3)} of ${number(worst.row.bound, 3)}${unit}.`,
          ),
    rows.length > 0 ? element("p", { class: "more" }, element("a", { href: "#ledger" }, "All checks")) : null,
  );
}

// ---- Feasibility ----

export interface Trouble {
  text: string;
  size: number; // severity, for sorting
}

function feasibleAnswer(s: PartlySummary): Answer {
  const question = "Feasibility";
  const rows = ledgerRows(s).filter((row) => row.kind === "feasibility");
  if (rows.length === 0)
    return { question, tone: "none", word: "Not checked", said: "The summary has no checks of clearance and limits." };
  const answer = feasibleWord(s);
  if (answer === "not checked")
    return { question, tone: rows.some((row) => row.applies) ? "warn" : "none", word: "Not checked", said: notChecked(s, rows) };
  if (answer === "yes")
    return { question, tone: "good", word: "Feasible", said: sentence(s) ?? "Clearance and joint limits are kept." };
  return {
    question,
    tone: "bad",
    word: "Not feasible",
    said: sentence(s) ?? "Clearance or joint limits are violated; the computed motion ignores them.",
  };
}

// Summaries of grapnel-summary/1 have true and false, and true also if a check was not evaluated.
function feasibleWord(s: PartlySummary): string {
  const answer: unknown = s.feasibility?.verdict ?? s.ledger?.feasible;
  if (answer === false) return "no";
  if (answer !== true) return text(answer, "not checked");
  return ledgerRows(s).some((row) => row.kind === "feasibility" && row.applies) ? "yes" : "not checked";
}

// As on the terminal, without the leading verdict word.
function sentence(s: PartlySummary): string | null {
  const all = text(s.feasibility?.sentence, "").replace(/^feasible: (yes|NO|not checked)[,;:]? */, "");
  return all ? `${all.charAt(0).toUpperCase()}${all.slice(1)}.` : null;
}

function notChecked(s: PartlySummary, rows: LedgerRow[]): string {
  const said = sentence(s);
  if (said && list(s.feasibility?.not_checked).length > 0) return said;
  if (s.status === "failed") return "The run ended before clearance and joint limits could be checked.";
  return rows.some((row) => row.applies) ? "Some checks were not evaluated." : "Nothing moves, or there are no shapes and limits to check.";
}

function feasibleCard(run: Run): HTMLElement {
  const s = run.summary ?? {};
  const idle = ledgerRows(s).filter((row) => row.kind === "feasibility" && !row.applies && row.notChecked === "");
  const unchecked = idle.map((row) => words(row.key).replace(/ violation$/, ""));
  const worst = worstOfPhases(s) ?? shortened([...clearanceTroubles(s), ...limitTroubles(run)]);
  return card(
    feasibleAnswer(s),
    worst.length > 0 ? element("ul", { class: "events" }, ...worst.map((one) => element("li", {}, one))) : null,
    unchecked.length > 0 ? element("p", { class: "small" }, `Nothing to check: ${unchecked.join(", ")}.`) : null,
    s.clearance || s.limits
      ? element("p", { class: "more" }, element("a", { href: "#feasibility" }, "All events and limits"))
      : null,
  );
}

// The worst violation of each phase, in the order of phases; null: a summary of an earlier version.
function worstOfPhases(s: PartlySummary): string[] | null {
  if (!s.feasibility) return null;
  return list(s.feasibility.by_phase).map(
    (one) => `Worst in ${words(one.phase)}: ${text(one.what)}, at ${withUnit(num(one.time), "s")}`,
  );
}

function shortened(troubles: Trouble[]): string[] {
  const shown = troubles.slice(0, 3).map((one) => one.text);
  return troubles.length > 3 ? [...shown, `and ${troubles.length - 3} more`] : shown;
}

// One line per pair of bodies, the deepest first.
function clearanceTroubles(s: PartlySummary): Trouble[] {
  const byPair = new Map<string, Partly<ClearanceEvent>>();
  for (const event of list(s.clearance?.events)) {
    const pair = list(event.bodies).join(" – ");
    const known = byPair.get(pair);
    if (!known || num(event.minimum_distance)! < num(known.minimum_distance)!) byPair.set(pair, event);
  }
  return [...byPair]
    .map(([pair, event]) => {
      const distance = num(event.minimum_distance) ?? 0;
      const how =
        distance < 0
          ? `overlap by ${withUnit(-distance, "m", 3)}`
          : `${withUnit(distance, "m", 3)} apart, ${withUnit(num(event.required), "m", 3)} required`;
      return { text: `${pair}: ${how} at ${withUnit(num(event.minimum_time), "s")}`, size: -distance };
    })
    .sort((a, b) => b.size - a.size);
}

function limitTroubles(run: Run): Trouble[] {
  return list(run.summary?.limits?.events)
    .filter((event) => event.kind !== "effort_saturated")
    .map((event) => ({
      text: `${text(event.joint)}: ${words(event.kind)} ${number(num(event.worst_value))} beyond ${withUnit(num(event.limit), limitUnit(run, event))} at ${withUnit(num(event.worst_time), "s")}`,
      size: Math.abs((num(event.worst_value) ?? 0) - (num(event.limit) ?? 0)),
    }))
    .sort((a, b) => b.size - a.size);
}

// ---- Loads and control ----

// Findings other than capture, conservation and limits, the worst first.
interface Finding {
  tone: Tone;
  word: string;
  text: string;
}

function findings(s: PartlySummary): Finding[] {
  const all: Finding[] = [];
  const exceeded = new Set(list(s.loads).filter((load) => (num(load.margin) ?? 0) < -1e-9).map((load) => `${text(load.of)} (${text(load.quantity)})`));
  const unstable = list(s.stability).filter((one) => one.verdict === "unstable");
  for (const one of unstable)
    all.push({ tone: "bad", word: "Unstable", text: `Control in ${words(one.phase)}: ${text(one.of)} ${(num(one.period) ?? 0) > 0 ? `oscillates with a period of ${withUnit(num(one.period), "s")}` : "grows without oscillation"}, from ${number(num(one.amplitude_before))} to ${number(num(one.amplitude_after))}; ${text(one.reason)}` });
  if (exceeded.size > 0) all.push({ tone: "bad", word: "Ratings exceeded", text: `Ratings exceeded: ${[...exceeded].slice(0, 4).join(", ")}${exceeded.size > 4 ? ` and ${exceeded.size - 4} more` : ""}` });
  const rest = s.post_impact?.at_rest;
  if (rest && rest.at_rest === false)
    all.push({ tone: "bad", word: "Not at rest", text: `Not at rest at the end: base ${withUnit(num(rest.angular_velocity), "rad/s")} of ${withUnit(num(rest.angular_velocity_limit), "rad/s")}${rest.joint ? `, ${rest.joint} ${number(num(rest.joint_rate))} of ${number(num(rest.joint_rate_limit))}` : ""}` });
  for (const one of list(s.saturation))
    all.push({ tone: "warn", word: "Saturated", text: `Saturated: ${words(one.actuator)} ${text(one.name)}, ${words(one.quantity)}, for ${withUnit(num(one.duration), "s", 3)} (${number(100 * (num(one.share) ?? 0), 3)} %), first at ${withUnit(num(one.first_time), "s")}${one.at_end ? ", and at the end" : ""}` });
  return all;
}

function controlAnswer(s: PartlySummary): Answer {
  const question = "Loads and control";
  const [worst] = findings(s);
  if (worst) return { question, tone: worst.tone, word: worst.word, said: `${worst.text}.` };
  const rated = list(s.loads).filter((load) => num(load.margin) !== null).length > 0;
  const last = list(s.stability).at(-1);
  const rest = s.post_impact?.at_rest;
  const said = [
    rated ? "No rating is exceeded and no drive saturates." : "",
    last ? (last.verdict === "stable" ? `Control is stable in ${words(last.phase)}.` : `Stability is not evaluated in ${words(last.phase)}: ${text(last.reason)}.`) : "",
    rest ? `At rest from ${withUnit(num(rest.time), "s")} on.` : "",
  ].filter((one) => one !== "");
  if (said.length === 0) return { question, tone: "none", word: "Not evaluated", said: "No ratings and no feedback control." };
  return last && last.verdict !== "stable" && !rest
    ? { question, tone: "none", word: rated ? "Ratings kept" : "Not evaluated", said: said.join(" ") }
    : { question, tone: "good", word: rest ? "At rest" : last ? "Stable" : "Ratings kept", said: said.join(" ") };
}

function controlCard(s: PartlySummary): HTMLElement {
  const more = findings(s).slice(1);
  const shown = more.slice(0, 3).map((one) => one.text);
  const items = more.length > 3 ? [...shown, `and ${more.length - 3} more`] : shown;
  return card(controlAnswer(s), items.length > 0 ? element("ul", { class: "events" }, ...items.map((one) => element("li", {}, one))) : null);
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
  const peak = force?.key.startsWith("peak") ?? false; // has more to say, below
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
