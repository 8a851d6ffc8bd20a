// Keys of the replay: active wherever the focus is, except where an element uses the key itself; and their list.
import type { Clock } from "../clock";
import { element } from "../dom";
import { isFocusClicked } from "../focus_origin";
import type { Transport } from "./transport";

export interface KeyTargets {
  clock: Clock;
  transport: Transport;
  camera(index: number): void;
  reset(): void;
  zoom(factor: number): void;
  orbit(right: number, up: number): void; // [rad]
  help(): void;
}

// Returns the function that removes the listener.
export function listenKeys(host: HTMLElement, targets: KeyTargets): () => void {
  const pressed = (event: KeyboardEvent): void => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    const focused = document.activeElement;
    if (document.querySelector("dialog[open]") || (focused && !leaves(aboutFocus(host, focused), event.key, isFocusClicked()))) return;
    const act = action(event, targets);
    if (!act) return;
    event.preventDefault();
    act();
  };
  document.addEventListener("keydown", pressed);
  return () => document.removeEventListener("keydown", pressed);
}

interface Focus {
  tag: string; // upper case, as in HTML
  type: string; // of inputs
  editable: boolean;
  inside: boolean; // in the replay
}

function aboutFocus(host: HTMLElement, focused: Element): Focus {
  const own = focused as HTMLElement;
  return { tag: own.tagName, type: (own as HTMLInputElement).type ?? "", editable: own.isContentEditable, inside: host.contains(own) };
}

// Whether the focused element leaves a key to the replay.
export function leaves({ tag, type, editable, inside }: Focus, key: string, clicked: boolean): boolean {
  if (editable || tag === "TEXTAREA") return false;
  if (tag === "SELECT") return key === "[" || key === "]"; // it uses the other keys itself
  if (tag === "INPUT" && type !== "checkbox" && type !== "radio") return type === "range" && (inside || !/^(Arrow|Home|End)/.test(key));
  if (tag === "INPUT" && type === "radio" && key.startsWith("Arrow")) return false;
  if (tag === "BUTTON" || tag === "A" || tag === "SUMMARY" || tag === "INPUT") return clicked ? key !== "Enter" : key !== " " && key !== "Enter";
  return true;
}

const kKeys: [key: string, action: string][] = [
  ["Space", "play or pause"],
  ["← →", "one sample back or on; the states before and after an impact are separate"],
  ["Shift + ← →", "one second back or on"],
  ["Home, End", "begin, end"],
  ["[ ]", "previous or next phase"],
  ["W A S D", "turn the view; with Shift three times as far"],
  ["+ −", "zoom"],
  ["0", "see everything again"],
  ["1 … 9", "cameras, in the order of the list"],
  ["double click on a body", "show it from near"],
  ["?", "this list"],
];

// A dialog with the keys, opened by `?`.
export function keyList(): HTMLDialogElement {
  const close = element("button", { type: "button", class: "replay-chip" }, "Close");
  const rows = kKeys.flatMap(([key, text]) => [element("dt", {}, element("kbd", {}, key)), element("dd", {}, text)]);
  const dialog = element("dialog", { class: "replay-keys", "aria-label": "Keys of the replay" }, element("h3", {}, "Keys of the replay"), element("dl", {}, ...rows), close);
  close.addEventListener("click", () => dialog.close());
  return dialog;
}

const kTurn = Math.PI / 36; // 5 degrees per key press

// By key position, independent of the keyboard layout: W, A, S, D.
const kOrbit: Record<string, [number, number]> = { KeyW: [0, kTurn], KeyA: [-kTurn, 0], KeyS: [0, -kTurn], KeyD: [kTurn, 0] };

function action(event: KeyboardEvent, { clock, transport, camera, reset, zoom, orbit, help }: KeyTargets): (() => void) | undefined {
  const turn = Object.hasOwn(kOrbit, event.code) ? kOrbit[event.code] : undefined;
  if (turn) return () => orbit(turn[0] * (event.shiftKey ? 3 : 1), turn[1] * (event.shiftKey ? 3 : 1));
  switch (event.key) {
    case " ":
      return () => clock.toggle();
    case "ArrowLeft":
      return () => (event.shiftKey ? transport.shift(-1) : transport.step(-1));
    case "ArrowRight":
      return () => (event.shiftKey ? transport.shift(1) : transport.step(1));
    case "Home":
      return () => (clock.time = clock.begin);
    case "End":
      return () => (clock.time = clock.end);
    case "[":
      return () => transport.toPhase(-1);
    case "]":
      return () => transport.toPhase(1);
    case "+":
      return () => zoom(1.2);
    case "-":
      return () => zoom(1 / 1.2);
    case "0":
      return reset;
    case "?":
      return help;
  }
  return /^[1-9]$/.test(event.key) ? () => camera(Number(event.key) - 1) : undefined;
}
