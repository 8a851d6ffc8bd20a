// The section "What if": values of the scenario to change, and the variant that the engine computes from them.
import "./whatif.css";
import { element } from "../dom";
import { list } from "../page/read";
import { absent } from "../page/table";
import { decodedRun, type Run } from "../run";
import { combobox } from "./combobox";
import type { Override, VariantEngine, VariantRequest, VariantResult } from "./engine_interface";
import { Cancelled, EngineQueue, Latest } from "./engine_queue";
import { type Field, fieldOf } from "./fields";
import { type Group, overridesOf, type Value } from "./groups";
import { KeptVariants, sharing } from "./kept";
import { mapPanel } from "./map_panel";
import { quantitiesOf } from "./quantities";
import { besideBase } from "./results";
import { scenarioValues } from "./scenario_file";
import { Settings } from "./settings";
import { type Linked, linkedVariant, settingText, succeeds, type Variant } from "./variants";
import { plainValue, readYaml } from "./yaml_places";
import { flowText } from "./yaml_text";

export interface WhatIf {
  base: Run;
  engine: VariantEngine;
  title: string;
  show: (variant: Run | null) => void; // in replay and plots
}

const kPause = 60; // after a change, before its variant is computed [ms]

export function whatIfSection(given: WhatIf): HTMLElement[] {
  const host = element("div", { class: "wi" }, element("p", { class: "hint" }, "The values of the scenario are being read."));
  given.engine
    .paths()
    .then((paths) => new Panel(host, given, new Settings(paths, names(given.base), scenarioValues(given.base.data.source))))
    .catch((error: unknown) => host.replaceChildren(absent(`Variants cannot be computed: ${error instanceof Error ? error.message : String(error)}`)));
  return [host];
}

function names(base: Run): string[] {
  const scene = base.scene;
  return [...list(scene?.bodies), ...list(scene?.end_effectors), ...list(scene?.grasp_points)].map((one) => one.name);
}

class Panel {
  private readonly groups: Group[];
  private readonly fields: Field[] = [];
  private readonly values = new Map<string, Value>();
  private others: Override[] = []; // set by path
  private plan: VariantRequest["plan"] = "again";
  private name = "variant";
  private variant: Variant | null = null;
  private readonly queue: EngineQueue;
  private readonly latest: Latest<Linked, VariantResult>;
  private readonly kept: KeptVariants;
  // ---- Elements ----
  private readonly status = element("p", { class: "wi-status", role: "status" });
  private readonly errors = element("ul", { class: "wi-errors", role: "alert" });
  private readonly progress = element("progress", { max: "1", "aria-label": "Progress of the variant" });
  private readonly cancel = button("Cancel", () => this.stop());
  private readonly reset = button("Back to the base case", () => this.toBase());
  private readonly otherList = element("ul", { class: "wi-others", "aria-label": "Values set by path" });
  private readonly results = element("div", { class: "wi-results" });
  private readonly keepBar = element("div", { class: "wi-bar" });

  constructor(
    host: HTMLElement,
    private readonly given: WhatIf,
    private readonly settings: Settings,
  ) {
    this.queue = new EngineQueue(given.engine);
    this.latest = new Latest((one) => this.compute(one), (one, result) => this.computed(one, result), kPause);
    this.kept = new KeptVariants(given.base, settings, given.title, { show: (variant) => this.open(variant), say: (message) => this.say(message) });
    this.groups = quantitiesOf(settings, given.base);
    host.replaceChildren(
      element("p", { class: "lead" }, "Change values: this page simulates the variant and shows it beside the base case. Nothing leaves the page."),
      element("div", { class: "wi-groups" }, ...this.fieldsets()),
      this.otherValues(),
      this.planChoice(),
      element("div", { class: "wi-bar" }, this.progress, this.cancel, this.reset, this.status),
      this.errors,
      this.keepBar,
      this.results,
      this.kept.root,
      ...this.maps(),
    );
    this.idle();
    this.followLinks();
  }

  // ---- Construction ----

  private fieldsets(): HTMLElement[] {
    const titles = [...new Set(this.groups.map((group) => group.title))];
    return titles.map((title) => {
      const fields = this.groups.filter((group) => group.title === title).flatMap((group) => group.quantities.map((one) => this.field(group, one.key)));
      return element("fieldset", {}, element("legend", {}, title), ...fields.map((field) => field.root));
    });
  }
  private field(group: Group, key: string): Field {
    const quantity = group.quantities.find((one) => one.key === key)!;
    const field = fieldOf(quantity, (value) => {
      if (value === undefined) this.values.delete(key);
      else this.values.set(key, value);
      this.setOthers(this.others.filter((one) => !group.paths.includes(one.path)));
      this.changed();
    });
    this.fields.push(field);
    return field;
  }

