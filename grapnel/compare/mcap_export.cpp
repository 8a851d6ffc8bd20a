#include "grapnel/compare/mcap_export.hpp"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <boost/crc.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "grapnel/compare/chunk_codec.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_reader.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kChunkBytes = std::size_t{1} << 20;  // before compression
constexpr int kZstdLevel = 3;
constexpr std::string_view kMcapBegin("\x89MCAP0\r\n", 8);

using Json = nlohmann::ordered_json;

void put_number(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out += static_cast<char>((value >> (8 * i)) & 0xff);
}
void put_text(std::string& out, std::string_view text) { put_number(out, text.size(), 4), out += text; }
void put_record(std::string& out, int code, std::string_view content) {
  put_number(out, static_cast<std::uint64_t>(code), 1), put_number(out, content.size(), 8), out += content;
}

struct McapTopic {
  std::string name, schema_name, schema;
  std::uint64_t messages = 0;
};

// Messages go to chunks, with an index behind each; the summary at the end repeats schemas and channels.
class McapWriter {
 public:
  McapWriter(const std::filesystem::path& path, const std::string& version) : file_(path) {
    std::string content;
    put_text(content, ""), put_text(content, "grapnel " + version);
    std::string begin(kMcapBegin);
    put_record(begin, 0x01, content);
    write(begin);
  }

  std::uint16_t add_topic(McapTopic topic) {
    topics_.push_back(std::move(topic));
    const auto id = static_cast<std::uint16_t>(topics_.size());
    if (topics_.size() > 60000) throw std::runtime_error("the run has too many series for an MCAP file");
    chunk_ += declarations(id);
    return id;
  }

  void message(std::uint16_t topic, std::uint64_t time, std::string_view text) {
    index_[topic].emplace_back(time, chunk_.size());
    std::string content;
    put_number(content, topic, 2), put_number(content, topics_[topic - 1u].messages++, 4);
    put_number(content, time, 8), put_number(content, time, 8);
    content += text;
    put_record(chunk_, 0x05, content);
    chunk_begin_ = has_messages_ ? std::min(chunk_begin_, time) : time;
    chunk_end_ = has_messages_ ? std::max(chunk_end_, time) : time;
    has_messages_ = true;
    if (chunk_.size() >= kChunkBytes) end_chunk();
  }

  void finish() {
    if (!chunk_.empty()) end_chunk();
    std::string data_end;
    put_number(data_end, crc_.checksum(), 4);
    std::string end;
    put_record(end, 0x0f, data_end);
    write(end);
    write(summary());
    file_.commit();
  }

 private:
  struct Chunk {
    std::uint64_t begin, end, place, length, packed, size;
    std::map<std::uint16_t, std::uint64_t> indices;
    std::uint64_t index_length;
  };

  void write(std::string_view bytes) {
    file_.write(bytes);
    crc_.process_bytes(bytes.data(), bytes.size());
    place_ += bytes.size();
  }

  std::string schema_record(std::uint16_t id) const {
    const McapTopic& topic = topics_[id - 1u];
    std::string content, out;
    put_number(content, id, 2), put_text(content, topic.schema_name), put_text(content, "jsonschema");
    put_text(content, topic.schema);
    put_record(out, 0x03, content);
    return out;
  }
  std::string channel_record(std::uint16_t id) const {
    std::string content, out;
    put_number(content, id, 2), put_number(content, id, 2), put_text(content, topics_[id - 1u].name);
    put_text(content, "json"), put_number(content, 0, 4);
    put_record(out, 0x04, content);
    return out;
  }
  std::string declarations(std::uint16_t id) const { return schema_record(id) + channel_record(id); }

