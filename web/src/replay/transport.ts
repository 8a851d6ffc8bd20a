// Playback and scrubbing: buttons, speed, and a track that displays phases and impacts.
import { slowFactor, type Clock } from "../clock";
import { phaseTint } from "../colors";
import { element, svgElement } from "../dom";
import { number } from "../format";
import { withUnit, words } from "../page/read";
import { roving } from "../roving";
import type { PhaseSpan, Run } from "../run";
import type { Impact } from "./impacts";

const kSpeeds = [0.1, 0.25, 0.5, 1, 2, 5, 10];

const kIcons = {
  play: "M4 2.5v11l9.5-5.5z",
  pause: "M3.5 2.5h3v11h-3zM9.5 2.5h3v11h-3z",
  previous: "M3 3h2v10H3zM13 3v10L5.5 8z",
  next: "M11 3h2v10h-2zM3 3v10l7.5-5z",
  impact: "M8 1l1.3 4.2L13.5 3 11 6.9 15 8l-4 1.1 2.5 3.9-4.2-2.2L8 15l-1.3-4.2L2.5 13 5 9.1 1 8l4-1.1L2.5 3l4.2 2.2z",
};

export class Transport {
  readonly host = element("div", { class: "replay-transport", role: "group", "aria-label": "Playback" });
  private readonly play = button("Play (space)", kIcons.play, "replay-play");
  private readonly range = element("input", { type: "range", step: "any", "aria-label": "Time", class: "replay-range" });
  private readonly time = element("output", { class: "replay-time" });
  private readonly phase = element("span", { class: "replay-phase" });
  private readonly elapsed = element("div", { class: "replay-elapsed" });
  private readonly speed = element("select", { "aria-label": "Speed", class: "replay-speed", title: "Seconds of simulation per second" });
  private readonly video = element("button", { type: "button", class: "replay-chip", "aria-pressed": "false" }, "Record video");
  private readonly videoStatus = element("span", { class: "replay-said", role: "status" });
  private readonly slow = element("input", { type: "checkbox" });
  private boundaries: number[]; // starts of phases, and the end [s]

  constructor(
    private readonly clock: Clock,
    private readonly run: Run,
    private readonly impacts: Impact[],
  ) {
    this.boundaries = this.boundariesNow();
    this.build();
    this.setSpeed(defaultSpeed(clock.end - clock.begin));
    this.update();
  }

  update(): void {
    const { clock } = this;
    const icon = clock.playing ? kIcons.pause : kIcons.play;
    const path = this.play.querySelector("path")!;
    if (path.getAttribute("d") !== icon) {
      path.setAttribute("d", icon);
      const label = clock.playing ? "Pause (space)" : "Play (space)";
      this.play.setAttribute("aria-label", label);
      this.play.title = label;
    }
    const phase = this.phaseAt();
    const text = `${clock.time.toFixed(3)} s`;
    this.range.value = String(clock.time);
    this.time.textContent = text;
    const until = this.run.validUntil;
    const beyond = until !== null && clock.time > until;
    this.phase.classList.toggle("beyond-validity", beyond);
    this.range.setAttribute("aria-valuetext", `${text}, ${phase}${beyond ? ", beyond validity" : ""}`);
    const speed = this.slowed() ? `, at ${number(this.rate(), 2)}×` : "";
    this.phase.textContent = phase + speed + (beyond ? `, beyond validity: valid until ${withUnit(until, "s")}` : "");
    const part = clock.end > clock.begin ? (clock.time - clock.begin) / (clock.end - clock.begin) : 0;
    this.elapsed.style.width = `${(100 * part).toFixed(3)}%`;
  }

  // A button that records a video, or the reason why recording is not possible.
  offerVideo(toggle: (() => void) | null, why: string): void {
    this.video.disabled = toggle === null;
    this.video.title = toggle ? "Record a WebM video of what is played from here on, in real time" : why;
    if (toggle) this.video.addEventListener("click", toggle);
    else this.videoStatus.textContent = why;
    this.host.append(element("div", { class: "replay-video" }, this.video, this.videoStatus));
  }
  recording(on: boolean, message: string): void {
    this.video.textContent = on ? "Stop and save" : "Record video";
    this.video.setAttribute("aria-pressed", String(on));
    this.videoStatus.textContent = message;
  }

  // ---- Key actions ----
  // An impact has two or more states at one time; each is a separate step.
  step(samples: number): void {
    const { clock } = this;
    clock.pause();
    const to = nextState(this.run.states, clock, samples > 0);
    if (to) clock.show(to.time, to.back);
    else clock.time = samples > 0 ? clock.end : clock.begin;
  }
  shift(seconds: number): void {
    this.clock.time += seconds;
  }
  toPhase(direction: number): void {
    const now = this.clock.time;
    if (direction > 0) this.clock.time = this.boundaries.find((t) => t > now + 1e-9) ?? this.clock.end;
    else this.clock.time = lastBefore(this.boundaries, now - 1e-9) ?? this.clock.begin;
  }
  toImpact(): void {
    if (this.impacts.length === 0) return;
    this.clock.pause();
    const next = this.impacts.find((i) => i.time > this.clock.time + 1e-9) ?? this.impacts[0];
    this.clock.time = next.time;
  }

  // Seconds of simulation per second, at the current instant.
  private rate(): number {
    const { clock } = this;
    return clock.speed * slowFactor(clock.time, clock.slowAround);
  }
  private slowed(): boolean {
    return this.clock.playing && this.rate() < this.clock.speed;
  }

  private phaseAt(): string {
    const { clock, run } = this;
    const { index } = run.locate(clock.time, clock.back);
    const span = run.phases.find((p) => p.first <= index && index <= p.last);
    const beside = run.ranks.some((rank, i) => rank > 0 && run.time[i] === clock.time);
    const side = !beside ? "" : clock.back > 0 && run.ranks[index] === 0 ? ", just before" : ", just after";
    return `${span ? words(span.name) : ""}${side}`;
  }

