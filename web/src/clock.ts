// The displayed instant, shared by replay and plots; and playback. Time is simulation time [s].

// Slow motion within `before` and `after` about a time: playback is `factor` times as fast there.
export interface SlowMotion {
  time: number;
  before: number;
  after: number;
  factor: number;
}

// Playback position after `seconds` of real time: slow intervals have their own rate, regardless of the frame duration.
export function advance(now: number, seconds: number, speed: number, slow: readonly SlowMotion[], end: number): number {
  let left = seconds;
  while (left > 0 && now < end) {
    const rate = speed * slowFactor(now, slow);
    let next = end;
    for (const { time, before, after } of slow) {
      for (const edge of [time - before, time + after]) if (edge > now && edge < next) next = edge;
    }
    const needed = (next - now) / rate;
    if (needed > left) return now + left * rate;
    now = next;
    left -= needed;
  }
  return Math.min(now, end);
}

export function slowFactor(now: number, slow: readonly SlowMotion[]): number {
  let factor = 1;
  for (const one of slow) if (now >= one.time - one.before && now < one.time + one.after) factor = Math.min(factor, one.factor);
  return factor;
}

const kLongestPause = 0.1; // played time after the page was hidden, at most [s]

export class Clock {
  speed = 1; // seconds of simulation per second of real time
  slowAround: SlowMotion[] = []; // about impacts
  private now: number;
  private before = 0;
  private running = false;
  private last = 0;
  private unseen = false; // the page was hidden since the last frame: browsers stop frames then
  private readonly listeners = new Set<() => void>();

  constructor(
    readonly begin: number,
    private ending: number,
  ) {
    this.now = begin;
    globalThis.document?.addEventListener?.("visibilitychange", () => {
      if (document.hidden) this.unseen = true;
    });
  }

  // The end may change: a variant of a run may be longer.
  get end(): number {
    return this.ending;
  }
  set end(end: number) {
    this.ending = end;
    if (this.now > end) this.show(end, 0);
    else this.notify();
  }

  get time(): number {
    return this.now;
  }
  set time(time: number) {
    this.show(time, 0);
  }

  // Moves into a window, to its nearer end.
  enter(begin: number, end: number): void {
    if (this.now < begin) this.time = begin;
    else if (this.now > end) this.time = end;
  }

  // At an impact several samples have one time: the number of samples of this time after the displayed one; 0: the last
  // is displayed.
  get back(): number {
    return this.before;
  }
  show(time: number, back: number): void {
    const clamped = Math.min(this.end, Math.max(this.begin, Number.isFinite(time) ? time : this.begin));
    if (clamped === this.now && back === this.before) return;
    this.now = clamped;
    this.before = back;
    this.notify();
  }

  get playing(): boolean {
    return this.running;
  }
  play(): void {
    if (this.running || this.end <= this.begin) return;
    if (this.now >= this.end) this.now = this.begin;
    this.before = 0;
    this.running = true;
    this.unseen = false;
    this.last = performance.now();
    requestAnimationFrame(this.tick);
    this.notify();
  }
  pause(): void {
    if (!this.running) return;
    this.running = false;
    this.notify();
  }
  toggle(): void {
    if (this.running) this.pause();
    else this.play();
  }

  // Called at every change of time or playback. Returns the function that unsubscribes.
  listen(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  private readonly tick = (stamp: number): void => {
    if (!this.running) return;
    const passed = Math.max(0, (stamp - this.last) / 1000);
    const elapsed = this.unseen ? Math.min(kLongestPause, passed) : passed;
    this.unseen = false;
    this.last = Math.max(stamp, this.last);
    this.now = advance(this.now, elapsed, this.speed, this.slowAround, this.end);
    if (this.now >= this.end) this.running = false;
    this.notify();
    if (this.running) requestAnimationFrame(this.tick);
  };

  private notify(): void {
    for (const listener of this.listeners) listener();
  }
}
