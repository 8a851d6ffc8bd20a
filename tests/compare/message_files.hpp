#pragma once

/// @file
/// MCAP and rosbag files, byte by byte from their descriptions (mcap.dev/spec, wiki.ros.org/Bags/Format/2.0), and
/// messages in the encodings of ROS 1, CDR and JSON. Nothing here is shared with the readers.

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <boost/crc.hpp>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace grapnel::message_files {

inline std::string bytes_of(std::uint64_t value, int size, bool big = false) {
  std::string out(static_cast<std::size_t>(size), '\0');
  for (int i = 0; i < std::min(size, 8); ++i)  // the others are zero
    out[static_cast<std::size_t>(big ? size - 1 - i : i)] = static_cast<char>((value >> (8 * i)) & 0xff);
  return out;
}
inline std::string text_of(const std::string& text) { return bytes_of(text.size(), 4) + text; }

inline std::string packed(const std::string& compression, const std::string& bytes) {
  if (compression == "lz4") {
    std::string out(LZ4F_compressFrameBound(bytes.size(), nullptr), '\0');
    out.resize(LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr));
    return out;
  }
  if (compression == "zstd") {
    std::string out(ZSTD_compressBound(bytes.size()), '\0');
    out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 1));
    return out;
  }
  if (compression == "bz2") {
    auto size = static_cast<unsigned>(bytes.size() + bytes.size() / 50 + 1000);
    std::string out(size, '\0'), in = bytes;
    BZ2_bzBuffToBuffCompress(out.data(), &size, in.data(), static_cast<unsigned>(in.size()), 9, 0, 0);
    out.resize(size);
    return out;
  }
  return bytes;
}

// ---- Messages ----

/// Writes the fields of a message. CDR aligns numbers to their size.
class EncodedMessage {
 public:
  enum class Kind { ros1, little_cdr, big_cdr };
  explicit EncodedMessage(Kind kind) : kind_(kind) {
    if (kind != Kind::ros1) out_ = std::string{'\0', kind == Kind::little_cdr ? '\1' : '\0', '\0', '\0'};
  }
  EncodedMessage& number(std::uint64_t value, int size) {
    while (kind_ != Kind::ros1 && (out_.size() - 4) % static_cast<std::size_t>(size) != 0) out_ += '\0';
    out_ += bytes_of(value, size, kind_ == Kind::big_cdr);
    return *this;
  }
  EncodedMessage& real(double value) { return number(std::bit_cast<std::uint64_t>(value), 8); }
  EncodedMessage& text(const std::string& value) {
    const bool has_end = kind_ != Kind::ros1;
    number(value.size() + (has_end ? 1 : 0), 4);
    out_ += value + (has_end ? std::string(1, '\0') : "");
    return *this;
  }
  const std::string& bytes() const { return out_; }

 private:
  Kind kind_;
  std::string out_;
};

// ---- MCAP ----

inline std::string mcap_record(int code, const std::string& content) {
  return bytes_of(static_cast<std::uint64_t>(code), 1) + bytes_of(content.size(), 8) + content;
}
inline std::string mcap_schema(int id, const std::string& name, const std::string& encoding, const std::string& data) {
  return mcap_record(3,
                     bytes_of(static_cast<std::uint64_t>(id), 2) + text_of(name) + text_of(encoding) + text_of(data));
}
inline std::string mcap_channel(int id, int schema, const std::string& topic, const std::string& encoding) {
  return mcap_record(4, bytes_of(static_cast<std::uint64_t>(id), 2) + bytes_of(static_cast<std::uint64_t>(schema), 2) +
                            text_of(topic) + text_of(encoding) + bytes_of(0, 4));
}
inline std::string mcap_message(int channel, std::uint64_t log_time, std::uint64_t publish_time,
                                const std::string& data) {
  return mcap_record(5, bytes_of(static_cast<std::uint64_t>(channel), 2) + bytes_of(0, 4) + bytes_of(log_time, 8) +
                            bytes_of(publish_time, 8) + data);
}
inline std::uint32_t crc32(const std::string& bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}
inline std::string mcap_chunk(const std::string& compression, const std::string& records) {
  const std::string bytes = packed(compression, records);
  return mcap_record(6, bytes_of(0, 16) + bytes_of(records.size(), 8) + bytes_of(crc32(records), 4) +
                            text_of(compression) + bytes_of(bytes.size(), 8) + bytes);
}
inline std::string mcap_magic() { return std::string("\x89MCAP0\r\n", 8); }
inline std::string mcap_begin() { return mcap_magic() + mcap_record(1, text_of("") + text_of("test")); }
inline std::string mcap_file(const std::string& records) {
  const std::string data = mcap_begin() + records;
  return data + mcap_record(15, bytes_of(crc32(data), 4)) + mcap_record(2, bytes_of(0, 20)) + mcap_magic();
}

// ---- Rosbag ----

using BagHeader = std::vector<std::pair<std::string, std::string>>;

inline std::string bag_header(const BagHeader& fields) {
  std::string out;
  for (const auto& [name, value] : fields) out += text_of(name + "=" + value);
  return out;
}
inline std::string bag_record(int op, BagHeader fields, const std::string& data) {
  fields.emplace_back("op", bytes_of(static_cast<std::uint64_t>(op), 1));
  return text_of(bag_header(fields)) + text_of(data);
}
inline std::string bag_connection(int id, const std::string& topic, const std::string& type,
                                  const std::string& definition) {
  return bag_record(
      7, {{"conn", bytes_of(static_cast<std::uint64_t>(id), 4)}, {"topic", topic}},
      bag_header({{"topic", topic}, {"type", type}, {"md5sum", "*"}, {"message_definition", definition}}));
}
inline std::string bag_message(int id, std::uint64_t time, const std::string& data) {
  return bag_record(2,
                    {{"conn", bytes_of(static_cast<std::uint64_t>(id), 4)},
                     {"time", bytes_of(time / 1'000'000'000, 4) + bytes_of(time % 1'000'000'000, 4)}},
                    data);
}
inline std::string bag_chunk(const std::string& compression, const std::string& records) {
  return bag_record(5, {{"compression", compression}, {"size", bytes_of(records.size(), 4)}},
                    packed(compression, records));
}
inline std::string bag_begin(bool is_closed = true, std::size_t padding = 4027) {
  const BagHeader fields{{"index_pos", bytes_of(is_closed ? 4117 : 0, 8)},
                         {"conn_count", bytes_of(1, 4)},
                         {"chunk_count", bytes_of(1, 4)}};
  return "#ROSBAG V2.0\n" + bag_record(3, fields, std::string(padding, ' '));
}

}  // namespace grapnel::message_files
