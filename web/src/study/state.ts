// The selection on the page: one point, and a filter; shared by all its charts. No DOM.
import type { StudyTable } from "./field";
import { type Filter, type Range, count, isActive, keptPoints, kNoFilter } from "./filter";

export class StudyState {
  private chosen: number | null = null;
  private current: Filter = kNoFilter;
  private mask: Uint8Array;
  private readonly onSelect = new Set<() => void>();
  private readonly onFilter = new Set<() => void>();

  constructor(readonly table: StudyTable) {
    this.mask = keptPoints(table, kNoFilter);
  }

  get selected(): number | null {
    return this.chosen;
  }
  select(point: number | null): void {
    const valid = point !== null && point >= 0 && point < this.table.size ? point : null;
    if (valid === this.chosen) return;
    this.chosen = valid;
    for (const listener of this.onSelect) listener();
  }

  get filter(): Filter {
    return this.current;
  }
  get kept(): Uint8Array {
    return this.mask;
  }
  get filtered(): boolean {
    return isActive(this.current);
  }
  get keptCount(): number {
    return count(this.mask);
  }
  setFilter(change: Partial<Filter>): void {
    this.current = { ...this.current, ...change };
    this.mask = keptPoints(this.table, this.current);
    for (const listener of this.onFilter) listener();
  }
  // One range per column; null takes it away.
  setRange(key: string, range: Range | null): void {
    const ranges = this.current.ranges.filter((r) => r.field.key !== key);
    this.setFilter({ ranges: range ? [...ranges, range] : ranges });
  }

  listenSelect(listener: () => void): void {
    this.onSelect.add(listener);
  }
  listenFilter(listener: () => void): void {
    this.onFilter.add(listener);
  }
}
