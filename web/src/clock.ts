// The instant shown, shared by replay and plots; and playback. Time is that of the simulation [s].

// Slow motion within `before` and `after` about a time: playback is `factor` times as fast there.
export interface SlowMotion {
  time: number;
  before: number;
  after: number;
  factor: number;
}

// Where playback is after `seconds` of watching: through slow parts at their own rate, however long a frame took.
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

const kLongestPause = 0.1; // of what passed while the page was out of sight, so much is played [s]

export class Clock {
  speed = 1; // seconds of simulation per second of watching
  slowAround: SlowMotion[] = []; // about impacts
  private now: number;
  private before = 0;
  private running = false;
  private last = 0;
  private unseen = false; // the page was out of sight since the last frame: browsers stop frames then
  private readonly listeners = new Set<() => void>();

  constructor(
    readonly begin: number,
    readonly end: number,
  ) {
    this.now = begin;
    globalThis.document?.addEventListener?.("visibilitychange", () => {
      if (document.hidden) this.unseen = true;
    });
  }

  get time(): number {
    return this.now;
  }
  set time(time: number) {
    this.show(time, 0);
  }

  // At an impact several samples have one time: how many of them come after the one that is shown; 0: the last is shown.
  get back(): number {
    return this.before;
  }
  show(time: number, back: number): void {
    const clamped = Math.min(this.end, Math.max(this.begin, Number.isFinite(time) ? time : this.begin));
    if (clamped === this.now && back === this.before) return;
    this.now = clamped;
    this.before = back;
    this.tell();
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
    this.tell();
  }
  pause(): void {
    if (!this.running) return;
    this.running = false;
    this.tell();
  }
  toggle(): void {
    if (this.running) this.pause();
    else this.play();
  }

  // Called at every change of time or playback. Returns what ends it.
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
    this.tell();
    if (this.running) requestAnimationFrame(this.tick);
  };

  private tell(): void {
    for (const listener of this.listeners) listener();
  }
}
