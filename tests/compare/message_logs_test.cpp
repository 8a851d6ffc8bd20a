// Logs of messages: MCAP and rosbag, in all encodings and compressions, truncated and damaged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "compare/message_files.hpp"
#include "grapnel/compare/compare_log.hpp"
#include "grapnel/compare/mcap_export.hpp"
#include "grapnel/compare/measured_log.hpp"
#include "grapnel/compare/message_columns.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace message_logs_test {

using namespace message_files;  // NOLINT: the file's words
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using Kind = EncodedMessage::Kind;

const std::string kLine(80, '=');
// As rosbag and rosbag2 write it: the message, then the types that it contains.
const std::string kImu = R"(# An inertial sensor
Header header

float64 GRAVITY=9.81   # a constant
geometry_msgs/Quaternion orientation
float64[3] orientation_covariance # Row major
geometry_msgs/Vector3 angular_velocity
uint8[] raw
string note
float32 temperature
)" + kLine + R"(
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
)" + kLine + R"(
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
)" + kLine + R"(
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
)";
const std::string kImu2 = R"(std_msgs/Header header
float64 GRAVITY=9.81
geometry_msgs/Quaternion orientation
float64[3] orientation_covariance
geometry_msgs/msg/Vector3 angular_velocity
uint8[<=16] raw
string<=10 note "none"
float32 temperature 20.0
)" + kLine + R"(
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
)" + kLine + R"(
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
)" + kLine + R"(
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
)";
const std::string kJoints = "Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n" + kLine +
                            "\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

constexpr std::uint64_t kSecond = 1'000'000'000;

double rate(int k, int axis) { return std::sin(0.37 * k + axis) + 1e-7 * k; }

std::string imu(int k, Kind kind) {
  EncodedMessage m(kind);
  if (kind == Kind::ros1) m.number(static_cast<std::uint64_t>(k), 4);
  m.number(100 + static_cast<std::uint64_t>(k) / 10, 4).number(static_cast<std::uint64_t>(k) % 10 * kSecond / 10, 4);
  m.text(k % 2 == 0 ? "imu" : "imu_link");
  for (const double q : {0.1, 0.2, 0.3, 0.4}) m.real(q + k);
  for (int i = 0; i < 3; ++i) m.real(10.0 * k + i);
  for (int i = 0; i < 3; ++i) m.real(rate(k, i));
  m.number(static_cast<std::uint64_t>(k % 4), 4);
  for (int i = 0; i < k % 4; ++i) m.number(static_cast<std::uint64_t>(i), 1);
  m.text("note " + std::to_string(k));
  m.number(std::bit_cast<std::uint32_t>(20.5f + static_cast<float>(k)), 4);
  return m.bytes();
}

std::string imu_json(int k) {
  std::ostringstream out;
  out.precision(17);
  out << R"({"header":{"stamp":{"sec":)" << 100 + k / 10 << R"(,"nsec":)" << k % 10 * (kSecond / 10)
      << R"(},"frame_id":"imu"},"orientation":{"x":)" << 0.1 + k << R"(,"y":)" << 0.2 + k << R"(,"z":)" << 0.3 + k
      << R"(,"w":)" << 0.4 + k << R"(},"orientation_covariance":[)" << 10.0 * k << "," << 10.0 * k + 1 << ","
      << 10.0 * k + 2 << R"(],"angular_velocity":{"x":)" << rate(k, 0) << R"(,"y":)" << rate(k, 1) << R"(,"z":)"
      << rate(k, 2) << R"(},"temperature":)" << 20.5 + k << "}";
  return out.str();
}

const std::vector<std::string> kRequested{"/imu/data.angular_velocity.y",
                                          "imu/data.orientation",
                                          "/imu/data.orientation_covariance[2]",
                                          "/imu/data.temperature",
                                          "header.stamp",
                                          "log_time",
                                          "publish_time"};

std::vector<double> values_of(const MessageLog& log, const std::string& name) {
  const auto column = find_column(log.datasets, name);
  if (!column || log.datasets[column->dataset].rows == 0) return {};
  const LogDataset& one = log.datasets[column->dataset];
  EXPECT_EQ(one.obstacle, "") << name;
  EXPECT_EQ(one.values.size(), one.rows * one.width) << name;
  return one.values;
}

