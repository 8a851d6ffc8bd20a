#pragma once

/// @file
/// Columns of logs of messages: the numbers of chosen fields of chosen topics. For the readers of MCAP and rosbag.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/compare/measured_log.hpp"
#include "grapnel/compare/message_definition.hpp"

namespace grapnel {

inline constexpr std::size_t kLargestSchema = std::size_t{1} << 24;  ///< [bytes]

/// What a log states about the messages of a channel or connection.
struct MessageChannel {
  std::string topic;
  std::string encoding;         ///< "ros1", "cdr", "json"
  std::string schema_name;      ///< "sensor_msgs/Imu"
  std::string schema_encoding;  ///< "ros1msg", "ros2msg", "jsonschema"; empty: none
  std::string schema;
};

/// A message in the log.
struct LoggedMessage {
  std::uint64_t log_time = 0;                 ///< [ns]
  std::optional<std::uint64_t> publish_time;  ///< [ns]
  std::string_view bytes;
  std::uint64_t place = 0;  ///< for errors: byte of the file at which it, or its chunk, begins
};

/// Requested names are "/TOPIC.FIELD". Names without '/' are also times of the others, in the same element or message:
/// "header.stamp", "log_time". A column has the messages that contain its field. Where a path selects an element by a
/// name, messages without this name have no samples.
class MessageColumns {
 public:
  explicit MessageColumns(const std::vector<std::string>& requested);
  MessageColumns(MessageColumns&&) noexcept;
  ~MessageColumns();

  /// The number of the channel. @throws std::runtime_error if a field is requested of a channel that cannot be read
  std::size_t add_channel(const MessageChannel& channel);
  bool is_requested(std::size_t channel) const;
  /// @throws std::runtime_error with the place, for messages that do not agree with their schema
  void add(std::size_t channel, const LoggedMessage& message);
  /// The requested columns, then all fields without values. Samples are in the order of log times.
  std::vector<LogDataset> take();

 private:
  struct Channel;
  struct Column;
  struct Group;

  void add_requests(Channel& channel);
  Group& group_of(const std::string& topic, std::string_view path);
  MessageValue decoded(Channel& channel, const LoggedMessage& message) const;
  void list_fields(Channel& channel, const MessageValue* example);
  static void sample(Group& group, const MessageValue& value, const LoggedMessage& message);

  std::vector<std::string> requested_;
  std::vector<Channel> channels_;
  std::vector<std::unique_ptr<Group>> groups_;
  std::map<std::string, std::optional<std::size_t>> listed_;  // names and widths of all fields
  std::vector<std::string> order_;                            // of their names
  std::size_t listed_bytes_ = 0;                              // of their names
};

/// An error whose message states a place of the file.
struct PlacedError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
[[noreturn]] void fail_at(std::uint64_t place, const std::string& what);

}  // namespace grapnel