  void end_chunk() {
    std::string packed(ZSTD_compressBound(chunk_.size()), '\0');
    const std::size_t size = ZSTD_compress(packed.data(), packed.size(), chunk_.data(), chunk_.size(), kZstdLevel);
    if (ZSTD_isError(size)) throw std::runtime_error(fmt::format("zstd: {}", ZSTD_getErrorName(size)));
    packed.resize(size);
    std::string content, record;
    put_number(content, chunk_begin_, 8), put_number(content, chunk_end_, 8), put_number(content, chunk_.size(), 8);
    put_number(content, crc32_of(chunk_), 4), put_text(content, "zstd"), put_number(content, size, 8);
    content += packed;
    put_record(record, 0x06, content);
    Chunk chunk{chunk_begin_, chunk_end_, place_, record.size(), size, chunk_.size(), {}, 0};
    write(record);
    const std::uint64_t behind = place_;
    for (const auto& [topic, entries] : index_) {
      chunk.indices[topic] = place_;
      std::string index, out;
      put_number(index, topic, 2), put_number(index, 16 * entries.size(), 4);
      for (const auto& [time, at] : entries) put_number(index, time, 8), put_number(index, at, 8);
      put_record(out, 0x07, index);
      write(out);
    }
    chunk.index_length = place_ - behind;
    if (has_messages_) {
      begin_ = chunks_.empty() ? chunk.begin : std::min(begin_, chunk.begin);
      end_ = std::max(end_, chunk.end);
    }
    chunks_.push_back(std::move(chunk));
    chunk_.clear(), index_.clear();
    has_messages_ = false, chunk_begin_ = chunk_end_ = 0;
  }

  std::string statistics() const {
    std::uint64_t messages = 0;
    for (const McapTopic& topic : topics_) messages += topic.messages;
    std::string content;
    put_number(content, messages, 8), put_number(content, topics_.size(), 2), put_number(content, topics_.size(), 4);
    put_number(content, 0, 4), put_number(content, 0, 4), put_number(content, chunks_.size(), 4);
    put_number(content, begin_, 8), put_number(content, end_, 8), put_number(content, 10 * topics_.size(), 4);
    for (std::size_t i = 0; i < topics_.size(); ++i)
      put_number(content, i + 1, 2), put_number(content, topics_[i].messages, 8);
    return content;
  }

  static std::string chunk_index(const Chunk& chunk) {
    std::string content;
    for (const std::uint64_t x : {chunk.begin, chunk.end, chunk.place, chunk.length}) put_number(content, x, 8);
    put_number(content, 10 * chunk.indices.size(), 4);
    for (const auto& [topic, at] : chunk.indices) put_number(content, topic, 2), put_number(content, at, 8);
    put_number(content, chunk.index_length, 8), put_text(content, "zstd");
    put_number(content, chunk.packed, 8), put_number(content, chunk.size, 8);
    return content;
  }

  // Groups of records of one kind, then the places of the groups, the footer and the end of the file.
  std::string summary() const {
    std::string out, offsets;
    const auto group = [&](int code, const auto& add) {
      const std::size_t begin = out.size();
      add();
      std::string content;
      put_number(content, static_cast<std::uint64_t>(code), 1), put_number(content, place_ + begin, 8);
      put_number(content, out.size() - begin, 8);
      if (out.size() > begin) put_record(offsets, 0x0e, content);
    };
    const auto count = static_cast<std::uint16_t>(topics_.size());
    group(0x03, [&] {
      for (std::uint16_t id = 1; id <= count; ++id) out += schema_record(id);
    });
    group(0x04, [&] {
      for (std::uint16_t id = 1; id <= count; ++id) out += channel_record(id);
    });
    group(0x0b, [&] { put_record(out, 0x0b, statistics()); });
    group(0x08, [&] {
      for (const Chunk& chunk : chunks_) put_record(out, 0x08, chunk_index(chunk));
    });
    const std::uint64_t offset_start = place_ + out.size();
    out += offsets;
    put_number(out, 0x02, 1), put_number(out, 20, 8);  // the footer
    put_number(out, place_, 8), put_number(out, offset_start, 8);
    put_number(out, crc32_of(out), 4);
    out += kMcapBegin;
    return out;
  }

  AtomicFile file_;
  boost::crc_32_type crc_;
  std::uint64_t place_ = 0;
  std::vector<McapTopic> topics_;  // channels and schemas have the numbers 1, 2, ...
  std::string chunk_;
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> index_;
  std::uint64_t chunk_begin_ = 0, chunk_end_ = 0, begin_ = 0, end_ = 0;
  bool has_messages_ = false;
  std::vector<Chunk> chunks_;
};

