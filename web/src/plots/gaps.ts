// Lines that are interrupted at gaps: an undefined sample is inserted before each sample that follows a gap.

export interface Gapped {
  time: Float64Array;
  values: (samples: Float64Array) => Float64Array; // of these times
}

// `breaks` are the indices of samples that follow a gap.
export function gapped(time: Float64Array, breaks: number[]): Gapped {
  const after = new Set(breaks.filter((i) => i > 0 && i < time.length));
  const inserted = (samples: Float64Array, between: (i: number) => number): Float64Array => {
    const out: number[] = [];
    samples.forEach((sample, i) => {
      if (after.has(i)) out.push(between(i));
      out.push(sample);
    });
    return Float64Array.from(out);
  };
  return {
    time: inserted(time, (i) => (time[i - 1] + time[i]) / 2),
    values: (samples) => inserted(samples, () => NaN),
  };
}