// The columns of n messages at 10 Hz, which were logged 5 ms and published 2 ms after their stamps.
void expect_imu(const MessageLog& log, std::size_t n, bool has_publish_time) {
  EXPECT_THAT(log.warnings, ElementsAre());
  const auto y = values_of(log, "/imu/data.angular_velocity.y"), stamp = values_of(log, "imu/data.header.stamp"),
             temperature = values_of(log, "imu/data.temperature"), q = values_of(log, "imu/data.orientation"),
             c = values_of(log, "imu/data.orientation_covariance[2]"), logged = values_of(log, "imu/data.log_time"),
             published = values_of(log, "imu/data.publish_time");
  ASSERT_EQ(y.size(), n);
  ASSERT_EQ(stamp.size(), n);
  ASSERT_EQ(temperature.size(), n);
  ASSERT_EQ(q.size(), 4 * n);
  ASSERT_EQ(c.size(), n);
  ASSERT_EQ(logged.size(), n);
  ASSERT_EQ(published.size(), has_publish_time ? n : 0);
  for (std::size_t i = 0; i < n; ++i) {
    const int k = static_cast<int>(i);
    EXPECT_EQ(y[i], rate(k, 1));
    EXPECT_NEAR(stamp[i], 100 + 0.1 * k, 1e-12);
    EXPECT_NEAR(logged[i] - stamp[i], 0.005, 1e-12);
    if (has_publish_time) {
      EXPECT_NEAR(published[i] - stamp[i], 0.002, 1e-12);
    }
    EXPECT_EQ(temperature[i], 20.5 + k);
    EXPECT_EQ(q[4 * i + 3], 0.4 + k);
    EXPECT_EQ(c[i], 10.0 * k + 2);
  }
}

std::uint64_t stamp_of(int k) { return 100 * kSecond + static_cast<std::uint64_t>(k) * kSecond / 10; }

std::string mcap_imu(const std::string& encoding, Kind kind, int n, const std::string& compression, bool chunked) {
  const bool is_json = encoding == "json";
  const std::string schema = is_json              ? mcap_schema(7, "Imu", "jsonschema", R"({"type":"object"})")
                             : kind == Kind::ros1 ? mcap_schema(7, "sensor_msgs/Imu", "ros1msg", kImu)
                                                  : mcap_schema(7, "sensor_msgs/msg/Imu", "ros2msg", kImu2);
  std::string records = schema + mcap_channel(3, 7, "/imu/data", encoding) + mcap_channel(4, 0, "/other", "protobuf");
  std::string out;
  for (int k = 0; k < n; ++k) {
    records += mcap_message(3, stamp_of(k) + 5'000'000, stamp_of(k) + 2'000'000, is_json ? imu_json(k) : imu(k, kind));
    records += mcap_message(4, stamp_of(k), 0, "no one knows");
    if (chunked && k % 7 == 6) out += mcap_chunk(compression, std::exchange(records, ""));
  }
  return mcap_file(out + (chunked && !records.empty() ? mcap_chunk(compression, records) : records));
}

TEST(MessageLogs, McapInAllEncodingsAndCompressions) {
  const std::vector<std::pair<std::string, Kind>> encodings{
      {"ros1", Kind::ros1}, {"cdr", Kind::little_cdr}, {"cdr", Kind::big_cdr}, {"json", Kind::ros1}};
  for (const auto& [encoding, kind] : encodings) {
    SCOPED_TRACE(encoding);
    for (const char* compression : {"", "lz4", "zstd"})
      expect_imu(read_mcap_log(mcap_imu(encoding, kind, 40, compression, true), kRequested), 40, true);
    expect_imu(read_mcap_log(mcap_imu(encoding, kind, 40, "", false), kRequested), 40, true);
  }
}

