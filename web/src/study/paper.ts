// Charts contain their colours: on a dark page they are redrawn in light colours for printing on white paper.
import { css } from "../plots/theme_colors";

export function lightOnPaper(): void {
  const { dataset } = document.documentElement;
  let before: string | undefined;
  let turned = false;
  const turn = (to: string | undefined): void => {
    if (to === undefined) delete dataset.theme;
    else dataset.theme = to;
    window.dispatchEvent(new Event("grapnel-theme")); // charts redraw
  };
  window.addEventListener("beforeprint", () => {
    if (turned || css("--scheme") !== "dark") return;
    [before, turned] = [dataset.theme, true];
    turn("light");
  });
  window.addEventListener("afterprint", () => {
    if (!turned) return;
    turned = false;
    turn(before);
  });
}
