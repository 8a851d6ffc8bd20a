#include "grapnel/compare/message_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>

#include "grapnel/text/error_text.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kMostListedFields = 2000;  // of a channel
constexpr std::size_t kMostChannels = 65536;
constexpr std::size_t kMostListedBytes = std::size_t{1} << 26;  // of the names of all fields
constexpr std::size_t kMostNumbers = std::size_t{1} << 28;      // of a column
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

std::string_view without_slash(std::string_view name) { return name.starts_with('/') ? name.substr(1) : name; }

// The beginning of a path up to its first element that is selected by a name; empty without one.
std::string_view named_part(std::string_view path) {
  for (std::size_t open = path.find('['); open != std::string_view::npos; open = path.find('[', open + 1)) {
    const std::size_t end = path.find(']', open);
    if (end == std::string_view::npos) break;
    const std::string_view name = path.substr(open + 1, end - open - 1);
    if (name.find_first_not_of("0123456789") != std::string_view::npos) return path.substr(0, end + 1);
  }
  return {};
}

std::optional<MessageEncoding> encoding_of(const MessageChannel& channel) {
  if (channel.encoding == "json") return MessageEncoding::json;
  if (channel.encoding == "ros1" && channel.schema_encoding == "ros1msg") return MessageEncoding::ros1;
  if (channel.encoding == "cdr" && channel.schema_encoding == "ros2msg") return MessageEncoding::cdr;
  return std::nullopt;
}

MessageValue parsed_json(std::string_view text) { return MessageValue::parse(text, nullptr, false); }

}  // namespace

void fail_at(std::uint64_t place, const std::string& what) {
  throw PlacedError(fmt::format("byte {}: {}", place, what));
}

struct MessageColumns::Column {
  std::string path;
  bool is_time = false;  // requested for the samples of others
  std::size_t width = 0, rows = 0;
  std::vector<double> values;
  std::string obstacle;

  void add(std::span<const double> numbers) {
    if (!numbers.empty() && width == 0) {
      width = numbers.size();
      check_size();
      values.assign(rows * width, kNoNumber);
    }
    if (!numbers.empty() && numbers.size() != width && obstacle.empty()) {
      obstacle = fmt::format("it has {} in message {} (from 0), {} before; select elements by [0]",
                             counted(numbers.size(), "number"), rows, width);
      values = {};
    }
    if (obstacle.empty()) {
      check_size();
      if (numbers.empty())
        values.resize(values.size() + width, kNoNumber);
      else
        values.insert(values.end(), numbers.begin(), numbers.end());
    }
    ++rows;
  }

  void check_size() const {
    if (width > kMostNumbers / (rows + 1))
      throw std::runtime_error(
          fmt::format("field {} would have {} in each of {} messages or more, at most {} in all can be "
                      "read; select elements by [0]",
                      in_quotes(path), counted(width, "number"), rows, kMostNumbers));
  }
};

// Columns with common samples: of a topic, or of a named element of its messages.
struct MessageColumns::Group {
  std::string name, topic, element;  // "tf.transforms[camera]", "tf", "transforms[camera]"
  std::vector<Column> columns;
  std::vector<std::uint64_t> log_times;
  bool is_ordered = true;
};

struct MessageColumns::Channel {
  MessageChannel stated;
  std::optional<MessageEncoding> encoding;
  std::optional<MessageDefinition> definition;
  std::vector<Group*> groups;
  std::vector<std::string> paths;  // of its columns
  bool texts = false, is_listed = false;
};

MessageColumns::MessageColumns(const std::vector<std::string>& requested) : requested_(requested) {}
MessageColumns::MessageColumns(MessageColumns&&) noexcept = default;
MessageColumns::~MessageColumns() = default;