std::string bag_imu(const std::string& compression, int n, bool is_closed, std::size_t padding = 4027) {
  std::string file = bag_begin(is_closed, padding), records;
  const std::string connections = bag_connection(0, "/imu/data", "sensor_msgs/Imu", kImu);
  for (int k = 0; k < n; ++k) {
    records += (k % 10 == 0 ? connections : "") + bag_message(0, stamp_of(k) + 5'000'000, imu(k, Kind::ros1));
    if (k % 10 == 9) file += bag_chunk(compression, std::exchange(records, "")) + bag_record(4, {}, "an index");
  }
  // The last chunk of a bag that was not closed has no size yet.
  if (!is_closed) return file + bag_record(5, {{"compression", "none"}, {"size", bytes_of(0, 4)}}, "") + records;
  return file + bag_chunk(compression, records) + connections + bag_record(6, {}, "the places of chunks");
}

TEST(MessageLogs, RosbagInAllCompressionsAndNotClosed) {
  for (const char* compression : {"none", "lz4", "bz2"})
    expect_imu(read_bag_log(bag_imu(compression, 43, true), kRequested), 43, false);
  MessageLog open = read_bag_log(bag_imu("none", 43, false), kRequested);
  EXPECT_THAT(open.warnings, ElementsAre(HasSubstr("was not closed")));
  open.warnings.clear();
  expect_imu(open, 43, false);
  // The end of the last message is lost.
  std::string cut = bag_imu("none", 43, false);
  cut.resize(cut.size() - 20);
  open = read_bag_log(cut, kRequested);
  EXPECT_THAT(open.warnings, ElementsAre(HasSubstr("the log ends at byte " + std::to_string(cut.size()))));
  open.warnings.clear();
  expect_imu(open, 42, false);
}

std::string joints(int k, const std::vector<std::string>& names) {
  EncodedMessage m(Kind::ros1);
  m.number(0, 4).number(static_cast<std::uint64_t>(k), 4).number(0, 4).text("");
  m.number(names.size(), 4);
  for (const std::string& name : names) m.text(name);
  for (const double factor : {1.0, 100.0}) {
    m.number(names.size(), 4);
    for (const std::string& name : names) m.real(factor * (k + (name == "elbow" ? 0.5 : 0.25)));
  }
  return m.bytes();
}

TEST(MessageLogs, JointsByNameHaveTheSamplesOfTheirMessages) {
  // Two publishers: one with all joints in alternating order, one with the gripper only.
  std::string file = bag_begin() + bag_connection(0, "/joint_states", "sensor_msgs/JointState", kJoints);
  for (int k = 0; k < 10; ++k) {
    file += bag_message(0, static_cast<std::uint64_t>(k) * kSecond,
                        joints(k, k % 2 == 0 ? std::vector<std::string>{"elbow", "wrist"}
                                             : std::vector<std::string>{"wrist", "elbow"}));
    file += bag_message(0, static_cast<std::uint64_t>(k) * kSecond + 1, joints(k, {"gripper"}));
  }
  const MessageLog log =
      read_bag_log(file, {"/joint_states.position[elbow]", "/joint_states.velocity[elbow]", "/joint_states.position[0]",
                          "/joint_states.position[hand]", "/joint_states.position", "header.stamp"});
  const auto elbow = values_of(log, "/joint_states.position[elbow]"), all = values_of(log, "/joint_states.position[0]"),
             velocity = values_of(log, "/joint_states.velocity[elbow]"),
             stamp = values_of(log, "joint_states.velocity[elbow].header.stamp");
  ASSERT_EQ(elbow.size(), 10u);
  ASSERT_EQ(velocity.size(), 10u);
  ASSERT_EQ(stamp.size(), 10u);
  EXPECT_EQ(all.size(), 20u);
  for (std::size_t k = 0; k < 10; ++k) {
    EXPECT_EQ(elbow[k], static_cast<double>(k) + 0.5);
    EXPECT_EQ(velocity[k], 100 * elbow[k]);
    EXPECT_EQ(stamp[k], static_cast<double>(k));
  }
  EXPECT_FALSE(find_column(log.datasets, "/joint_states.position[hand]"));
  const auto varying = find_column(log.datasets, "/joint_states.position");
  ASSERT_TRUE(varying);
  EXPECT_THAT(log.datasets[varying->dataset].obstacle, HasSubstr("select elements"));
}

