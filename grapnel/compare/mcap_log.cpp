// MCAP (https://mcap.dev/spec): records of opcode, length and content; messages directly or in chunks. The index at the
// end is not used, so that files without one are read too.
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

namespace grapnel {
namespace {

constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);

enum class McapRecord { footer = 2, schema = 3, channel = 4, message = 5, chunk = 6, data_end = 0x0f };

class McapLog {
 public:
  McapLog(std::string_view bytes, const std::vector<std::string>& requested) : bytes_(bytes), columns_(requested) {}

  MessageLog read() {
    ByteReader reader(bytes_);
    reader.take(kMcapMagic.size());
    while (!is_complete_) {
      const std::size_t begin = reader.at();
      try {
        if (reader.left() == 0) throw EndOfBytes();
        const auto code = static_cast<McapRecord>(reader.number(1));
        const std::string_view content = reader.part(8);
        place_ = begin;
        record(code, content, true);
      } catch (const EndOfBytes&) {
        warnings_.push_back(fmt::format(
            "the log ends at byte {} within or before the record of byte {}: it is truncated, or was not closed; what "
            "precedes is read",
            bytes_.size(), begin));
        break;
      }
    }
    if (is_complete_ && !bytes_.ends_with(kMcapMagic))
      warnings_.push_back(
          fmt::format("the log does not end with the bytes of an MCAP file: what follows its data, at "
                      "byte {}, is damaged",
                      reader.at()));
    return {columns_.take(), std::move(warnings_)};
  }

 private:
  struct Schema {
    std::string name, encoding, data;
  };

  void record(McapRecord code, std::string_view content, bool is_outside) {
    try {
      ByteReader reader(content);
      switch (code) {
        case McapRecord::schema:
          return read_schema(reader);
        case McapRecord::channel:
          return read_channel(reader);
        case McapRecord::message:
          return read_message(reader);
        case McapRecord::chunk:
          if (is_outside) return read_chunk(reader);
          fail_at(place_, "a chunk contains a chunk");
        case McapRecord::data_end:
          check_crc(static_cast<std::uint32_t>(reader.number(4)), bytes_.substr(0, static_cast<std::size_t>(place_)),
                    "the data");
          is_complete_ = true;
          return;
        case McapRecord::footer:
          is_complete_ = true;
          return;
        default:
          return;  // indices, attachments, metadata, and kinds of later versions
      }
    } catch (const EndOfBytes& error) {
      fail_at(place_, fmt::format("a record of kind {} is damaged: {}", static_cast<int>(code), error_text(error)));
    }
  }

  void check_crc(std::uint32_t stated, std::string_view bytes, const char* what) const {
    if (stated == 0) return;  // not computed
    const std::uint32_t found = crc32_of(bytes);
    if (found != stated)
      fail_at(place_,
              fmt::format("the checksum of {} is {:08x}, must be {:08x}: the log is damaged", what, found, stated));
  }

  void read_schema(ByteReader& reader) {
    const auto id = static_cast<std::uint16_t>(reader.number(2));
    Schema schema;
    schema.name = reader.part(), schema.encoding = reader.part();
    const std::string_view data = reader.part();
    if (data.size() > kLargestSchema)
      fail_at(place_, fmt::format("schema {} has {} bytes, must have at most {}", id, data.size(), kLargestSchema));
    schema.data = data;
    schemas_.emplace(id, std::move(schema));
  }

  void read_channel(ByteReader& reader) {
    const auto id = static_cast<std::uint16_t>(reader.number(2)),
               schema_id = static_cast<std::uint16_t>(reader.number(2));
    if (channels_.contains(id)) return;
    MessageChannel channel;
    channel.topic = reader.part(), channel.encoding = reader.part();
    if (schema_id != 0) {
      const auto schema = schemas_.find(schema_id);
      if (schema == schemas_.end())
        fail_at(place_, fmt::format("channel {} refers to the unknown schema {}", id, schema_id));
      channel.schema_name = schema->second.name, channel.schema_encoding = schema->second.encoding;
      channel.schema = schema->second.data;
    }
    channels_[id] = columns_.add_channel(channel);
  }

  void read_message(ByteReader& reader) {
    const auto id = static_cast<std::uint16_t>(reader.number(2));
    const auto channel = channels_.find(id);
    if (channel == channels_.end()) fail_at(place_, fmt::format("a message refers to the unknown channel {}", id));
    reader.number(4);  // its count
    LoggedMessage message;
    message.log_time = reader.number(8), message.publish_time = reader.number(8);
    if (!columns_.is_requested(channel->second)) return;
    message.bytes = reader.take(reader.left()), message.place = place_;
    columns_.add(channel->second, message);
  }

  void read_chunk(ByteReader& reader) {
    reader.take(16);  // times of its first and last message
    const std::uint64_t size = reader.number(8);
    const auto crc = static_cast<std::uint32_t>(reader.number(4));
    const std::string_view compression = reader.part(), packed = reader.part(8);
    std::string records;
    try {
      records = decompressed(compression, packed, size);
    } catch (const std::runtime_error& error) {
      fail_at(place_, error_text(error));
    }
    check_crc(crc, records, "a chunk");
    ByteReader inside(records);
    while (inside.left() > 0) {
      const auto code = static_cast<McapRecord>(inside.number(1));
      record(code, inside.part(8), false);
    }
  }

  std::string_view bytes_;
  MessageColumns columns_;
  std::vector<std::string> warnings_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, std::size_t> channels_;
  std::uint64_t place_ = 0;  // of the record outside chunks
  bool is_complete_ = false;
};

}  // namespace

bool is_mcap(std::string_view begin) { return begin.starts_with(kMcapMagic); }

MessageLog read_mcap_log(std::string_view bytes, const std::vector<std::string>& requested) {
  if (!is_mcap(bytes)) throw std::runtime_error("byte 0: an MCAP file begins with 0x89 MCAP0");
  return McapLog(bytes, requested).read();
}

}  // namespace grapnel