std::size_t MessageColumns::add_channel(const MessageChannel& channel) {
  if (channels_.size() >= kMostChannels) throw std::runtime_error("the log has too many channels");
  if (channel.schema.size() > kLargestSchema)
    throw std::runtime_error(fmt::format("the schema of topic {} has {} bytes, must have at most {}",
                                         in_quotes(channel.topic), channel.schema.size(), kLargestSchema));
  Channel& added = channels_.emplace_back();
  added.stated = channel, added.encoding = encoding_of(channel);
  add_requests(added);
  const std::string what = fmt::format("topic {}", in_quotes(channel.topic));
  if (!added.encoding && !added.groups.empty())
    throw std::runtime_error(
        fmt::format("{} has messages in {} with a schema in {}; ros1 with ros1msg, cdr with ros2msg, and json can be "
                    "read",
                    what, in_quotes(channel.encoding), in_quotes(channel.schema_encoding)));
  try {
    if (added.encoding && *added.encoding != MessageEncoding::json)
      added.definition.emplace(channel.schema_name, channel.schema);
  } catch (const std::exception& error) {
    if (!added.groups.empty()) throw std::runtime_error(what + ": " + error_text(error));
    added.encoding.reset();  // nothing of it is read
  }
  list_fields(added, nullptr);
  added.stated.schema = {};  // the definition and the list have its contents
  return channels_.size() - 1;
}

bool MessageColumns::is_requested(std::size_t channel) const {
  const Channel& one = channels_.at(channel);
  return !one.groups.empty() || (!one.is_listed && one.encoding);
}

MessageColumns::Group& MessageColumns::group_of(const std::string& topic, std::string_view path) {
  const std::string_view named = named_part(path);
  const std::string name = named.empty() ? topic : fmt::format("{}.{}", topic, named);
  const auto at = std::find_if(groups_.begin(), groups_.end(), [&](const auto& one) { return one->name == name; });
  if (at != groups_.end()) return **at;
  groups_.push_back(std::make_unique<Group>());
  groups_.back()->name = name, groups_.back()->topic = topic;
  groups_.back()->element = named;
  return *groups_.back();
}

// Columns of the topic, and times for each of their groups.
void MessageColumns::add_requests(Channel& channel) {
  const std::string topic(without_slash(channel.stated.topic));
  const auto add = [&](Group& group, std::string_view path, bool is_time) {
    const bool is_known =
        std::any_of(group.columns.begin(), group.columns.end(), [&](const Column& one) { return one.path == path; });
    if (!is_known) group.columns.push_back({std::string(path), is_time, 0, 0, {}, {}});
    if (std::find(channel.groups.begin(), channel.groups.end(), &group) == channel.groups.end())
      channel.groups.push_back(&group);
    channel.texts = channel.texts || !named_part(path).empty();
  };
  for (const std::string& name : requested_) {
    const auto behind = path_behind(without_slash(name), topic);
    if (behind && behind->starts_with('.')) add(group_of(topic, behind->substr(1)), behind->substr(1), false);
  }
  const std::vector<Group*> groups = channel.groups;
  for (const std::string& name : requested_) {
    for (Group* group : groups) {
      if (!name.starts_with('/')) add(*group, name, true);
    }
  }
  for (const Group* group : channel.groups) {
    for (const Column& column : group->columns) {
      channel.paths.push_back(column.path);
      if (column.is_time && !group->element.empty())
        channel.paths.push_back(fmt::format("{}.{}", group->element, column.path));
    }
  }
}

MessageValue MessageColumns::decoded(Channel& channel, const LoggedMessage& message) const {
  try {
    if (channel.definition)
      return channel.definition->decode(message.bytes, *channel.encoding, {channel.paths.begin(), channel.paths.end()},
                                        channel.texts);
    MessageValue value = parsed_json(message.bytes);
    if (value.is_discarded()) throw std::runtime_error("it is not valid JSON");
    return value;
  } catch (const std::exception& error) {
    fail_at(message.place, fmt::format("a message of {}: {}", in_quotes(channel.stated.topic), error_text(error)));
  }
}

void MessageColumns::add(std::size_t index, const LoggedMessage& message) {
  Channel& channel = channels_.at(index);
  const MessageValue value = decoded(channel, message);
  if (!channel.is_listed) list_fields(channel, &value);
  for (Group* group : channel.groups) sample(*group, value, message);
}

