// Rosbag 2.0 (http://wiki.ros.org/Bags/Format/2.0): records of a header with named fields and of data; messages and
// connections directly or in chunks. Indices are not used, so that bags that were not closed are read too.
#include <fmt/format.h>

#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "grapnel/compare/byte_reader.hpp"
#include "grapnel/compare/chunk_codec.hpp"
#include "grapnel/compare/measured_log.hpp"
#include "grapnel/compare/message_columns.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

constexpr std::string_view kBagVersion = "#ROSBAG V2.0\n";

enum class BagRecord { message = 2, header = 3, index = 4, chunk = 5, chunk_info = 6, connection = 7 };

using BagFields = std::map<std::string, std::string_view, std::less<>>;

BagFields bag_fields(std::string_view header) {
  BagFields fields;
  ByteReader reader(header);
  while (reader.left() > 0) {
    const std::string_view field = reader.part();
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos) throw std::runtime_error("a field of a header has no '='");
    fields.emplace(std::string(field.substr(0, equals)), field.substr(equals + 1));
  }
  return fields;
}

std::string_view text_field(const BagFields& fields, const char* name) {
  const auto at = fields.find(name);
  if (at == fields.end()) throw std::runtime_error(fmt::format("a header has no field {}", in_quotes(name)));
  return at->second;
}

std::uint64_t number_field(const BagFields& fields, const char* name, std::size_t size) {
  const std::string_view bytes = text_field(fields, name);
  if (bytes.size() != size)
    throw std::runtime_error(
        fmt::format("field {} of a header has {}, must have {}", in_quotes(name), counted(bytes.size(), "byte"), size));
  return ByteReader(bytes).number(size);
}

class BagLog {
 public:
  BagLog(std::string_view bytes, const std::vector<std::string>& requested) : bytes_(bytes), columns_(requested) {}

  MessageLog read() {
    ByteReader reader(bytes_);
    if (!bytes_.starts_with(kBagVersion))
      throw std::runtime_error(fmt::format("the log is a rosbag of another version than 2.0: {}",
                                           printable_line(std::string(bytes_.substr(0, kBagVersion.size() - 1)))));
    reader.take(kBagVersion.size());
    while (reader.left() > 0) {
      place_ = reader.at();
      try {
        const std::string_view header = reader.part(), data = reader.part();
        record(header, data, true);
      } catch (const EndOfBytes&) {
        warnings_.push_back(fmt::format(
            "the log ends at byte {} within the record of byte {}: it is truncated, or was not closed; what "
            "precedes is read",
            bytes_.size(), place_));
        break;
      }
    }
    if (is_open_ && warnings_.empty()) warnings_.push_back("the log was not closed; its messages are read");
    return {columns_.take(), std::move(warnings_)};
  }

 private:
  void record(std::string_view header, std::string_view data, bool is_outside) {
    try {
      const BagFields fields = bag_fields(header);
      switch (static_cast<BagRecord>(number_field(fields, "op", 1))) {
        case BagRecord::message:
          return read_message(fields, data);
        case BagRecord::connection:
          return read_connection(fields, data);
        case BagRecord::header:
          is_open_ = number_field(fields, "index_pos", 8) == 0;
          return;
        case BagRecord::chunk:
          if (!is_outside) throw std::runtime_error("a chunk contains a chunk");
          return read_chunk(fields, data);
        default:
          return;  // indices
      }
    } catch (const PlacedError&) {
      throw;
    } catch (const std::runtime_error& error) {
      fail_at(place_, fmt::format("a record is damaged: {}", error_text(error)));
    }
  }

  void read_connection(const BagFields& fields, std::string_view data) {
    const auto id = static_cast<std::uint32_t>(number_field(fields, "conn", 4));
    if (connections_.contains(id)) return;
    const BagFields about = bag_fields(data);
    MessageChannel channel;
    channel.topic = text_field(fields, "topic");
    channel.encoding = "ros1", channel.schema_encoding = "ros1msg";
    channel.schema_name = text_field(about, "type"), channel.schema = text_field(about, "message_definition");
    connections_[id] = columns_.add_channel(channel);
  }

  void read_message(const BagFields& fields, std::string_view data) {
    const auto id = static_cast<std::uint32_t>(number_field(fields, "conn", 4));
    const auto connection = connections_.find(id);
    if (connection == connections_.end())
      throw std::runtime_error(fmt::format("a message refers to the unknown connection {}", id));
    if (!columns_.is_requested(connection->second)) return;
    const std::uint64_t time = number_field(fields, "time", 8);  // seconds, nanoseconds
    const std::uint64_t nanoseconds = (time & 0xffffffffu) * 1'000'000'000u + (time >> 32);
    columns_.add(connection->second, {nanoseconds, {}, data, place_});
  }

  void read_chunk(const BagFields& fields, std::string_view data) {
    const std::uint64_t size = number_field(fields, "size", 4);
    // A chunk that was not closed has no data yet; its records follow.
    if (size == 0 && data.empty()) return;
    const std::string records = decompressed(text_field(fields, "compression"), data, size);
    ByteReader inside(records);
    while (inside.left() > 0) {
      const std::string_view header = inside.part();
      record(header, inside.part(), false);
    }
  }

  std::string_view bytes_;
  MessageColumns columns_;
  std::vector<std::string> warnings_;
  std::map<std::uint32_t, std::size_t> connections_;
  std::uint64_t place_ = 0;  // of the record outside chunks
  bool is_open_ = false;
};

}  // namespace

bool is_rosbag(std::string_view begin) { return begin.starts_with("#ROSBAG V") || begin.starts_with("#ROSRECORD V"); }

MessageLog read_bag_log(std::string_view bytes, const std::vector<std::string>& requested) {
  if (!is_rosbag(bytes)) throw std::runtime_error("byte 0: a rosbag begins with #ROSBAG V2.0");
  return BagLog(bytes, requested).read();
}

}  // namespace grapnel
