// The displayed part of time, shared by all plots. A plot that is zoomed separately has its own.
import { words } from "../page/read";
import type { PhaseSpan } from "../run";
import { kSmallestWindow } from "./jumps";

export class TimeWindow {
  min: number;
  max: number;
  linked = false; // zooming one plot zooms all plots
  private readonly listeners = new Set<() => void>();

  constructor(
    readonly begin: number,
    private ending: number,
  ) {
    this.min = begin;
    this.max = notEmpty(begin, ending);
  }

  get end(): number {
    return this.ending;
  }
  // A window that shows everything continues to do so. Listeners are not called: plots keep what they show separately.
  set end(end: number) {
    const whole = this.max >= this.ending;
    this.ending = end;
    [this.min, this.max] = this.allowed(this.min, whole ? notEmpty(this.begin, end) : this.max);
  }

  set(min: number, max: number): void {
    [this.min, this.max] = this.allowed(min, max);
    for (const listener of this.listeners) listener();
  }
  reset(): void {
    this.set(this.begin, this.end);
  }
  listen(listener: () => void): void {
    this.listeners.add(listener);
  }

  // Within the run, and not smaller than the resolution of plots.
  allowed(min: number, max: number): [number, number] {
    const span = this.end > this.begin ? this.end - this.begin : 1;
    const least = span * kSmallestWindow;
    const middle = (min + max) / 2;
    if (!(max - min >= least)) [min, max] = [middle - least / 2, middle + least / 2];
    min = Math.max(min, this.begin);
    max = Math.min(max, this.begin + span);
    return max - min >= least * 0.999
      ? [min, max]
      : [Math.max(this.begin, max - least), Math.max(this.begin, max - least) + least];
  }
}

export interface TimeRange {
  name: string;
  begin: number; // [s]
  end: number;
  at?: number; // the instant that it is about, shown by the replay too
}

// The whole run, its phases, and the surroundings of its impacts.
export function timeRanges(phases: readonly PhaseSpan[], begin: number, end: number): TimeRange[] {
  const ranges: TimeRange[] = [{ name: "whole run", begin, end }];
  for (const phase of phases) {
    if (/^contact/.test(phase.name)) {
      const around = Math.max(phase.end - phase.begin, 0.02 * (end - begin)) / 2;
      const name = phase.name === "contact" ? "around the impact" : `around ${words(phase.name)}`;
      ranges.push({ name, begin: phase.begin - around, end: phase.end + around, at: phase.begin });
    } else if (phase.end > phase.begin) ranges.push({ name: words(phase.name), begin: phase.begin, end: phase.end });
  }
  return ranges;
}

// The end of a window that begins there.
function notEmpty(begin: number, end: number): number {
  return end > begin ? end : begin + 1;
}