  // After a change of the clock's end.
  rescale(): void {
    this.boundaries = this.boundariesNow();
    this.host.querySelector(".replay-scrub")?.replaceWith(this.scrub());
    this.update();
  }
  private boundariesNow(): number[] {
    return distinct([...this.run.phases.map((p) => p.begin), this.clock.begin, this.clock.end]);
  }

  private build(): void {
    const { clock } = this;
    const previous = button("Previous phase ([)", kIcons.previous);
    const next = button("Next phase (])", kIcons.next);
    const impact = button("Go to the impact", kIcons.impact);
    previous.addEventListener("click", () => this.toPhase(-1));
    next.addEventListener("click", () => this.toPhase(1));
    impact.addEventListener("click", () => this.toImpact());
    impact.append(element("span", { class: "replay-word" }, "Impact"));
    impact.hidden = this.impacts.length === 0;
    this.play.addEventListener("click", () => clock.toggle());
    for (const s of kSpeeds) this.speed.append(element("option", { value: String(s) }, `${s}×`));
    this.speed.addEventListener("change", () => this.setSpeed(Number(this.speed.value)));
    this.slow.checked = true;
    this.slow.addEventListener("change", () => this.setSpeed(clock.speed));
    const slow = element("label", { class: "replay-check", title: "Slow motion around the impact" }, this.slow, "Slow at impact");
    slow.hidden = this.impacts.length === 0;
    const left = element("div", { class: "replay-group", role: "toolbar", "aria-label": "Play and go to" }, previous, this.play, next, impact);
    roving(left);
    const middle = element("div", { class: "replay-now" }, this.time, this.phase);
    const right = element("div", { class: "replay-group" }, slow, this.speed);
    this.range.addEventListener("input", () => {
      clock.pause();
      clock.time = Number(this.range.value);
    });
    this.host.append(this.scrub(), element("div", { class: "replay-buttons" }, left, middle, right));
  }

  private scrub(): HTMLElement {
    const { clock } = this;
    const track = element("div", { class: "replay-track", "aria-hidden": "true" });
    const span = Math.max(1e-12, clock.end - clock.begin);
    const percent = (t: number) => `${((100 * (t - clock.begin)) / span).toFixed(3)}%`;
    for (const phase of this.run.phases) {
      const part = element("div", { class: "replay-segment", title: phaseTitle(phase) });
      part.style.left = percent(phase.begin);
      part.style.width = percent(clock.begin + phase.end - phase.begin);
      part.style.background = strong(phaseTint(phase.name));
      if ((phase.end - phase.begin) / span > 0.14) part.append(element("span", {}, words(phase.name)));
      track.append(part);
    }
    const until = this.run.validUntil;
    if (until !== null && until < clock.end) {
      const beyond = element("div", { class: "replay-beyond", title: `beyond validity from ${withUnit(until, "s")} on: bodies overlap` });
      beyond.style.left = percent(until);
      track.append(beyond);
    }
    track.append(this.elapsed);
    for (const impact of this.impacts) {
      const tick = element("div", { class: "replay-tick" });
      tick.style.left = percent(impact.time);
      track.append(tick);
    }
    this.range.min = String(clock.begin);
    this.range.max = String(clock.end);
    return element("div", { class: "replay-scrub" }, track, this.range);
  }

  // Also sets slow motion: instantaneous impacts at a fifth of real time, compliant ones within about eight seconds.
  private setSpeed(speed: number): void {
    this.clock.speed = speed;
    this.speed.value = String(speed);
    this.clock.slowAround = !this.slow.checked
      ? []
      : this.impacts.map(({ time, duration }) => {
          const rate = duration > 0 ? Math.min(0.2, duration / 8) : 0.2;
          const before = duration > 0 ? 0.1 * duration : 0.3;
          return { time, before, after: duration + (duration > 0 ? 0.1 * duration : 0.8), factor: Math.min(1, rate / speed) };
        });
  }
}

// The state after the displayed one, or before it.
export function nextState(
  states: readonly { time: number; back: number }[],
  now: { time: number; back: number },
  forward: boolean,
): { time: number; back: number } | undefined {
  const order = (one: { time: number; back: number }): number =>
    Math.abs(one.time - now.time) > 1e-12 ? one.time - now.time : now.back - one.back;
  if (forward) return states.find((one) => order(one) > 0);
  for (let i = states.length - 1; i >= 0; --i) if (order(states[i]) < 0) return states[i];
  return undefined;
}

// The highest of the offered speeds, at most 2, at which the whole run takes at least 20 s.
function defaultSpeed(span: number): number {
  return [2, 1, 0.5, 0.25].find((s) => span / s >= 20) ?? 0.1;
}

function button(label: string, icon: string, kind = ""): HTMLButtonElement {
  const made = element("button", { type: "button", class: `replay-button ${kind}`, "aria-label": label, title: label });
  made.append(svgElement("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, svgElement("path", { d: icon })));
  return made;
}

function phaseTitle(phase: PhaseSpan): string {
  return `${words(phase.name)}: ${phase.begin.toFixed(2)} to ${phase.end.toFixed(2)} s`;
}

// The hue of a phase at the track's strength.
function strong(tint: string): string {
  return tint.replace(/[\d.]+\)$/, "0.42)");
}

function lastBefore(times: number[], limit: number): number | undefined {
  for (let i = times.length - 1; i >= 0; --i) if (times[i] < limit) return times[i];
  return undefined;
}

function distinct(times: number[]): number[] {
  return [...new Set(times)].sort((a, b) => a - b);
}
