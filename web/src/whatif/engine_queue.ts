// One engine for the whole panel: a run at a time, the newest request of the panel first. No DOM.
import type { Progress, VariantEngine, VariantRequest, VariantResult } from "./engine_interface";

export class Cancelled extends Error {}

export class EngineQueue {
  private running: { stop: (error: Error) => void } | null = null;
  private readonly waiting: { urgent: boolean; begin: () => void; stop: (error: Error) => void }[] = [];

  constructor(private readonly engine: VariantEngine) {}

  get busy(): boolean {
    return this.running !== null;
  }

  // `urgent`: before the waiting cells of maps.
  run(request: VariantRequest, urgent: boolean, progress?: Progress): Promise<VariantResult> {
    return new Promise((resolve, reject) => {
      const one = { urgent, begin: () => this.begin(one, request, resolve, progress), stop: reject };
      const at = urgent ? this.waiting.findIndex((other) => !other.urgent) : -1;
      this.waiting.splice(at < 0 ? this.waiting.length : at, 0, one);
      this.next();
    });
  }

  // Ends the current run and all waiting ones with Cancelled.
  cancel(): void {
    const all = [...(this.running ? [this.running] : []), ...this.waiting.splice(0)];
    if (this.running) this.engine.cancel();
    this.running = null;
    for (const one of all) one.stop(new Cancelled());
  }

  private begin(one: { stop: (error: Error) => void }, request: VariantRequest, resolve: (result: VariantResult) => void, progress?: Progress): void {
    this.running = one;
    const mine = (): boolean => this.running === one; // not after cancel()
    this.engine
      .run(request, (phase, fraction) => mine() && progress?.(phase, fraction))
      .then(
        (result) => mine() && resolve(result),
        (error: unknown) => mine() && one.stop(error instanceof Error ? error : new Error(String(error))),
      )
      .finally(() => {
        if (!mine()) return;
        this.running = null;
        this.next();
      });
  }
  private next(): void {
    if (!this.running) this.waiting.shift()?.begin();
  }
}

// Computes the newest of frequent requests: one at a time, and those in between are omitted.
export class Latest<T, R> {
  private pending: { request: T } | null = null;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private busy = false;

  constructor(
    private readonly compute: (request: T) => Promise<R>,
    private readonly done: (request: T, result: R | Error) => void,
    private readonly pause: number, // after a change [ms]
  ) {}

  request(request: T): void {
    this.pending = { request };
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.start(), this.pause);
  }
  // Forgets a request that has not begun.
  drop(): void {
    clearTimeout(this.timer);
    this.pending = null;
  }

  private async start(): Promise<void> {
    if (this.busy || !this.pending) return;
    const { request } = this.pending;
    this.pending = null;
    this.busy = true;
    const result = await this.compute(request).catch((error: unknown) => (error instanceof Error ? error : new Error(String(error))));
    this.busy = false;
    this.done(request, result);
    if (this.pending) void this.start();
  }
}
