// Numbers of the live page, from the state that the program sends. No DOM.
import { wilson } from "../campaign/wilson";

export interface LivePhase {
  name: string;
  from: number; // simulated time at its first report [s]; of planning: evaluations
  at: number;
  end: number; // of planning: at most
  begun: number; // [s] since the start of the command
  latest: number;
  unit: string; // "s", "evaluations"
}

export interface LiveState {
  elapsed: number; // [s]
  stopping: boolean;
  ending: string | null; // "done", "failed", ...; null: the work continues
  report: boolean; // whether the program can send the report
  samples: number; // of a run, so far
  phases: LivePhase[];
  messages: { kind: string; text: string }[];
  notes: string;
  unit: string; // "case", "point"; "": a single run
  history: [elapsed: number, done: number, successes: number, failed: number][];
  begun_with?: number; // completed by earlier commands
  total?: number;
}

// Done so far, from 0 to 1.
export function share(phase: LivePhase): number {
  const whole = phase.end - phase.from;
  return whole > 0 ? Math.min(1, Math.max(0, (phase.at - phase.from) / whole)) : 1;
}

// Time left of the cases or of the current phase at the rate so far [s]; null: unknown.
export function timeLeft(state: LiveState): number | null {
  if (state.ending !== null) return null;
  const latest = state.history.at(-1);
  if (latest && state.total !== undefined) {
    const computed = latest[1] - (state.begun_with ?? 0);
    const elapsed = latest[0] - state.history[0][0];
    const open = state.total - latest[1];
    return computed > 0 && elapsed > 0 && open > 0 ? (open * elapsed) / computed : null;
  }
  const phase = state.phases.at(-1);
  if (!phase || phase.unit !== "s") return null;
  const rate = (phase.at - phase.from) / (phase.latest - phase.begun);
  return rate > 0 && Number.isFinite(rate) ? (phase.end - phase.at) / rate : null;
}

export interface Estimate {
  cases: number[];
  estimate: number[];
  lower: number[];
  upper: number[];
}

// Probability of success after each entry of the history, with Wilson's interval.
export function estimates(state: LiveState, confidence: number): Estimate {
  const made: Estimate = { cases: [], estimate: [], lower: [], upper: [] };
  for (const [, done, successes] of state.history) {
    if (done <= (made.cases.at(-1) ?? 0)) continue; // x must grow
    const p = wilson(successes, done, confidence);
    made.cases.push(done);
    made.estimate.push(p.estimate);
    made.lower.push(p.lower);
    made.upper.push(p.upper);
  }
  return made;
}

// "45 s", "12 min", "3.4 h"
export function durationText(seconds: number): string {
  if (seconds < 90) return `${Math.round(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return `${(seconds / 3600).toFixed(1)} h`;
}