  private otherValues(): HTMLElement {
    const value = element("input", { type: "text", "aria-label": "Value", placeholder: "value", spellcheck: "false", autocomplete: "off" });
    const suggestions = () => this.settings.all.map((one) => ({ text: this.settings.named(one.path), detail: [one.value === undefined || one.value === null ? "" : flowText(one.value), one.unit, one.text].filter(Boolean).join(" · ").slice(0, 160) }));
    const path = combobox("Path of a value", suggestions, (text) => {
      const present = this.settings.value(text);
      value.value = present === undefined ? "" : flowText(present);
      value.focus();
      value.select();
    });
    const set = (): void => {
      const wanted = path.input.value.trim();
      if (wanted === "" || value.value.trim() === "") return;
      this.setByPath(wanted, value.value);
      path.input.value = value.value = "";
      path.input.focus();
    };
    value.addEventListener("keydown", (event) => event.key === "Enter" && set());
    const line = element("div", { class: "wi-bar" }, path.root, value, button("Set", set));
    return element("details", { class: "wi-other" }, element("summary", {}, "Any other value by its path"), line, this.otherList);
  }

  private setByPath(path: string, text: string): void {
    try {
      this.place({ path: this.settings.named(path), value: plainValue(readYaml(text)) });
      this.changed();
    } catch (error) {
      this.fail([`${path}: the value is not YAML (${(error as Error).message})`]);
    }
  }

  private planChoice(): HTMLElement {
    const choices: [VariantRequest["plan"], string][] = [
      ["again", "plan the joint motion again"],
      ["keep", "keep the joint motion of the base case"],
    ];
    const labels = choices.map(([plan, text]) => {
      const input = element("input", { type: "radio", name: "whatif-plan", value: plan });
      input.checked = plan === this.plan;
      input.addEventListener("change", () => {
        this.plan = plan;
        if (this.isChanged) this.changed();
      });
      return element("label", {}, input, ` ${text}`);
    });
    const choice = element("fieldset", { class: "wi-plan" }, element("legend", {}, "Approach of the variant"), ...labels);
    choice.hidden = this.settings.value("approach.plan") === undefined;
    return choice;
  }

  private maps(): HTMLElement[] {
    const made = mapPanel({
      groups: this.groups,
      settings: this.settings,
      base: this.given.base,
      title: this.given.title,
      queue: this.queue,
      current: () => ({ values: new Map(this.values), others: [...this.others], plan: this.plan }),
      open: (variant) => this.open(variant),
    });
    return made ? [made] : [];
  }

  // ---- Changes ----

  private get isChanged(): boolean {
    return this.values.size > 0 || this.others.length > 0;
  }
  private changed(): void {
    this.name = "variant";
    this.fail([]);
    if (!this.isChanged) return this.toBase();
    const overrides = [...overridesOf(this.groups, this.values), ...this.others];
    this.latest.request({ name: this.name, request: { overrides, plan: this.plan } });
  }

  // As the value of a field if there is one for it, else by its path.
  private place(one: Override): void {
    const group = this.groups.find(({ paths }) => paths.length === 1 && paths[0] === one.path);
    const read = group?.read?.(one.value) ?? null;
    this.setOthers([...this.others.filter((other) => other.path !== one.path), ...(read ? [] : [one])]);
    if (group) for (const { key } of group.quantities) this.values.delete(key);
    for (const [key, value] of read ?? []) this.values.set(key, value);
    this.showValues();
  }
  private setOthers(others: Override[]): void {
    this.others = others;
    this.otherList.replaceChildren(
      ...others.map((one) => {
        const remove = button("Remove", () => {
          this.setOthers(this.others.filter((other) => other !== one));
          this.changed();
        });
        remove.setAttribute("aria-label", `Remove ${one.path}`);
        return element("li", {}, element("code", {}, settingText(one)), remove, element("p", { class: "wi-error", "data-path": one.path }));
      }),
    );
    const details = this.otherList.closest("details");
    if (details && others.length > 0) details.open = true;
  }
  private showValues(): void {
    for (const field of this.fields) field.show(this.values.get(field.quantity.key));
  }

  private followLinks(): void {
    const follow = (): void => {
      try {
        const linked = linkedVariant(location.hash);
        if (linked) this.open(linked);
      } catch (error) {
        this.fail([(error as Error).message]);
      }
    };
    window.addEventListener("hashchange", follow);
    follow();
  }

