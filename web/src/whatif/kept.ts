// The kept variants: names, key numbers and downloads in a table.
import { download, element } from "../dom";
import { number, unitText } from "../format";
import { keyFacts } from "../page/facts";
import { table, type Cell, type Column } from "../page/table";
import type { Run } from "../run";
import { scenarioWith } from "./scenario_file";
import type { Override } from "./engine_interface";
import { successMark } from "./results";
import { keptApproach, commandText, fragmentOf, settingText, type Variant } from "./variants";
import type { Settings } from "./settings";

interface Actions {
  show(variant: Variant): void;
  say(message: string): void;
}

export class KeptVariants {
  readonly root = element("div", { class: "wi-kept" });
  private readonly kept: Variant[] = [];

  constructor(
    private readonly base: Run,
    private readonly settings: Settings,
    private readonly title: string,
    private readonly actions: Actions,
  ) {}

  get count(): number {
    return this.kept.length;
  }
  keep(variant: Variant): void {
    this.kept.push({ ...variant, name: this.freeName(variant.name) });
    this.draw();
  }

  private freeName(name: string): string {
    const taken = (wanted: string): boolean => this.kept.some((one) => one.name === wanted);
    if (!taken(name)) return name;
    let k = 2;
    while (taken(`${name} ${k}`)) ++k;
    return `${name} ${k}`;
  }

  private draw(): void {
    if (this.kept.length === 0) return this.root.replaceChildren();
    const facts = keyFacts(this.base);
    const columns: Column[] = [
      { head: "Variant" },
      { head: "Actions" },
      { head: "Changed values" },
      { head: "Result" },
      ...facts.map((fact) => ({ head: fact.name, unit: unitText(fact.unit), numeric: true })),
    ];
    const numbers = (run: Run): Cell[] => {
      const own = keyFacts(run);
      return facts.map((fact) => number(own.find((one) => one.key === fact.key)?.value));
    };
    const base: Cell[] = ["base case", "–", "–", successMark(this.base), ...numbers(this.base)];
    const rows = this.kept.map((one): Cell[] => [this.nameField(one), this.buttons(one), this.changes(one), successMark(one.run), ...numbers(one.run)]);
    this.root.replaceChildren(table("Kept variants", columns, [base, ...rows]));
  }

  private nameField(variant: Variant): HTMLElement {
    const input = element("input", { type: "text", "aria-label": "Name of the variant", value: variant.name, maxlength: "80" });
    input.addEventListener("change", () => (variant.name = input.value.trim() || variant.name));
    return input;
  }

  private changes({ request }: Variant): HTMLElement {
    const lines = request.overrides.map((one) => element("li", {}, element("code", {}, settingText(one))));
    const plan = request.plan === "keep" ? element("li", {}, "joint motion of the base case") : null;
    return element("ul", { class: "wi-changes" }, ...lines, plan);
  }

  private buttons(variant: Variant): HTMLElement {
    const button = (text: string, press: () => void): HTMLElement => {
      const made = element("button", { type: "button", class: "chip", "aria-label": `${text}: ${variant.name}` }, text);
      made.addEventListener("click", press);
      return made;
    };
    return element(
      "div",
      { class: "wi-actions" },
      button("Show", () => this.actions.show(variant)),
      ...sharing(variant, this.base, this.settings, this.title, this.actions.say).map(([text, press]) => button(text, press)),
      button("Remove", () => {
        this.kept.splice(this.kept.indexOf(variant), 1);
        this.draw();
      }),
    );
  }
}

// Link, command line and scenario file of a variant.
export function sharing(variant: Variant, base: Run, settings: Settings, title: string, say: (message: string) => void): [string, () => void][] {
  const file = (ending: string): string => `${title}-${variant.name}`.replace(/[^\w.-]+/g, "-") + ending;
  const forProgram = (): Override[] => {
    const { overrides, plan } = variant.request;
    const kept = plan === "keep" ? keptApproach(settings, base) : "";
    if (typeof kept !== "string") return [kept, ...overrides];
    if (kept) say(kept);
    return overrides;
  };
  const scenario = (): void => {
    try {
      const text = scenarioWith(base.data.source, forProgram());
      download(file(".yaml"), text);
      say("Keep the file in the folder of the original scenario: its paths are relative to it.");
    } catch (error) {
      say((error as Error).message);
    }
  };
  return [
    ["Link", () => void copyLink(variant, say)],
    ["Overrides", () => download(file(".sh"), commandText([...ownSettings(base), ...forProgram()], "scenario.yaml"))],
    ["Scenario", scenario],
  ];
}

// Of the run itself, which the variant has too.
function ownSettings(base: Run): Override[] {
  const own = base.data.source?.settings;
  return (Array.isArray(own) ? own : []).map((one) => {
    const at = String(one).indexOf("=");
    return { path: String(one).slice(0, at), value: String(one).slice(at + 1) };
  });
}

async function copyLink(variant: Variant, say: (message: string) => void): Promise<void> {
  const link = location.href.replace(/#.*$/, "") + fragmentOf(variant);
  try {
    await navigator.clipboard.writeText(link);
    say("The link is in the clipboard.");
  } catch {
    history.replaceState(null, "", link); // without access to the clipboard: in the address bar
    say("The link is in the address bar.");
  }
}
