#include "grapnel/describe/contract.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;
using Kind = Type::Kind;

void collect(const Type& type, std::vector<const Type*>& parts) {
  if (type.of) return collect(type.of(), parts);
  for (const auto alternative : type.alternatives) collect(alternative(), parts);
  if (type.kind != Kind::structure && type.kind != Kind::choice) return;
  const auto same = [&](const Type* part) { return part->name == type.name; };
  if (std::any_of(parts.begin(), parts.end(), same)) return;
  parts.push_back(&type);
  for (const Field& field : type.fields) collect(field.type(), parts);
}

bool may_be_absent(const Field& field) {
  return field.is_present || (field.type().kind == Kind::optional && !field.is_null_absent);
}

std::string with_unit(const Field& field) {
  return field.unit.empty() ? std::string(field.text) : std::string(field.text) + " [" + std::string(field.unit) + "]";
}

// ---- JSON Schema ----

Json with_null(Json schema) {
  if (schema.contains("type")) return schema["type"] = Json::array({schema["type"], "null"}), schema;
  return {{"anyOf", Json::array({std::move(schema), {{"type", "null"}}})}};
}

void add_range(const Range& range, Json& schema) {
  if (std::isfinite(range.least)) schema[range.least_excluded ? "exclusiveMinimum" : "minimum"] = range.least;
  if (std::isfinite(range.most)) schema[range.most_excluded ? "exclusiveMaximum" : "maximum"] = range.most;
}

// `nullable`: its numbers may be null, an optional itself.
Json schema_of(const Type& type, const Field& field, bool nullable) {
  switch (type.kind) {
    case Kind::boolean:
      return {{"type", "boolean"}};
    case Kind::text:
      return {{"type", "string"}};
    case Kind::choice:
    case Kind::structure:
      return {{"$ref", "#/definitions/" + std::string(type.name)}};
    case Kind::whole:
    case Kind::real: {
      Json schema = {{"type", type.kind == Kind::whole ? "integer" : "number"}};
      add_range(field.range, schema);
      return type.kind == Kind::real && nullable ? with_null(schema) : schema;
    }
    case Kind::list: {
      Json schema = {{"type", "array"}, {"items", schema_of(type.of(), field, nullable)}};
      if (type.fixed_size > 0) schema["minItems"] = schema["maxItems"] = type.fixed_size;
      return schema;
    }
    case Kind::alternatives: {
      Json schemas = Json::array();
      for (const auto alternative : type.alternatives) schemas.push_back(schema_of(alternative(), field, nullable));
      return {{"anyOf", schemas}};
    }
    case Kind::optional:
      break;
  }
  const Json schema = schema_of(type.of(), field, false);
  return nullable ? with_null(schema) : schema;
}

Json definition_of(const Type& type) {
  if (type.kind == Kind::choice) {
    Json names = Json::array();
    for (const Choice& choice : type.choices) names.push_back(choice.name);
    return {{"enum", names}};
  }
  Json definition = {{"type", "object"}, {"description", type.text}};
  Json required = Json::array(), properties = Json::object(), others = false;
  for (const Field& field : type.fields) {
    if (field.key_of_item) {
      others = schema_of(field.type().of(), field, false);
      continue;
    }
    if (!may_be_absent(field)) required.push_back(field.key);
    Json schema = schema_of(field.type(), field, field.is_null_absent);
    schema["description"] = with_unit(field);
    properties[std::string(field.key)] = std::move(schema);
  }
  definition["required"] = std::move(required);
  definition["properties"] = std::move(properties);
  definition["additionalProperties"] = std::move(others);
  return definition;
}

// ---- TypeScript ----

std::string typescript_of(const Type& type, bool nullable) {
  switch (type.kind) {
    case Kind::boolean:
      return "boolean";
    case Kind::whole:
      return "number";
    case Kind::real:
      return nullable ? "number | null" : "number";
    case Kind::text:
      return "string";
    case Kind::choice:
    case Kind::structure:
      return std::string(type.name);
    case Kind::list: {
      const std::string item = typescript_of(type.of(), nullable);
      if (type.fixed_size == 0) return item.find('|') == std::string::npos ? item + "[]" : "(" + item + ")[]";
      std::string items = item;
      for (std::size_t i = 1; i < type.fixed_size; ++i) items += ", " + item;
      return "[" + items + "]";
    }
    case Kind::alternatives: {
      std::string any;
      for (const auto alternative : type.alternatives)
        any += (any.empty() ? "" : " | ") + typescript_of(alternative(), nullable);
      return any;
    }
    case Kind::optional:
      break;
  }
  return typescript_of(type.of(), false) + (nullable ? " | null" : "");
}

