// Texts beside points of the scene: HTML over the canvas, positioned in every frame. Names are inserted as text, never
// as HTML.
import { type Camera, type Object3D, Vector3 } from "three";
import { element } from "../dom";

export interface Label {
  text: string;
  role: string; // role that determines its colour
  anchor: Vector3; // in the world group
  visible: boolean;
}

interface Placed {
  label: Label;
  x: number;
  y: number;
}

export class Labels {
  readonly host = element("div", { class: "replay-labels", "aria-hidden": "true" });
  private readonly labels: Label[] = [];
  private readonly elements = new Map<Label, HTMLElement>();

  add(role: string, text = ""): Label {
    const label: Label = { text, role, anchor: new Vector3(), visible: false };
    this.labels.push(label);
    const made = element("span", { class: "replay-label" });
    made.hidden = true;
    this.elements.set(label, made);
    this.host.append(made);
    return label;
  }

  // Removes all labels except the first `count`.
  truncate(count: number): void {
    for (const label of this.labels.splice(count)) {
      this.elements.get(label)?.remove();
      this.elements.delete(label);
    }
  }
  get count(): number {
    return this.labels.length;
  }

  layout(world: Object3D, camera: Camera, width: number, height: number, color: (role: string) => string): void {
    const placed = this.place(world, camera, width, height);
    for (const label of this.labels) this.elements.get(label)!.hidden = true;
    for (const { label, x, y } of placed) {
      const made = this.elements.get(label)!;
      if (made.textContent !== label.text) made.textContent = label.text;
      made.hidden = false;
      made.style.color = color(label.role);
      made.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }

  // The same on a picture for printing.
  draw(
    context: CanvasRenderingContext2D,
    world: Object3D,
    camera: Camera,
    width: number,
    height: number,
    color: (role: string) => string,
    halo = "#fff",
  ): void {
    context.save();
    context.font = "600 13px system-ui, sans-serif";
    context.textBaseline = "top";
    context.lineWidth = 3;
    context.strokeStyle = halo;
    for (const { label, x, y } of this.place(world, camera, width, height)) {
      context.strokeText(label.text, x, y);
      context.fillStyle = color(label.role);
      context.fillText(label.text, x, y);
    }
    context.restore();
  }

  // Right of their points, inside the picture, without overlaps.
  private place(world: Object3D, camera: Camera, width: number, height: number): Placed[] {
    const line = 19;
    const placed: Placed[] = [];
    const point = new Vector3();
    for (const label of this.labels) {
      if (!label.visible || label.text === "") continue;
      point.copy(label.anchor).applyMatrix4(world.matrixWorld).project(camera);
      if (point.z < -1 || point.z > 1 || Math.abs(point.x) > 1.05 || Math.abs(point.y) > 1.05) continue;
      const wide = 7.2 * label.text.length + 10;
      const wish = ((point.x + 1) / 2) * width + 9;
      const x = Math.min(Math.max(4, wish), Math.max(4, width - wide));
      const under = wish > x ? 14 : 0; // no space beside the point: below it
      placed.push({ label, x, y: Math.min(Math.max(4, ((1 - point.y) / 2) * height - 9 + under), height - line) });
    }
    placed.sort((a, b) => a.y - b.y);
    for (let i = 1; i < placed.length; ++i) {
      for (let k = 0; k < i; ++k) {
        const near = Math.abs(placed[i].x - placed[k].x) < 7.2 * Math.max(placed[i].label.text.length, placed[k].label.text.length);
        if (near && placed[i].y - placed[k].y < line) placed[i].y = placed[k].y + line;
      }
    }
    return placed;
  }
}
