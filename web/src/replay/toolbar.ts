// The toolbar: cameras and display options.
import { element } from "../dom";
import { roving } from "../roving";
import type { ViewSpec } from "./cameras";
import { number } from "../format";
import { kMaxBending, type Shown } from "./run_view";

const kNames: [keyof Shown, string, string][] = [
  ["trails", "Trails", "Ways of end-effectors and of the targets' centres of mass"],
  ["points", "Grasps", "Grasp points and contact points"],
  ["impulses", "Impulses", "Impulses on the robot at the impact [N s]"],
  ["forces", "Forces", "Forces of the grasps on the robot, and of contacts on the second body of each pair [N]"],
  ["momentum", "Momentum", "Linear momentum of robot, targets and all together [N s]"],
  ["angular", "Angular momentum", "Angular momentum of all together and of the robot, about the centre of mass of all [N m s]"],
  ["actuators", "Actuators", "Wheels and gyros: green far from their largest rate, red at it; thrusters with their exhaust"],
  ["torques", "Joint torques", "Joints turn red towards their effort limits; without a limit towards their largest torque of the run"],
  ["orbit", "Orbit", "Directions to the central body and along the orbit"],
  ["mass", "Centre of mass", "Centre of mass of the whole system"],
  ["axes", "Axes", "Axes of base, targets and end-effectors: x red, y green, z blue"],
  ["initial", "Initial pose", "Where everything was at the beginning"],
  ["ground", "Ground", "A grid that stands still in W, below everything, with the sun's shadows on it"],
  ["sky", "Sky", "Stars, fixed in W; with an orbit also the central body, at its computed direction and size"],
  ["names", "Names", "Names of bodies and end-effectors"],
];

export class Toolbar {
  readonly host = element("div", { class: "replay-toolbar" });
  private readonly cameras = element("select", { "aria-label": "Camera", class: "replay-camera", title: "Camera (keys 1, 2, …)" });
  readonly turn = chip("Turn with body", "The view turns with the body that it follows");

  constructor(
    views: readonly ViewSpec[],
    shown: Shown,
    offers: (what: keyof Shown) => boolean,
    bends: boolean,
    acts: { camera(index: number): void; reset(): void; turn(on: boolean): void; bent(times: number): void; changed(): void },
  ) {
    views.forEach((view, i) => this.cameras.append(element("option", { value: String(i) }, `${i + 1}  ${view.label}`)));
    this.cameras.addEventListener("change", () => acts.camera(Number(this.cameras.value)));
    const reset = element("button", { type: "button", class: "replay-chip", title: "See everything again (0)" }, "Reset view");
    reset.addEventListener("click", () => acts.reset());
    this.turn.classList.add("replay-turn"); // placed over the picture: bars do not resize when it appears
    this.turn.addEventListener("click", () => acts.turn(flip(this.turn)));
    const chips = element("div", { class: "replay-chips", role: "toolbar", "aria-label": "Show" });
    for (const [what, label, title] of kNames) {
      if (!offers(what)) continue;
      const made = chip(label, title, shown[what]);
      made.addEventListener("click", () => {
        shown[what] = flip(made);
        acts.changed();
      });
      chips.append(made);
    }
    roving(chips);
    this.host.append(element("div", { class: "replay-group" }, this.cameras, reset), chips);
    if (bends) this.host.append(bendingSlider(acts.bent));
  }

  // A button for those who do not know the key `?`.
  offerKeys(show: () => void): void {
    const button = element("button", { type: "button", class: "replay-chip", title: "Keys of the replay (?)" }, "Keys");
    button.addEventListener("click", show);
    this.host.firstElementChild!.append(button);
  }

  select(index: number, follows: boolean): void {
    this.cameras.value = String(index);
    this.turn.hidden = !follows;
  }
}

// From 1 to kMaxBending, on a logarithmic scale.
function bendingSlider(bent: (times: number) => void): HTMLElement {
  const range = element("input", { type: "range", min: "0", max: String(Math.log10(kMaxBending)), step: "0.1", value: "0", "aria-label": "Bending drawn so many times" });
  const output = element("output", {}, "1 ×");
  range.addEventListener("input", () => {
    const times = Number((10 ** Number(range.value)).toPrecision(2));
    output.textContent = `${number(times)} ×`;
    range.setAttribute("aria-valuetext", `${number(times)} times`);
    bent(times);
  });
  return element("label", { class: "replay-bending", title: "Magnification of the displayed bending; trails, arrows and captured targets are not magnified" }, element("span", {}, "Bending"), range, output);
}

function chip(label: string, title: string, on = false): HTMLButtonElement {
  return element("button", { type: "button", class: "replay-chip", title, "aria-pressed": String(on) }, label);
}

function flip(made: HTMLButtonElement): boolean {
  const on = made.getAttribute("aria-pressed") !== "true";
  made.setAttribute("aria-pressed", String(on));
  return on;
}

// The legend: rows of a swatch and a name.
export interface LegendRow {
  role: string;
  text: string;
  faint?: boolean;
}

export class Legend {
  readonly host = element("ul", { class: "replay-legend", "aria-label": "Colours" });

  private rows: LegendRow[] = [];

  show(rows: LegendRow[], color: (role: string) => string): void {
    this.rows = rows;
    this.host.replaceChildren(
      ...rows.map((row) => {
        const swatch = element("i", { class: row.faint ? "faint" : "", "aria-hidden": "true" });
        swatch.style.background = color(row.role);
        swatch.style.borderColor = color(row.role);
        return element("li", {}, swatch, element("span", {}, row.text));
      }),
    );
  }

  // The same along the lower edge of a printed picture.
  draw(context: CanvasRenderingContext2D, height: number, color: (role: string) => string, ink = "#333"): void {
    context.save();
    context.font = "12px system-ui, sans-serif";
    context.textBaseline = "middle";
    let x = 12;
    const y = height - 14;
    for (const row of this.rows) {
      if (row.role === "grid") continue;
      context.globalAlpha = row.faint ? 0.5 : 1;
      context.fillStyle = color(row.role);
      context.fillRect(x, y - 5, 10, 10);
      context.globalAlpha = 1;
      context.fillStyle = ink;
      context.fillText(row.text, x + 15, y);
      x += 15 + context.measureText(row.text).width + 16;
    }
    context.restore();
  }
}
