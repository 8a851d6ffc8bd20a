// A synthetic campaign for tests: campaign.json as specified in docs/formats/campaign.md, and a sample of its rows. The
// numbers of a case are functions of k.

const kCases = 200;

export function packed(array) {
  return Buffer.from(array.buffer, array.byteOffset, array.byteLength).toString("base64");
}

const rows = Array.from({ length: kCases }, (_, k) => {
  const mass = 8 + 4 * ((k * 0.618034) % 1);
  const rate = 0.1 * ((k * 0.754878) % 1);
  const failed = k % 50 === 13;
  const impulse = failed ? NaN : 0.04 * mass + rate;
  return { mass, rate, failed, impulse, captured: failed ? NaN : 1, success: !failed && impulse < 0.55 };
});

function described(name, unit, values) {
  const numbers = values.filter(Number.isFinite).sort((a, b) => a - b);
  const [begin, end] = [numbers[0], numbers.at(-1)];
  const counts = new Array(10).fill(0);
  const successes = new Array(10).fill(0);
  values.forEach((v, k) => {
    if (!Number.isFinite(v)) return;
    const bin = end > begin ? Math.min(9, Math.floor(((v - begin) / (end - begin)) * 10)) : 0;
    ++counts[bin];
    successes[bin] += Number(rows[k].success);
  });
  const quantiles = [0.05, 0.5, 0.95].map((probability) => ({ probability, value: numbers[Math.round(probability * (numbers.length - 1))], lower: null, upper: null }));
  const mean = numbers.reduce((a, b) => a + b, 0) / numbers.length;
  return { name, unit, description: `what ${name} is`, count: numbers.length, missing: kCases - numbers.length, mean, mean_error: 0.01, standard_deviation: 0.1, least: begin, largest: end, quantiles, histogram: { begin, end, counts, successes, below: 0, above: 0 } };
}

// `name`: of the campaign; may be hostile.
export function campaignStatistics(name = "made up", kind = "campaign") {
  const success = rows.filter((r) => r.success).length;
  const p = success / kCases;
  const statistics = {
    schema: "grapnel-campaign-report/1",
    version: "0.7.0",
    campaign: { name, description: "for tests", file: "studies/made up.yaml", sha256: "a".repeat(64), seed: "7", sampling: "sobol", simulate: "impact", plan: "nominal", cases: kCases, total: kCases },
    rows: kCases,
    counts: { ok: 196, failed: 4, unreachable: 0, success },
    success: { estimate: p, lower: p - 0.03, upper: Math.min(1, p + 0.02), confidence: 0.95 },
    criteria: [
      { name: "captured", text: "captured", met: 196, estimate: 0.98, lower: 0.95, upper: 0.992, only_this: 4, reads: ["captured"], limits: [] },
      { name: "soft", text: "abs(impulse) < 0.55", met: 188, estimate: 0.94, lower: 0.9, upper: 0.965, only_this: 12, reads: ["impulse"], limits: [{ name: "impulse", at_most: 0.55, magnitude: true }] },
    ],
    inputs: [described("mass", "kg", rows.map((r) => r.mass)), described("rate", "rad/s", rows.map((r) => r.rate))],
    columns: [described("energy", "J", rows.map((r) => 2 * r.impulse)), described("captured", "1", rows.map((r) => r.captured)), described("impulse", "N s", rows.map((r) => r.impulse))],
    warnings: [],
    sensitivity: {
      inputs: ["mass", "rate"],
      measures: [
        { name: "success", unit: "1", count: kCases, first_order: [0.6, 0.1], error: [0.05, 0.04], rank_correlation: [-0.5, -0.2] },
        { name: "impulse", unit: "N s", count: 196, first_order: [0.7, 0.25], error: [0.05, 0.04], rank_correlation: [0.8, 0.4] },
      ],
      left_out: 0,
    },
    worst: [{ by: "impulse", unit: "N s", direction: "largest", magnitude: true, cases: [2, 5, 7].map((index) => ({ index, value: 0.6, success: false, inputs: [11, 0.05], replay: `grapnel campaign 'studies/made up.yaml' --only ${index}` })) }],
    reasons: [{ status: "failed", reason: "no convergence", count: 4, examples: [{ index: 13, reason: "no convergence", replay: "grapnel campaign 'studies/made up.yaml' --only 13" }] }],
    reasons_left_out: 0,
    text: "name: made up\n",
  };
  for (const input of statistics.inputs) {
    const { begin, end } = input.histogram;
    const at = (k) => begin + ((end - begin) * k) / 4;
    input.success_by = { from: [0, 1, 2, 3].map(at), to: [1, 2, 3, 4].map(at), trials: [50, 50, 50, 50], successes: [50, 48, 45, 40] };
  }
  if (kind === "map") {
    const successes = [100, 99, 97, 90, 98, 95, 80, 50, 90, 70, 30, 0];
    statistics.success_map = {
      axes: [
        { name: "relative_speed", unit: "m/s", description: "", is_numeric: true, values: [0, 0.1, 0.2] },
        { name: "targets.target-1.mass", unit: "kg", description: "", is_numeric: true, values: [5, 10, 20, 40] },
      ],
      trials: successes.map(() => 100),
      ok: successes.map(() => 100),
      successes,
      unmet: [{ criterion: "captured", counts: successes.map((s) => (s < 60 ? 100 - s : 0)) }, { criterion: "soft", counts: successes.map((s) => 100 - s) }],
      deciding: successes.map((s) => (s === 100 ? null : s < 60 ? "captured" : "soft")),
    };
    statistics.sensitivity.groups = [{ name: "mass", design: false, inputs: ["mass"] }, { name: "rate", design: false, inputs: ["rate"] }, { name: "relative_speed", design: true, inputs: [] }];
    for (const m of statistics.sensitivity.measures) Object.assign(m, { of: m.name === "success" ? "success" : "column", unexplained: 0.12, groups: { first_order: [...m.first_order, 0.9], error: [...m.error, 0.01], rank_correlation: [...m.rank_correlation, -0.7] } });
  }
  return statistics;
}

// CampaignData of src/data.ts.
export function campaignData(kind = "campaign", name = "made up") {
  const statistics = campaignStatistics(name, kind);
  const column = (of, values) => ({ name: of.name, unit: of.unit, description: of.description, data: packed(Float32Array.from(values)) });
  const sample = {
    rows: kCases,
    case: packed(Float64Array.from(rows, (_, k) => k)),
    drawn: packed(new Uint8Array(kCases).fill(1)),
    status: packed(Uint8Array.from(rows, (r) => Number(r.failed))),
    statuses: ["ok", "failed", "unreachable"],
    success: packed(Uint8Array.from(rows, (r) => Number(r.success))),
    reasons: rows.flatMap((r, k) => (r.failed ? [[k, "no convergence"]] : [])),
    design: [],
    inputs: [column(statistics.inputs[0], rows.map((r) => r.mass)), column(statistics.inputs[1], rows.map((r) => r.rate))],
    columns: [column(statistics.columns[0], rows.map((r) => 2 * r.impulse)), column(statistics.columns[1], rows.map((r) => r.captured)), column(statistics.columns[2], rows.map((r) => r.impulse))],
  };
  // Every point of the design has 16 or 17 of the rows.
  if (kind === "map") {
    const point = rows.map((_, k) => k % 12);
    sample.design = statistics.success_map.axes.map((axis, a) => column(axis, point.map((p) => axis.values[a === 0 ? Math.floor(p / 4) : p % 4])));
  }
  return { statistics, command: "grapnel campaign 'studies/made up.yaml' --only {K}", rows: kCases, sample, notes: [], saved: [2, 13] };
}
