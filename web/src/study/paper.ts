// Paper is white: charts, whose colours are written into them, are drawn in light ones while a dark page is printed.
import { css } from "../plots/theme_colors";

export function lightOnPaper(): void {
  const { dataset } = document.documentElement;
  let before: string | undefined;
  let turned = false;
  const turn = (to: string | undefined): void => {
    if (to === undefined) delete dataset.theme;
    else dataset.theme = to;
    window.dispatchEvent(new Event("grapnel-theme")); // charts draw themselves again
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