std::string json_quoted(const std::string& text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

void put_json_number(std::string& out, double value) {
  if (std::isfinite(value))
    out += fmt::format("{}", value);  // reads back to the same number
  else
    out += "null";
}

// "base/position" => group "base", field "position".
std::pair<std::string, std::string> group_and_field(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string::npos) return {"run", path};
  return {path.substr(0, slash), path.substr(slash + 1)};
}

bool is_scalar(const Series& series) {
  const std::string field = group_and_field(series.path).second;
  return series.width() == 1 && (series.components[0].empty() || series.components[0] == field);
}

Json group_schema(const std::string& group, const std::vector<const Series*>& members) {
  Json properties = {{"time", {{"type", "number"}, {"description", "time of the run [s]"}}}};
  for (const Series* series : members) {
    Json one = {{"type", is_scalar(*series) ? "number" : "object"},
                {"description", fmt::format("{} [{}]", series->description, series->unit)}};
    if (!is_scalar(*series)) {
      for (const std::string& component : series->components) one["properties"][component] = {{"type", "number"}};
    }
    properties[group_and_field(series->path).second] = std::move(one);
  }
  return {{"title", group}, {"type", "object"}, {"properties", std::move(properties)}};
}

// The well-known schema of Foxglove.
Json transforms_schema() {
  const auto numbers = [](std::initializer_list<const char*> names, const char* type) {
    Json one = {{"type", "object"}};
    for (const char* name : names) one["properties"][name] = {{"type", type}};
    return one;
  };
  const Json text = {{"type", "string"}};
  Json transform = {{"type", "object"},
                    {"properties",
                     {{"timestamp", numbers({"sec", "nsec"}, "integer")},
                      {"parent_frame_id", text},
                      {"child_frame_id", text},
                      {"translation", numbers({"x", "y", "z"}, "number")},
                      {"rotation", numbers({"x", "y", "z", "w"}, "number")}}}};
  return {{"title", "foxglove.FrameTransforms"},
          {"type", "object"},
          {"properties", {{"transforms", {{"type", "array"}, {"items", std::move(transform)}}}}}};
}

class McapExport {
 public:
  McapExport(const std::filesystem::path& path, const std::string& version) : writer_(path, version) {}

