#pragma once

/// @file
/// Definitions of ROS messages, and messages in the encodings of ROS 1 and of CDR (ROS 2).

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace grapnel {

/// A decoded message: objects in the order of their definition, arrays, numbers and texts.
using MessageValue = nlohmann::ordered_json;

enum class MessageEncoding { ros1, cdr, json };

/// A field, or a part of one, that a log can be asked for.
struct MessagePath {
  std::string path;                  ///< "angular_velocity.x"; "[]" stands for an index or a name
  std::optional<std::size_t> width;  ///< numbers; empty: it varies
};

/// The types of a message; the first is that of the message.
class MessageDefinition {
 public:
  /// Reads the text of a definition with those of the types that it contains, separated by lines of "=".
  /// @throws std::runtime_error
  MessageDefinition(const std::string& name, std::string_view text);

  /// The fields in the order of definition, at most `most`.
  std::vector<MessagePath> paths(std::size_t most) const;

  /// Decodes the fields that a path begins with, and texts beside them if `texts`; others are skipped.
  /// @throws std::runtime_error for messages that do not agree with the definition
  MessageValue decode(std::string_view bytes, MessageEncoding encoding, const std::vector<std::string_view>& paths,
                      bool texts) const;

  enum class Kind {
    boolean,
    int8,
    uint8,
    byte,  ///< int8 in ROS 1, uint8 in CDR
    int16,
    uint16,
    int32,
    uint32,
    int64,
    uint64,
    float32,
    float64,
    text,
    wide_text,
    time,
    duration,
    structure
  };
  enum class Shape { single, fixed, varying };
  struct Field {
    std::string name;
    Kind kind = Kind::structure;
    std::size_t type = 0;   ///< index, of a structure
    std::string type_name;  ///< as written, of a structure
    Shape shape = Shape::single;
    std::size_t count = 0;  ///< of a fixed array
  };
  struct Type {
    std::string name;
    std::vector<Field> fields;
  };

 private:
  void add_line(std::string_view line);
  void resolve();

  std::vector<Type> types_;
};

/// The numbers of a JSON message's fields, from an example.
std::vector<MessagePath> paths_of(const MessageValue& message, std::size_t most);
/// The same, from a JSON Schema; empty without properties.
std::vector<MessagePath> paths_of_schema(const MessageValue& schema, std::size_t most);

/// The part of a path behind the key, if it begins with it: "a.b" and key "a" => ".b".
std::optional<std::string_view> path_behind(std::string_view path, std::string_view key);

/// Appends the numbers of the part of a message that the path names; null is NaN; a time is one number [s].
/// False: the message has no such part, or it contains texts.
bool append_numbers(const MessageValue& message, std::string_view path, std::vector<double>& numbers);

}  // namespace grapnel