TEST(MessageLogs, ElementsOfListsByNameAndSamplesInOrderOfTime) {
  // Transforms of two frames; the second chunk is older.
  const auto message = [](int k) {
    return R"({"transforms":[{"child_frame_id":"base","header":{"stamp":{"sec":1,"nsec":0}},"translation":{"x":-1}},)"
           R"({"child_frame_id":"debris.1","header":{"stamp":{"sec":)" +
           std::to_string(k) + R"(,"nanosec":500000000}},"translation":{"x":)" + std::to_string(k) + "}}]}";
  };
  const std::string declared = mcap_channel(1, 0, "tf", "json");
  std::string late, early;
  for (int k = 0; k < 4; ++k) early += mcap_message(1, static_cast<std::uint64_t>(k), 0, message(k));
  for (int k = 4; k < 8; ++k) late += mcap_message(1, static_cast<std::uint64_t>(k), 0, message(k));
  const MessageLog log = read_mcap_log(mcap_file(mcap_chunk("", declared + late) + mcap_chunk("", early)),
                                       {"/tf.transforms[debris.1].translation.x", "header.stamp"});
  EXPECT_THAT(values_of(log, "/tf.transforms[debris.1].translation.x"), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  EXPECT_THAT(values_of(log, "tf.transforms[debris.1].header.stamp"), testing::Contains(2.5));
}

// The message of the error, or of the warnings.
std::string complaint(const std::string& file, const std::vector<std::string>& requested = kRequested) {
  try {
    const MessageLog log = file[0] == '#' ? read_bag_log(file, requested) : read_mcap_log(file, requested);
    std::string text;
    for (const std::string& warning : log.warnings) text += warning;
    return text;
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(MessageLogs, DamageIsReportedWithItsPlace) {
  const std::string good = mcap_imu("cdr", Kind::little_cdr, 20, "zstd", true);
  EXPECT_EQ(complaint(good), "");
  const std::size_t chunk = mcap_begin().size();
  std::string bad = good;
  bad[chunk + 9 + 24] ^= 1;  // its checksum
  EXPECT_THAT(complaint(bad), AllOf(HasSubstr("byte " + std::to_string(chunk)), HasSubstr("checksum")));
  bad = good;
  bad[chunk + 9 + 20] ^= 0x40;  // its size
  EXPECT_THAT(complaint(bad), AllOf(HasSubstr("byte " + std::to_string(chunk)), HasSubstr("at most 1073741824")));
  bad = good;
  bad[chunk + 9 + 17] ^= 0x40;
  EXPECT_THAT(complaint(bad), HasSubstr("decompressed bytes, must have"));
  bad = good;
  bad[chunk + 9 + 28 + 4] = 'x';  // the compression
  EXPECT_THAT(complaint(bad), HasSubstr("unknown compression 'xstd'"));
  EXPECT_THAT(complaint(good.substr(0, good.size() / 2)), HasSubstr("the log ends at byte"));
  EXPECT_THAT(complaint(good + "tail"), HasSubstr("the log does not end with the bytes of an MCAP file"));
  // A message that ends too early, an unknown channel, an unsupported encoding.
  const std::string declared = mcap_schema(7, "Imu", "ros2msg", kImu2) + mcap_channel(3, 7, "/imu/data", "cdr");
  const std::size_t place = mcap_begin().size() + declared.size();
  EXPECT_THAT(complaint(mcap_file(declared + mcap_message(3, 0, 0, imu(1, Kind::big_cdr).substr(0, 60)))),
              AllOf(HasSubstr("byte " + std::to_string(place)),
                    HasSubstr("'/imu/data': 3 elements of 'orientation_covariance' exceed it")));
  EXPECT_THAT(complaint(mcap_file(declared + mcap_message(9, 0, 0, ""))), HasSubstr("unknown channel 9"));
  EXPECT_THAT(complaint(mcap_file(mcap_schema(7, "Imu", "protobuf", "") + mcap_channel(3, 7, "/imu/data", "protobuf"))),
              HasSubstr("topic '/imu/data' has messages in 'protobuf'"));
  EXPECT_THAT(
      complaint(mcap_file(mcap_schema(7, "Imu", "ros2msg", "Vector3 v") + mcap_channel(3, 7, "/imu/data", "cdr"))),
      HasSubstr("does not contain the type 'Vector3'"));
  EXPECT_THAT(complaint("MCAP" + good), HasSubstr("byte 0: an MCAP file begins with"));
  EXPECT_THAT(complaint("#ROSBAG V1.2\n"), HasSubstr("another version than 2.0"));
  EXPECT_THAT(complaint(bag_begin() + bag_message(5, 0, "")),
              AllOf(HasSubstr("byte " + std::to_string(bag_begin().size())), HasSubstr("unknown connection 5")));
}

TEST(MessageLogs, TypesThatContainThemselvesAndHugeArraysEnd) {
  const std::string requested = "/imu/data.a.a.a.x";
  const auto file = [](const std::string& definition, const std::string& data) {
    return mcap_file(mcap_schema(7, "p/A", "ros1msg", definition) + mcap_channel(3, 7, "/imu/data", "ros1") +
                     mcap_message(3, 0, 0, data));
  };
  EXPECT_THAT(complaint(file("p/A a\nfloat64 x\n", std::string(100, 'x')), {requested}),
              HasSubstr("nested too deeply"));
  // Structures without bytes: 2^40 of them, and four billion in an array.
  std::string many = "p/B0 a\n";
  for (int i = 0; i < 20; ++i) {
    const std::string next = "p/B" + std::to_string(i + 1);
    many += "====\nMSG: p/B" + std::to_string(i) + "\n" + next + " a\n" + next + " b\n" + next + " c\n" + next + " d\n";
  }
  many += "====\nMSG: p/B20\n";
  EXPECT_THAT(complaint(file(many, ""), {requested}), HasSubstr("too many fields"));
  EXPECT_THAT(complaint(file("p/B[] a\nfloat64 x\n====\nMSG: p/B\n", std::string(100, '\xff')), {requested}),
              HasSubstr("exceed it"));
  EXPECT_THAT(complaint(file("float64[] a\n", std::string(100, '\xff')), {"/imu/data.a"}), HasSubstr("exceed it"));
  EXPECT_THAT(complaint(file("string a\nfloat64 x\n", std::string(100, '\xff')), {"/imu/data.x"}),
              HasSubstr("exceeds it"));
}

// Sizes that a small file can state, and that exceed the memory.
TEST(MessageLogs, LargeColumnsAndSchemasCauseErrors) {
  std::string wide = R"({"x":1,"a":[0)";
  for (int i = 1; i < 150'000; ++i) wide += ",0";
  std::string records = mcap_channel(1, 0, "/imu/data", "json");
  for (int k = 0; k < 2000; ++k) records += mcap_message(1, 0, 0, R"({"x":1})");
  const std::vector<std::string> requested{"/imu/data.x", "/imu/data.a"};
  EXPECT_EQ(complaint(mcap_file(records), requested), "");
  EXPECT_THAT(complaint(mcap_file(records + mcap_message(1, 0, 0, wide + "]}")), requested),
              AllOf(HasSubstr("150000 numbers in each of 2000 messages"), HasSubstr("268435456")));
  const std::string schema(kLargestSchema + 1, '#');
  EXPECT_THAT(complaint(mcap_file(mcap_schema(7, "p/A", "ros1msg", schema))),
              AllOf(HasSubstr("byte " + std::to_string(mcap_begin().size())), HasSubstr("at most 16777216")));
  EXPECT_THAT(complaint(bag_begin() + bag_connection(0, "/imu/data", "p/A", schema)), HasSubstr("at most 16777216"));
}

TEST(MessageLogs, BytesHaveASignInRos1Only) {
  const auto value = [](const std::string& encoding, const std::string& schema_encoding, Kind kind) {
    EncodedMessage m(kind);
    m.number(0xff, 1).number(0xff, 1).number(0xff, 1);
    const MessageLog log =
        read_mcap_log(mcap_file(mcap_schema(7, "p/A", schema_encoding, "byte b\nchar c\nint8 i\n") +
                                mcap_channel(3, 7, "/t", encoding) + mcap_message(3, 0, 0, m.bytes())),
                      {"/t.b", "/t.c", "/t.i"});
    return std::vector<double>{values_of(log, "/t.b").at(0), values_of(log, "/t.c").at(0),
                               values_of(log, "/t.i").at(0)};
  };
  EXPECT_THAT(value("ros1", "ros1msg", Kind::ros1), ElementsAre(-1, 255, -1));
  EXPECT_THAT(value("cdr", "ros2msg", Kind::little_cdr), ElementsAre(255, 255, -1));
}

// Every prefix, and every byte changed: samples are those of the whole file, or an error states the damage.
TEST(MessageLogs, TruncatedAndChangedFilesCauseErrorsOnly) {
  std::vector<std::string> files{mcap_imu("ros1", Kind::ros1, 12, "", false), mcap_imu("json", Kind::ros1, 8, "", true),
                                 mcap_imu("cdr", Kind::big_cdr, 12, "zstd", true),
                                 mcap_imu("cdr", Kind::little_cdr, 12, "lz4", true)};
  for (const char* compression : {"none", "bz2", "lz4"})
    files.push_back(bag_imu(compression, 12, compression != std::string("none"), 0));
  for (const std::string& file : files) {
    const bool is_bag = file[0] == '#';
    const auto read = [&](const std::string& bytes) {
      return is_bag ? read_bag_log(bytes, kRequested) : read_mcap_log(bytes, kRequested);
    };
    const auto whole = values_of(read(file), "imu/data.angular_velocity.y");
    ASSERT_GE(whole.size(), 8u);
    std::size_t most = 0, damaged = 0;
    const std::size_t step =
        file.size() / static_cast<std::size_t>(test::repetitions(test::repetitions(static_cast<int>(file.size()))));
    for (std::size_t size = 20; size < file.size(); size += step) {
      const MessageLog log = read(file.substr(0, size));
      const auto part = values_of(log, "imu/data.angular_velocity.y");
      ASSERT_GE(part.size(), most) << size;  // a longer part has no fewer samples
      most = part.size();
      for (std::size_t i = 0; i < most; ++i) ASSERT_EQ(part[i], whole[i]);
    }
    for (std::size_t at = 0; at < file.size(); at += step) {
      for (const int change : {0x01, 0xff}) {
        std::string bad = file;
        bad[at] = static_cast<char>(bad[at] ^ change);
        try {
          read(bad);
        } catch (const std::runtime_error& error) {
          ++damaged;
          ASSERT_NE(std::string(error.what()), "");
        }
      }
    }
    EXPECT_GT(damaged, 20 / step);
  }
}

// ---- With a run ----

TimeSeries run_series() {
  TimeSeries run;
  run.phases = {"approach", "contact", "after"};
  run.series = {{"base/angular_velocity", "rad/s", "in W", {"x", "y", "z"}, {}},
                {"base/position", "m", "in W", {"x", "y", "z"}, {}},
                {"base/quaternion_wxyz", "1", "", {"w", "x", "y", "z"}, {}},
                {"joints/position", "rad", "", {"arm.1", "a \"quoted\" one"}, {}},
                {"targets/debris/speed", "m/s", "", {"speed"}, {}},
                {"kinetic_energy", "J", "", {""}, {}}};
  int k = 0;
  const auto add = [&](double t, int phase) {
    const double jump = phase == 2 ? 0.5 : 0, angle = 0.3 * t + 0.2 * std::sin(t);
    run.time.push_back(t), run.phase.push_back(phase);
    const auto put = [&](std::size_t i, std::vector<double> x) {
      run.series[i].data.insert(run.series[i].data.end(), x.begin(), x.end());
    };
    put(0, {0.02 * std::sin(t) + jump, 0.01 * std::cos(2 * t), 1.0 / 3 + 0.2 * std::cos(t)});
    put(1, {1 + 0.1 * std::sin(t), 2 - 0.05 * t, 1e-17 * t});
    put(2, {std::cos(angle / 2), 0, 0, std::sin(angle / 2)});
    put(3, {t * t, k % 10 == 3 ? std::nan("") : t});
    put(4, {std::sqrt(t)});
    put(5, {5 + std::sin(t) - jump});
    ++k;
  };
  for (int i = 0; i <= 300; ++i) add(i * 0.02, 0);
  add(6.0, 1), add(6.0, 1);
  for (int i = 300; i <= 1000; ++i) add(i * 0.02, 2);
  return run;
}

TEST(MessageLogs, AnExportedRunAgreesWithItselfExactly) {
  const ScratchFolder folder;
  write_timeseries_hdf5(run_series(), {"1.0", "synthetic", "abc"}, folder.path() / "timeseries.h5");
  const std::filesystem::path log = export_mcap(folder.path(), "1.0");
  EXPECT_EQ(log.filename(), "timeseries.mcap");
  const LogComparison comparison = compare_log(folder.path(), log, {});
  EXPECT_EQ(comparison.report.log.format, "mcap");
  ASSERT_EQ(comparison.report.quantities.size(), 6u);
  for (const ComparisonReport::Quantity& one : comparison.report.quantities) {
    EXPECT_EQ(one.compared + one.missing, 1004u) << one.name;
    EXPECT_EQ(one.missing, one.name == "joints/position" ? 101u : 0u) << one.name;
    EXPECT_EQ(one.rms, 0) << one.name;
  }
  // The transforms are those of the run, on every frame.
  std::ofstream(folder.path() / "map.yaml") << R"(time: {column: log_time}
quantities:
  - {run: base/position, log: "/tf.transforms[base].translation", time: timestamp, uncertainty: 1e-6}
  - {run: base/quaternion_wxyz, log: "/tf.transforms[base].rotation", quaternion_order: xyzw, uncertainty: 1e-6}
  - {run: "joints/position/arm.1", log: "/joints.position.arm.1", uncertainty: 1e-6}
)";
  const LogComparison mapped = compare_log(folder.path(), log, folder.path() / "map.yaml");
  EXPECT_EQ(mapped.report.verdict, Verdict::yes);
  EXPECT_EQ(mapped.report.count(Verdict::yes), 3u);
  EXPECT_LT(*mapped.report.quantities[1].rms, 1e-12);
}

TEST(MessageLogs, TopicsWithDifferentRatesAndTimes) {
  const ScratchFolder folder;
  write_timeseries_hdf5(run_series(), {"1.0", "synthetic", "abc"}, folder.path() / "timeseries.h5");
  // The gyroscope at 50 Hz, stamped; energies at 20 Hz, logged 0.2 s late.
  std::string records = mcap_channel(1, 0, "/gyro", "json") + mcap_channel(2, 0, "/energy", "json");
  const TimeSeries run = run_series();
  const auto text = [](double x) {
    std::ostringstream out;
    out.precision(17);
    out << x;
    return out.str();
  };
  for (std::size_t k = 310; k < 990; ++k) {
    const double t = run.time[k];
    records +=
        mcap_message(1, static_cast<std::uint64_t>(t * 1e9 + 7e6), 0,
                     R"({"header":{"stamp":)" + text(t) + R"(},"z":)" + text(run.series[0].data[3 * k + 2]) + "}");
    if (k % 5 == 0)
      records += mcap_message(2, static_cast<std::uint64_t>(std::llround(t * 1e9)), 0,
                              R"({"value":)" + text(run.series[5].data[k]) + "}");
  }
  std::ofstream(folder.path() / "log.mcap", std::ios::binary) << mcap_file(mcap_chunk("lz4", records));
  std::ofstream(folder.path() / "map.yaml") << R"(time: {column: header.stamp}
quantities:
  - {run: base/angular_velocity/z, log: /gyro.z, uncertainty: 1e-6}
  - {run: kinetic_energy, log: /energy.value, time: log_time, uncertainty: 1e-6}
)";
  const ComparisonReport report =
      compare_log(folder.path(), folder.path() / "log.mcap", folder.path() / "map.yaml").report;
  EXPECT_EQ(report.verdict, Verdict::yes);
  EXPECT_EQ(report.quantities[0].samples, 680u);
  EXPECT_EQ(report.quantities[1].samples, 136u);
  std::ofstream(folder.path() / "wrong.yaml")
      << "quantities:\n  - {run: kinetic_energy, log: /energy.valeu}\n  - {run: kinetic_energy, name: b, log: "
         "/energy.value, time: stamp}\n";
  try {
    compare_log(folder.path(), folder.path() / "log.mcap", folder.path() / "wrong.yaml");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("wrong.yaml:2:32: error: the log has no column '/energy.valeu'; did you "
                                              "mean 'energy.value'?"),
                                    HasSubstr("error: the log has no column 'stamp'")));
  }
}

}  // namespace message_logs_test
}  // namespace grapnel
