// MCAP files between Grapnel and @mcap/core: the export of a run is read, and a log that it writes is compared.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import { before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { grapnel, scenario, scratch } from "./browser.mjs";

const modules = process.env.GRAPNEL_WEB_MODULES ?? path.join(path.dirname(fileURLToPath(import.meta.url)), "..");
const require = createRequire(path.join(modules, "package.json"));
const { McapIndexedReader, McapStreamReader, McapWriter, TempBuffer } = require("@mcap/core");
const { decompress } = require("fzstd");

const decompressHandlers = { zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size))) };
const text = (bytes) => new TextDecoder().decode(bytes);

const folder = scratch();
const run = path.join(folder, "run");
let columns; // of timeseries.csv
before(() => {
  grapnel(["run", scenario("thesis/open-loop-case-1.yaml"), "-o", run, "--quiet", "--set", "output.interval=0.25"]);
  grapnel(["export", run, "--csv", "--mcap"]);
  const [head, ...lines] = readFileSync(path.join(run, "timeseries.csv"), "utf8").trim().split("\n");
  const rows = lines.map((line) => line.split(","));
  columns = Object.fromEntries(head.split(",").map((name, i) => [name, rows.map((row) => Number(row[i]))]));
});

test("an export is valid to the last checksum, and has the numbers of timeseries.csv", async () => {
  const bytes = readFileSync(path.join(run, "timeseries.mcap"));
  const stream = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  stream.append(bytes);
  const counts = {};
  for (let record; (record = stream.nextRecord()); ) counts[record.type] = (counts[record.type] ?? 0) + 1;
  assert.ok(stream.done());

  const reader = await McapIndexedReader.Initialize({ readable: new TempBuffer(bytes), decompressHandlers });
  assert.equal(reader.statistics.messageCount, BigInt(counts.Message));
  assert.equal(reader.statistics.channelCount, reader.channelsById.size);
  assert.ok(reader.chunkIndexes.length > 1);
  const samples = columns["time [s]"].length;
  let n = 0;
  for await (const message of reader.readMessages({ topics: ["/base"] })) {
    const one = JSON.parse(text(message.data));
    assert.equal(one.time, columns["time [s]"][n]);
    assert.equal(Number(message.logTime), Math.round(1e9 * one.time));
    for (const c of ["x", "y", "z"]) assert.equal(one.position[c], columns[`base/position/${c} [m]`][n]);
    ++n;
  }
  assert.equal(n, samples);
  n = 0;
  for await (const message of reader.readMessages({ topics: ["/tf"] })) {
    const base = JSON.parse(text(message.data)).transforms.find((one) => one.child_frame_id === "base");
    assert.equal(base.parent_frame_id, "world");
    assert.equal(base.timestamp.sec + 1e-9 * base.timestamp.nsec, Number(message.logTime) / 1e9);
    for (const c of ["w", "x", "y", "z"]) assert.equal(base.rotation[c], columns[`base/quaternion_wxyz/${c} [1]`][n]);
    ++n;
  }
  assert.equal(n, samples);
  const schemas = [...reader.schemasById.values()].map((one) => one.name);
  assert.ok(schemas.includes("foxglove.FrameTransforms"));
  for (const one of reader.schemasById.values()) JSON.parse(text(one.data));
});

// Messages of sensor_msgs/Imu, shortened, in CDR.
const kImu = `std_msgs/Header header
geometry_msgs/Vector3 angular_velocity
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
`;

function imu(time, rate, little) {
  const view = new DataView(new ArrayBuffer(4 + 40));
  view.setUint8(1, little ? 1 : 0);
  view.setInt32(4, Math.floor(time), little);
  view.setUint32(8, Math.round(1e9 * (time - Math.floor(time))), little);
  view.setUint32(12, 2, little); // "i" and its end
  view.setUint8(16, "i".charCodeAt(0));
  rate.forEach((value, i) => view.setFloat64(4 + 16 + 8 * i, value, little));
  return new Uint8Array(view.buffer);
}

test("a log that @mcap/core writes is read with the right times, units and axes", async () => {
  for (const useChunks of [true, false]) {
    const out = new TempBuffer();
    const writer = new McapWriter({ writable: out, useChunks, chunkSize: 2000 });
    await writer.start({ profile: "ros2", library: "test" });
    const data = new TextEncoder().encode(kImu);
    const schemaId = await writer.registerSchema({ name: "sensor_msgs/msg/Imu", encoding: "ros2msg", data });
    const channel = { topic: "/imu/data", schemaId, messageEncoding: "cdr", metadata: new Map([["a", "b"]]) };
    const channelId = await writer.registerChannel(channel);
    await writer.addAttachment({ name: "notes", logTime: 0n, createTime: 0n, mediaType: "text/plain", data });
    const times = columns["time [s]"];
    const end = times.findIndex((t) => t >= 19); // before the impact
    for (let i = 0; i < end; ++i) {
      const rate = ["x", "y", "z"].map((c) => (180 / Math.PI) * columns[`base/angular_velocity/${c} [rad/s]`][i]);
      const stamp = 1000 + times[i];
      const logTime = BigInt(Math.round(1e9 * (stamp + 0.04)));
      await writer.addMessage({ channelId, sequence: i, logTime, publishTime: logTime, data: imu(stamp, rate, i % 2 === 0) });
    }
    await writer.end();
    const log = path.join(folder, "log.mcap");
    writeFileSync(log, out.get());
    const map = path.join(folder, "map.yaml");
    const mapping = (column, offset) => `time: {column: ${column}, offset: ${offset}}
quantities:
  - {run: base/angular_velocity, log: /imu/data.angular_velocity, unit: deg/s, uncertainty: 1e-6}
`;
    writeFileSync(map, mapping("header.stamp", -1000));
    const compared = path.join(folder, "compared");
    grapnel(["compare", run, log, "--map", map, "-o", compared, "--quiet"]);
    const [q] = JSON.parse(readFileSync(path.join(compared, "comparison.json"), "utf8")).quantities;
    assert.equal(q.compared, end);
    assert.ok(q.rms < 1e-10, `${q.rms}`);
    writeFileSync(map, mapping("log_time", -1000.04));
    grapnel(["compare", run, log, "--map", map, "-o", compared, "--quiet"]);
    writeFileSync(map, mapping("log_time", -1000)); // 40 ms late
    grapnel(["compare", run, log, "--map", map, "-o", compared, "--quiet"], [1]);
  }
});

test("an export agrees with its run exactly", () => {
  const compared = path.join(folder, "self");
  grapnel(["compare", run, path.join(run, "timeseries.mcap"), "-o", compared, "--quiet"]);
  const { quantities } = JSON.parse(readFileSync(path.join(compared, "comparison.json"), "utf8"));
  assert.ok(quantities.length > 40);
  for (const q of quantities) assert.ok(q.rms < 1e-30, q.name); // quaternions: 1e-33
});
