// Whether the focus was set by the pointer: a button that was clicked then leaves arrows and the space bar to the replay.
let clicked = false;

globalThis.document?.addEventListener("pointerdown", () => (clicked = true), true);
globalThis.document?.addEventListener("keydown", (event) => event.key === "Tab" && (clicked = false), true);

export function isFocusClicked(): boolean {
  return clicked;
}