  void begin(const TimeSeriesHead& head) {
    const std::vector<Series>& all = head.names.series;
    std::vector<std::string> names;
    std::map<std::string, std::vector<const Series*>> members;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto [group, field] = group_and_field(all[i].path);
      if (!members.contains(group)) names.push_back(group);
      members[group].push_back(&all[i]);
      groups_[group].series.push_back(i);
      const auto index_of = [&](const std::string& path) {
        for (std::size_t k = 0; k < all.size(); ++k) {
          if (all[k].path == path) return std::optional(k);
        }
        return std::optional<std::size_t>();
      };
      const auto orientation = field == "position" ? index_of(group + "/quaternion_wxyz") : std::nullopt;
      if (orientation && all[i].width() == 3 && all[*orientation].width() == 4)
        poses_.push_back({json_quoted(group), i, *orientation});
    }
    for (const std::string& name : names) {
      Group& group = groups_[name];
      group.topic = writer_.add_topic(
          {"/" + name, "grapnel." + name,
           group_schema(name, members[name]).dump(-1, ' ', false, Json::error_handler_t::replace), 0});
      for (const std::size_t i : group.series) group.keys.push_back(keys_of(all[i]));
    }
    phases_ = head.names.phases;
    phase_topic_ = writer_.add_topic(
        {"/phase", "grapnel.phase",
         R"({"title":"phase","type":"object","properties":{"time":{"type":"number"},"name":{"type":"string"}}})", 0});
    if (!poses_.empty())
      pose_topic_ = writer_.add_topic({"/tf", "foxglove.FrameTransforms", transforms_schema().dump(), 0});
  }

  void add(const TimeSeries& block) {
    for (std::size_t k = 0; k < block.time.size(); ++k) {
      const double time = block.time[k];
      if (!(time >= 0) || time > 1e10)
        throw std::runtime_error(fmt::format("the time of a sample is {} s; MCAP files need 0 to 1e10 s", time));
      const auto stamp = static_cast<std::uint64_t>(std::llround(1e9 * time));
      if (block.phase[k] != phase_) {
        phase_ = block.phase[k];
        text_ = R"({"time":)";
        put_json_number(text_, time);
        text_ += R"(,"name":)" + json_quoted(phases_.at(static_cast<std::size_t>(phase_))) + "}";
        writer_.message(phase_topic_, stamp, text_);
      }
      for (const auto& [name, group] : groups_) add_group(block, group, k, stamp);
      if (pose_topic_ != 0) add_poses(block, k, stamp);
    }
  }

  void finish() { writer_.finish(); }

 private:
  struct Group {
    std::uint16_t topic = 0;
    std::vector<std::size_t> series;
    std::vector<std::vector<std::string>> keys;  // texts before each number of each series; the last ends the value
  };
  struct Pose {
    std::string name;
    std::size_t position, orientation;
  };

  static std::vector<std::string> keys_of(const Series& series) {
    std::vector<std::string> keys;
    std::string text = "," + json_quoted(group_and_field(series.path).second) + ":";
    if (is_scalar(series)) return {text, ""};
    for (std::size_t c = 0; c < series.components.size(); ++c) {
      text += (c == 0 ? "{" : ",") + json_quoted(series.components[c]) + ":";
      keys.push_back(std::exchange(text, ""));
    }
    keys.push_back("}");
    return keys;
  }

  void add_group(const TimeSeries& block, const Group& group, std::size_t k, std::uint64_t stamp) {
    text_ = R"({"time":)";
    put_json_number(text_, block.time[k]);
    for (std::size_t i = 0; i < group.series.size(); ++i) {
      const std::vector<std::string>& keys = group.keys[i];
      const std::vector<double>& data = block.series[group.series[i]].data;
      const std::size_t width = keys.size() - 1;
      for (std::size_t c = 0; c < width; ++c) {
        text_ += keys[c];
        put_json_number(text_, data[k * width + c]);
      }
      text_ += keys.back();
    }
    text_ += "}";
    writer_.message(group.topic, stamp, text_);
  }

  // {"transforms":[{"timestamp":{...},"parent_frame_id":"world","child_frame_id":"base",...}]}
  void add_poses(const TimeSeries& block, std::size_t k, std::uint64_t stamp) {
    const std::string time = fmt::format(R"({{"timestamp":{{"sec":{},"nsec":{}}},"parent_frame_id":"world",)",
                                         stamp / 1'000'000'000, stamp % 1'000'000'000);
    text_ = R"({"transforms":[)";
    bool is_first = true;
    for (const Pose& pose : poses_) {
      const double* p = block.series[pose.position].data.data() + 3 * k;
      const double* q = block.series[pose.orientation].data.data() + 4 * k;
      if (!std::isfinite(p[0] + p[1] + p[2] + q[0] + q[1] + q[2] + q[3])) continue;
      text_ += std::exchange(is_first, false) ? "" : ",";
      text_ += time;
      text_ += fmt::format(
          R"("child_frame_id":{},"translation":{{"x":{},"y":{},"z":{}}},"rotation":{{"x":{},"y":{},"z":{},"w":{}}}}})",
          pose.name, p[0], p[1], p[2], q[1], q[2], q[3], q[0]);
    }
    text_ += "]}";
    writer_.message(pose_topic_, stamp, text_);
  }

  McapWriter writer_;
  std::map<std::string, Group> groups_;
  std::vector<Pose> poses_;
  std::vector<std::string> phases_;
  std::uint16_t phase_topic_ = 0, pose_topic_ = 0;
  int phase_ = -1;
  std::string text_;
};

}  // namespace

std::filesystem::path export_mcap(const std::filesystem::path& folder, const std::string& version) {
  std::filesystem::path path = folder / "timeseries.mcap";
  std::optional<McapExport> out;
  read_timeseries_blocks(
      folder / "timeseries.h5", std::numeric_limits<std::uint64_t>::max(),
      [&](const TimeSeriesHead& head) {
        out.emplace(path, version);
        out->begin(head);
      },
      [&](const TimeSeries& block) { out->add(block); });
  out->finish();
  return path;
}

}  // namespace grapnel
