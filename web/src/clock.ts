// The instant shown, shared by replay and plots; and playback. Time is that of the simulation [s].

export class Clock {
  speed = 1; // seconds of simulation per second of watching
  slowAround: { time: number; before: number; after: number; factor: number }[] = []; // slow motion about impacts
  private now: number;
  private running = false;
  private last = 0;
  private readonly listeners = new Set<() => void>();

  constructor(
    readonly begin: number,
    readonly end: number,
  ) {
    this.now = begin;
  }

  get time(): number {
    return this.now;
  }
  set time(time: number) {
    const clamped = Math.min(this.end, Math.max(this.begin, Number.isFinite(time) ? time : this.begin));
    if (clamped === this.now) return;
    this.now = clamped;
    this.tell();
  }

  get playing(): boolean {
    return this.running;
  }
  play(): void {
    if (this.running || this.end <= this.begin) return;
    if (this.now >= this.end) this.now = this.begin;
    this.running = true;
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
    const elapsed = Math.min(0.1, Math.max(0, (stamp - this.last) / 1000));
    this.last = stamp;
    let rate = this.speed;
    for (const slow of this.slowAround) {
      if (this.now > slow.time - slow.before && this.now < slow.time + slow.after) rate = this.speed * slow.factor;
    }
    this.now = Math.min(this.end, this.now + elapsed * rate);
    if (this.now >= this.end) this.running = false;
    this.tell();
    if (this.running) requestAnimationFrame(this.tick);
  };

  private tell(): void {
    for (const listener of this.listeners) listener();
  }
}