  // A variant from a link or a kept one, which is known already.
  private open(linked: Linked & { run?: Run }): void {
    this.values.clear();
    this.setOthers([]);
    for (const one of linked.request.overrides) this.place(one);
    this.showValues();
    this.plan = linked.request.plan;
    for (const input of document.querySelectorAll<HTMLInputElement>('input[name="whatif-plan"]')) input.checked = input.value === this.plan;
    this.fail([]);
    this.latest.drop();
    if (!this.isChanged) return this.toBase();
    if (linked.run) return this.display({ ...linked, run: linked.run });
    this.name = linked.name || "variant";
    this.latest.request({ ...linked, name: this.name });
  }

  // ---- Computing ----

  private compute({ request }: Linked): Promise<VariantResult> {
    this.progress.hidden = this.cancel.hidden = false;
    this.progress.removeAttribute("value");
    this.say("The variant is being computed.");
    return this.queue.run(request, true, (phase, fraction) => {
      this.progress.value = fraction;
      this.say(`The variant is being computed: ${phase}.`);
    });
  }
  private computed({ name, request }: Linked, result: VariantResult | Error): void {
    this.idle();
    if (result instanceof Cancelled) return this.say("Cancelled.");
    if (result instanceof Error) {
      this.say("The variant has no result.");
      return this.fail(result.message.split("\n").filter((line) => line.trim() !== ""));
    }
    if (!this.isChanged) return; // back to the base case during the computation
    this.display({ name, request, run: decodedRun({ ...result.run, label: "", summary: result.summary ?? result.run.summary }) });
  }
  private display(variant: Variant): void {
    this.variant = variant;
    this.given.show(variant.run);
    this.results.replaceChildren(...besideBase(this.given.base, variant));
    this.reset.hidden = false;
    this.fillKeepBar(variant);
    this.say(succeeds(variant.run.summary) ? "The variant captures, and its ledger passes." : "The variant is not a success; its verdicts state why.");
  }
  private fillKeepBar(variant: Variant): void {
    const name = element("input", { type: "text", "aria-label": "Name of this variant", maxlength: "80" });
    name.value = variant.name;
    name.addEventListener("input", () => (variant.name = name.value.trim() || "variant"));
    const keep = button("Keep this variant", () => {
      this.kept.keep(variant);
      this.say(`Kept; ${this.kept.count} in the table below.`);
    });
    const others = sharing(variant, this.given.base, this.settings, this.given.title, (message) => this.say(message)).map(([text, press]) => button(text, press));
    this.keepBar.replaceChildren(name, keep, ...others);
  }

  private stop(): void {
    this.latest.drop();
    this.queue.cancel();
  }
  private toBase(): void {
    this.latest.drop();
    this.values.clear();
    this.setOthers([]);
    this.showValues();
    this.fail([]);
    if (this.variant) this.given.show(null);
    this.variant = null;
    this.results.replaceChildren();
    this.keepBar.replaceChildren();
    this.reset.hidden = true;
    this.say("The base case is shown.");
  }
  private idle(): void {
    this.progress.hidden = this.cancel.hidden = true;
    this.reset.hidden = this.variant === null;
  }

  // ---- Messages ----

  private say(message: string): void {
    this.status.textContent = message;
  }
  // A message is shown beside the field whose value it names, else below the fields.
  private fail(lines: string[]): void {
    const rest = new Set(lines);
    const about = (paths: string[]): string => {
      const spellings = paths.flatMap((path) => this.settings.spellings(path));
      const own = [...rest].filter((line) => spellings.some((path) => mentions(line, path)));
      for (const line of own) rest.delete(line);
      return own.join("\n");
    };
    for (const error of this.otherList.querySelectorAll<HTMLElement>(".wi-error")) error.textContent = about([error.dataset.path!]);
    for (const group of this.groups) {
      const changed = group.quantities.filter((one) => this.values.has(one.key));
      const message = changed.length > 0 ? about(group.paths) : "";
      for (const field of this.fields) if (group.quantities.includes(field.quantity)) field.fail(changed[0] === field.quantity ? message : "");
    }
    this.errors.replaceChildren(...[...rest].map((line) => element("li", {}, line)));
  }
}

// As a whole path: "mass" does not name "mass_ratio".
function mentions(line: string, path: string): boolean {
  for (let at = line.indexOf(path); at >= 0; at = line.indexOf(path, at + 1)) if (!/[\w.[]/.test(line[at - 1] ?? "") && !/[\w-]/.test(line[at + path.length] ?? "")) return true;
  return false;
}

function button(text: string, press: () => void): HTMLButtonElement {
  const made = element("button", { type: "button", class: "chip" }, text);
  made.addEventListener("click", press);
  return made;
}
