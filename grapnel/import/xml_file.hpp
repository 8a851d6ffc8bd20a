#pragma once

/// @file
/// XML text whose elements and attributes have their line and column. Faults state the value and the expectation,
/// as those of YAML files do.

#include <memory>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/spatial/vector3.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel {

/// The text of an XML file in UTF-8, without a byte order mark, its declaration saying so. It may be in UTF-16 (with a
/// byte order mark or without), ISO-8859-1, ISO-8859-15, Windows-1252 or US-ASCII if the declaration states it. What is
/// no UTF-8 and declares nothing else is taken as Windows-1252, with a sentence in `note`. Empty, with a fault, for
/// other encodings.
std::optional<std::string> xml_in_utf8(const std::string& path, std::string bytes, std::string& note,
                                       FaultList& faults);

/// The value of an arithmetic expression, as in 35.2644*pi/180: numbers, pi, + - * / ^, parentheses, and sqrt, sin,
/// cos, tan, asin, acos, atan of radians. Empty if it is none.
std::optional<double> arithmetic_value(std::string_view text);

/// A parsed file. The document's nodes are valid as long as it lives.
class XmlFile {
 public:
  /// Whether attributes may have arithmetic expressions where numbers are expected.
  enum class Numbers { plain, arithmetic };

  /// Parses `text`, in any encoding of xml_in_utf8(); `path` is the file's name in messages. What is no XML is a fault
  /// at its place, after which root() is empty.
  XmlFile(const std::string& path, std::string text, FaultList& faults, Numbers numbers = Numbers::plain);
  XmlFile(const XmlFile&) = delete;  // nodes point into the text
  XmlFile& operator=(const XmlFile&) = delete;

  /// The outermost element.
  pugi::xml_node root() const { return document_.document_element(); }
  /// What was assumed about the encoding, a sentence; empty: nothing.
  const std::string& encoding_note() const { return encoding_note_; }
  /// Where the first arithmetic expression was read, and how many were.
  const Mark& first_expression() const { return first_expression_; }
  std::size_t expressions() const { return expressions_; }
  /// Where an element's name stands.
  Mark mark(const pugi::xml_node& node) const;
  /// Where an attribute's name stands; of one that is not there, its element.
  Mark mark(const pugi::xml_node& node, std::string_view attribute) const;

  /// The numbers of an attribute, separated by blanks; `count` of them, any count if it is 0. Empty if the attribute is
  /// not there; a fault, and empty, if these are not finite numbers or not so many.
  std::optional<std::vector<double>> numbers(const pugi::xml_node& node, const char* attribute, std::size_t count,
                                             FaultList& faults) const;
  std::optional<double> number(const pugi::xml_node& node, const char* attribute, FaultList& faults) const;
  std::optional<Vector3d> vector(const pugi::xml_node& node, const char* attribute, FaultList& faults) const;
  /// The text of an attribute that has to be there and not empty, else a fault and an empty text.
  std::string required_text(const pugi::xml_node& node, const char* attribute, FaultList& faults) const;

 private:
  Mark mark_at(std::size_t offset) const;
  std::optional<double> value_of(std::string_view word, const pugi::xml_node& node, const char* attribute) const;
  std::size_t characters_before(std::size_t offset) const;

  std::shared_ptr<const std::string> source_;
  std::string text_;
  std::vector<std::size_t> line_begins_;  // offsets
  // Characters before every kBlock-th byte: a file of one long line is no slower than another.
  static constexpr std::size_t kBlock = 1024;
  std::vector<std::size_t> characters_;
  pugi::xml_document document_;
  Numbers form_;
  std::string encoding_note_;
  mutable std::size_t expressions_ = 0;
  mutable Mark first_expression_;
};

}  // namespace grapnel
