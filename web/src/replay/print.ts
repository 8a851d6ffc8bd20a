// A still picture for printing, drawn just before the page is printed: the displayed instant, or the impact if the
// replay has not been moved.
import type { Clock } from "../clock";
import { element } from "../dom";
import type { Impact } from "./impacts";
import type { Viewport } from "./viewport";

// Returns the function that removes the listener.
export function makeStill(root: HTMLElement, viewport: Viewport, clock: Clock, impacts: Impact[]): () => void {
  const canvas = element("canvas", { class: "replay-still-picture" });
  const caption = element("figcaption");
  const figure = element("figure", { class: "replay-still", "aria-hidden": "true" }, canvas, caption);
  root.append(figure);
  const draw = (): void => {
    const impact = impacts[0];
    const time = impact && clock.time === clock.begin ? impact.time : clock.time;
    viewport.still(time, canvas);
    caption.textContent = `t = ${time.toFixed(3)} s${impact && time === impact.time ? ", at the impact" : ""}`;
  };
  const media = matchMedia("print");
  const changed = (): void => {
    if (media.matches) draw();
  };
  window.addEventListener("beforeprint", draw);
  media.addEventListener("change", changed);
  return () => {
    window.removeEventListener("beforeprint", draw);
    media.removeEventListener("change", changed);
  };
}