void MessageColumns::sample(Group& group, const MessageValue& value, const LoggedMessage& message) {
  std::vector<std::vector<double>> found(group.columns.size());
  bool has_any = false;
  for (std::size_t i = 0; i < group.columns.size(); ++i) {
    const Column& column = group.columns[i];
    if (column.path == "log_time")
      found[i] = {1e-9 * static_cast<double>(message.log_time)};
    else if (column.path == "publish_time" && message.publish_time)
      found[i] = {1e-9 * static_cast<double>(*message.publish_time)};
    else if (!column.is_time || group.element.empty() ||
             !append_numbers(value, fmt::format("{}.{}", group.element, column.path), found[i]))
      append_numbers(value, column.path, found[i]);
    has_any = has_any || (!column.is_time && !found[i].empty());
  }
  if (!has_any) return;
  for (std::size_t i = 0; i < found.size(); ++i) group.columns[i].add(found[i]);
  if (!group.log_times.empty() && message.log_time < group.log_times.back()) group.is_ordered = false;
  group.log_times.push_back(message.log_time);
}

// From the definition, else from the first message.
void MessageColumns::list_fields(Channel& channel, const MessageValue* example) {
  std::vector<MessagePath> paths;
  if (channel.definition) {
    paths = channel.definition->paths(kMostListedFields);
  } else if (example) {
    paths = paths_of(*example, kMostListedFields);
  } else if (channel.encoding) {
    const MessageValue schema = parsed_json(channel.stated.schema);
    if (!schema.is_discarded()) paths = paths_of_schema(schema, kMostListedFields);
  }
  channel.is_listed = channel.is_listed || !paths.empty() || example;
  for (const MessagePath& one : paths) {
    const std::string name = fmt::format("{}.{}", without_slash(channel.stated.topic), one.path);
    if (listed_bytes_ + name.size() > kMostListedBytes) return;
    listed_bytes_ += name.size();
    if (listed_.emplace(name, one.width).second) order_.push_back(name);
  }
}

std::vector<LogDataset> MessageColumns::take() {
  std::vector<LogDataset> datasets;
  for (const auto& group : groups_) {
    std::vector<std::size_t> order(group->log_times.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto is_before = [&](std::size_t a, std::size_t b) { return group->log_times[a] < group->log_times[b]; };
    if (!group->is_ordered) std::stable_sort(order.begin(), order.end(), is_before);
    for (Column& column : group->columns) {
      if (column.width == 0) continue;  // in no message
      LogDataset& one = datasets.emplace_back();
      one.name = fmt::format("{}.{}", column.is_time ? group->name : group->topic, column.path);
      one.topic = group->name, one.obstacle = column.obstacle, one.rows = column.rows, one.width = column.width;
      if (column.is_time && (column.path == "log_time" || column.path == "publish_time")) one.unit = "s";
      if (!column.obstacle.empty()) continue;
      if (group->is_ordered) {
        one.values = std::move(column.values);
      } else {
        one.values.reserve(column.values.size());
        for (const std::size_t i : order) {
          const auto begin = column.values.begin() + static_cast<std::ptrdiff_t>(i * column.width);
          one.values.insert(one.values.end(), begin, begin + static_cast<std::ptrdiff_t>(column.width));
        }
      }
      listed_.erase(one.name);
    }
  }
  for (const std::string& name : order_) {
    const auto listed = listed_.find(name);
    if (listed == listed_.end()) continue;
    LogDataset& one = datasets.emplace_back();
    one.name = name, one.width = listed->second.value_or(0);
    one.topic = name.substr(0, name.find('.'));  // only that it is one of messages matters
    const bool has_elements = name.find("[]") != std::string::npos;
    one.obstacle = has_elements ? "select an element by its index or name: [0]" : "no message contains it";
  }
  return datasets;
}

}  // namespace grapnel
