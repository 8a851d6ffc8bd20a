#include "grapnel/result/described_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grapnel {
namespace {

struct TableColumn {
  const Field* field;  // null: the text of the row
  std::string head, unit;
  char form = 0;  // '~', '%' or 0
};

std::string_view without_blanks(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

// "rate_after = after"
TableColumn column_of(const Type& type, std::string_view text) {
  const std::size_t equals = text.find('=');
  std::string_view key = without_blanks(text.substr(0, equals));
  char form = 0;
  if (key.ends_with('~') || key.ends_with('%')) form = key.back(), key.remove_suffix(1);
  const Field* field = field_named(type, key);
  if (!field && !key.empty())
    throw std::logic_error(std::string(type.name) + " has no field '" + std::string(key) + "'");
  std::string head(equals == text.npos ? key : without_blanks(text.substr(equals + 1)));
  std::replace(head.begin(), head.end(), '_', ' ');
  const std::string_view unit = form == '%' ? "%" : !field || field->unit == "1" ? "" : field->unit;
  return {field, std::move(head), std::string(unit), form};
}

std::vector<TableColumn> columns_of(const Type& type, std::string_view text) {
  std::vector<TableColumn> columns;
  for (std::size_t end = 0; end != text.npos; text.remove_prefix(end == text.npos ? text.size() : end + 1)) {
    end = text.find(';');
    columns.push_back(column_of(type, text.substr(0, end)));
  }
  return columns;
}

std::string number_text(double value, char form) {
  if (std::isnan(value)) return "-";
  if (std::isinf(value)) return "none";
  return form == '%' ? fmt::format("{:.1f}", 100 * value) : form == '~' ? small_number(value) : short_number(value);
}

// Value and its type => text of its cell. Structures have none.
std::string value_text(const Type& type, const void* value, char form) {
  std::string text;
  const auto add_item = [&](const void* item) {
    text += (text.empty() ? "" : ", ") + value_text(type.of(), item, form);
  };
  switch (type.kind) {
    case Type::Kind::boolean:
      return type.whole(value) ? "yes" : "no";
    case Type::Kind::whole:
      return std::to_string(type.whole(value));
    case Type::Kind::real:
      return number_text(*static_cast<const double*>(value), form);
    case Type::Kind::text:
      return *static_cast<const std::string*>(value);
    case Type::Kind::choice:
      return std::string(name_of_choice(type, type.whole(value)));
    case Type::Kind::list:
      if (&type == &type_of<Vector3d>()) return short_vector(*static_cast<const Vector3d*>(value));
      [[fallthrough]];
    case Type::Kind::optional:
      for (std::size_t i = 0; i < type.size(value); ++i) type.show_item(value, i, visitor_of(add_item));
      return text.empty() ? "-" : text;
    case Type::Kind::alternatives:
    case Type::Kind::structure:
      break;
  }
  throw std::logic_error("a table has no cell for a structure");
}

bool is_shown(const Field& field, const void* owner) { return !field.is_present || field.is_present(owner); }

std::string cell_text(const TableColumn& column, const void* owner) {
  std::string text = "-";
  const auto take = [&](const void* value) { text = value_text(column.field->type(), value, column.form); };
  if (is_shown(*column.field, owner)) column.field->show(owner, visitor_of(take));
  return text;
}

}  // namespace

std::string short_vector(const Vector3d& v) {
  const double size = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
  const auto component = [&](double x) { return short_number(std::abs(x) < 1e-12 * size ? 0.0 : x); };
  return "[" + component(v[0]) + ", " + component(v[1]) + ", " + component(v[2]) + "]";
}

std::string small_number(double value) { return fmt::format("{:.3g}", value); }

std::string described_table(const Type& type, const std::vector<DescribedRow>& rows, std::string_view columns) {
  if (rows.empty()) return "";
  const std::vector<TableColumn> all = columns_of(type, columns);
  TextTable table;
  const auto add = [&](auto text_of) {
    std::vector<std::string> cells;
    for (const TableColumn& column : all) cells.push_back(text_of(column));
    table.row(std::move(cells));
  };
  add([](const TableColumn& column) { return column.head; });
  add([](const TableColumn& column) { return column.unit; });
  for (const DescribedRow& row : rows) {
    add([&](const TableColumn& column) {
      if (!column.field) return row.text;
      return cell_text(column, row.owner) + (&column == all.data() ? row.text : "");
    });
  }
  return table.text();
}

std::string described_pairs(const Type& type, const void* owner, std::string_view keys) {
  TextTable table(2);
  for (const TableColumn& column : columns_of(type, keys)) {
    if (is_shown(*column.field, owner)) table.row({column.head, column.unit, cell_text(column, owner)});
  }
  return table.text();
}

}  // namespace grapnel