std::string comment_on(const Field& field) {
  std::string text = with_unit(field);
  for (std::size_t at = 0; (at = text.find("*/", at)) != std::string::npos;) text.insert(at + 1, "\\");  // no end yet
  return "  /** " + text + " */\n";
}

std::string interface_of(const Type& type) {
  std::string text = "// " + std::string(type.text) + "\nexport interface " + std::string(type.name) + " {\n";
  std::vector<std::string> values;
  for (const Field& field : type.fields) {
    const std::string value = typescript_of(field.key_of_item ? field.type().of() : field.type(), field.is_null_absent);
    if (std::count(values.begin(), values.end(), value) == 0) values.push_back(value);
    if (field.key_of_item) continue;
    text += comment_on(field) + "  " + std::string(field.key) + (may_be_absent(field) ? "?: " : ": ") + value + ";\n";
  }
  for (const Field& field : type.fields) {
    if (!field.key_of_item) continue;
    std::string all;  // TypeScript wants other keys to be open to what the known ones are
    for (const std::string& value : values) all += (all.empty() ? "" : " | ") + value;
    text += comment_on(field) + "  [" + std::string(field.key) + ": string]: " + all + ";\n";
  }
  return text + "}\n";
}

// The same for a page that shows a structure whatever its fields are: key, unit and text of each.
std::string notes_of(const Type& type) {
  std::string text = "export const k" + std::string(type.name) + ": FieldNote[] = [\n";
  for (const Field& field : type.fields) {
    if (field.key_of_item) continue;
    const Json note = {field.key, field.unit, field.text};
    text += "  " + note.dump() + ",\n";
  }
  return text + "];\n";
}

std::string union_of(const Type& type) {
  std::string names;
  for (const Choice& choice : type.choices) names += (names.empty() ? "\"" : " | \"") + std::string(choice.name) + "\"";
  return "export type " + std::string(type.name) + " = " + names + ";\n";
}

// ---- Markdown ----

std::string choices_of(const Type& type) {
  std::string names;
  for (std::size_t i = 0; i < type.choices.size(); ++i) {
    names += i == 0 ? "" : i + 1 < type.choices.size() ? ", " : " or ";
    names += "`" + std::string(type.choices[i].name) + "`";
  }
  return names;
}

bool is_numbers(const Type& type, std::size_t count) {
  return type.kind == Kind::list && type.fixed_size == count && type.of().kind == Kind::real;
}

// "number", "vector"; of several: "numbers", "vectors".
std::string words_of(const Type& type, bool several) {
  const std::string s = several ? "s" : "";
  switch (type.kind) {
    case Kind::boolean:
      return "boolean" + s;
    case Kind::whole:
      return "whole number" + s;
    case Kind::real:
      return "number" + s;
    case Kind::text:
      return "text" + s;
    case Kind::choice:
      return choices_of(type);
    case Kind::structure:
      return (several ? "list of `" : "`") + std::string(type.name) + "`";
    case Kind::optional:
      return words_of(type.of(), several);
    case Kind::alternatives: {
      std::string any;
      for (const auto alternative : type.alternatives)
        any += (any.empty() ? "" : " or ") + words_of(alternative(), several);
      return any;
    }
    case Kind::list:
      break;
  }
  if (is_numbers(type, 3)) return "vector" + s;
  if (is_numbers(type, 4)) return "quaternion" + s;
  if (type.fixed_size > 0)
    return (several ? "lists of " : "") + std::to_string(type.fixed_size) + " " + words_of(type.of(), true);
  return type.of().kind == Kind::list && !is_numbers(type.of(), 3) ? "list of " + words_of(type.of(), true)
                                                                   : words_of(type.of(), true);
}

