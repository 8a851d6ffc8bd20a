// Keys of the replay. They are active if the replay, or no other element of the page, has the focus.
import type { Clock } from "../clock";
import type { Transport } from "./transport";

export interface KeyTargets {
  clock: Clock;
  transport: Transport;
  camera(index: number): void;
  reset(): void;
  zoom(factor: number): void;
  orbit(right: number, up: number): void; // [rad]
}

// Returns the function that removes the listener.
export function listenKeys(host: HTMLElement, targets: KeyTargets): () => void {
  const pressed = (event: KeyboardEvent): void => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || !concerns(host, event)) return;
    const act = action(event, targets);
    if (!act) return;
    event.preventDefault();
    act();
  };
  document.addEventListener("keydown", pressed);
  return () => document.removeEventListener("keydown", pressed);
}

function concerns(host: HTMLElement, event: KeyboardEvent): boolean {
  const focused = document.activeElement;
  if (!focused || focused === document.body || focused === document.documentElement) return true;
  if (!host.contains(focused)) return false;
  const kind = focused.tagName;
  if (kind === "SELECT") return event.key === "[" || event.key === "]"; // it uses the other keys itself
  if (kind === "BUTTON" || (kind === "INPUT" && (focused as HTMLInputElement).type === "checkbox")) return event.key !== " " && event.key !== "Enter";
  return true;
}

const kTurn = Math.PI / 36; // 5 degrees per key press

// By key position, independent of the keyboard layout: W, A, S, D.
const kOrbit: Record<string, [number, number]> = { KeyW: [0, kTurn], KeyA: [-kTurn, 0], KeyS: [0, -kTurn], KeyD: [kTurn, 0] };

function action(event: KeyboardEvent, { clock, transport, camera, reset, zoom, orbit }: KeyTargets): (() => void) | undefined {
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
  }
  return /^[1-9]$/.test(event.key) ? () => camera(Number(event.key) - 1) : undefined;
}