// The meaning, with those of an enumeration's names.
std::string meaning_of(const Field& field) {
  std::string text(field.text);
  const Type& type = field.type().kind == Kind::optional ? field.type().of() : field.type();
  for (const Choice& choice : type.choices) {
    if (!choice.text.empty()) text += " `" + std::string(choice.name) + "`: " + std::string(choice.text);
  }
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, "\\");
  return text;
}

std::vector<const Type*> structures_of(const Type& document) {
  std::vector<const Type*> parts = parts_of(document);
  std::erase_if(parts, [](const Type* part) { return part->kind != Kind::structure; });
  return parts;
}

constexpr std::string_view kBegin = "<!-- table ", kAfterName = " -->", kEnd = "<!-- end of table -->";

}  // namespace

std::vector<const Type*> parts_of(const Type& type) {
  std::vector<const Type*> parts;
  collect(type, parts);
  return parts;
}

std::string json_schema(const Type& document, std::string_view title) {
  Json schema = {{"$schema", "http://json-schema.org/draft-07/schema#"},
                 {"title", title},
                 {"description", document.text},
                 {"allOf", Json::array({{{"$ref", "#/definitions/" + std::string(document.name)}}})}};
  for (const Type* part : parts_of(document)) schema["definitions"][std::string(part->name)] = definition_of(*part);
  return schema.dump(2) + "\n";
}

std::string typescript_types(const Type& document, std::string_view origin) {
  std::string text =
      "// " + std::string(origin) + "\n\nexport type FieldNote = readonly [key: string, unit: string, text: string];\n";
  for (const Type* part : parts_of(document))
    text += "\n" + (part->kind == Kind::choice ? union_of(*part) : interface_of(*part) + notes_of(*part));
  return text;
}

std::string markdown_table(const Type& structure) {
  std::string text = "`" + std::string(structure.name) + "`: " + std::string(structure.text) +
                     "\n\n| Key | Type | Unit | Meaning |\n|---|---|---|---|\n";
  for (const Field& field : structure.fields) {
    const std::string key = field.key_of_item ? "*" + std::string(field.key) + "*" : "`" + std::string(field.key) + "`";
    const Type& type = field.key_of_item ? field.type().of() : field.type();
    text += "| " + key + (may_be_absent(field) ? "?" : "") + " | " + words_of(type, false) +
            (field.is_null_absent ? " or null" : "") + " | " + std::string(field.unit) + " | " + meaning_of(field) +
            " |\n";
  }
  return text;
}

std::string page_with_tables(std::string_view page, const Type& document) {
  std::vector<const Type*> unused = structures_of(document);
  std::string remade;
  for (std::size_t begin; (begin = page.find(kBegin)) != std::string_view::npos;) {
    const std::size_t name_at = begin + kBegin.size(), name_end = page.find(kAfterName, name_at);
    const std::size_t end = page.find(kEnd, begin);
    if (name_end == std::string_view::npos || end == std::string_view::npos || end < name_end)
      throw std::runtime_error("a table of the page does not end");
    const std::string_view name = page.substr(name_at, name_end - name_at);
    const auto part = std::find_if(unused.begin(), unused.end(), [&](const Type* t) { return t->name == name; });
    if (part == unused.end()) throw std::runtime_error("no structure for the table " + std::string(name));
    remade += page.substr(0, name_end + kAfterName.size());
    remade += "\n" + markdown_table(**part);
    unused.erase(part);
    remade += kEnd;
    page.remove_prefix(end + kEnd.size());
  }
  return remade + std::string(page);
}

std::vector<std::string> misplaced_tables(std::span<const std::string> pages, const Type& document) {
  std::vector<std::string> misplaced;
  for (const Type* part : structures_of(document)) {
    const std::string place = std::string(kBegin) + std::string(part->name) + std::string(kAfterName);
    std::size_t count = 0;
    for (const std::string& page : pages) {
      for (std::size_t at = 0; (at = page.find(place, at)) != std::string::npos; at += place.size()) ++count;
    }
    if (count != 1) misplaced.emplace_back(part->name);
  }
  return misplaced;
}

}  // namespace grapnel
