#include "grapnel/scenario/read_optimization_terms.hpp"

#include <fmt/format.h>

#include <array>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

constexpr std::array<Combine, 5> kCombines{Combine::largest, Combine::least, Combine::largest_magnitude, Combine::sum,
                                           Combine::norm};

// Whether the columns are X/x, X/y, X/z.
bool are_one_vector(const Measured& measured, const std::vector<Column>& columns) {
  if (measured.columns.size() != 3) return false;
  const std::string& first = columns[measured.columns[0]].name;
  const std::string stem = first.substr(0, first.size() - 1);
  const char* component = "xyz";
  for (std::size_t k = 0; k < 3; ++k) {
    if (columns[measured.columns[k]].name != stem + component[k]) return false;
  }
  return stem.ends_with('/');
}

void find_columns(const Node& name, const std::string& place, const std::vector<Column>& columns, Measured& measured,
                  FaultList& faults) {
  std::vector<std::string> names;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    names.push_back(columns[c].name);
    if (column_matches(name.text, columns[c].name)) measured.columns.push_back(c);
  }
  if (!measured.columns.empty() || columns.empty() || name.text.empty()) return;
  const std::string near = nearest(name.text, names);
  faults.add(name.mark, fmt::format("no column {} in {}{}", in_quotes(name.text), place,
                                    near.empty() ? "; a sweep's table.csv has them all, see docs/formats/study.md"
                                                 : "; did you mean " + in_quotes(near) + "?"));
}

}  // namespace

Measured read_measured(const Node& node, const std::string& place, bool large_is_bad,
                       const std::vector<Column>& columns, FaultList& faults) {
  Measured measured;
  const Node& name = node.is_mapping() ? part(node, "column") : node;
  if (!name.is_scalar()) return measured;
  measured.name = name.text;
  find_columns(name, place, columns, measured, faults);
  for (const std::size_t column : measured.columns) {
    const bool first = column == measured.columns.front();
    if (first || columns[column].unit == measured.unit)
      measured.unit = columns[column].unit;
    else
      measured.unit.clear();
  }
  const std::string given = text_at(node, "combine");
  measured.combine = are_one_vector(measured, columns) ? Combine::norm
                     : large_is_bad                    ? Combine::largest
                                                       : Combine::least;
  for (const Combine combine : kCombines) {
    if (given == name_of(combine)) measured.combine = combine;
  }
  if (measured.columns.size() > 1) measured.name = fmt::format("{} of {}", name_of(measured.combine), measured.name);
  return measured;
}

std::vector<ObjectiveTerm> read_objective(const Node& node, const std::string& place, bool maximize,
                                          const std::vector<Column>& columns, FaultList& faults) {
  if (!node.is_sequence()) return {{read_measured(node, place, !maximize, columns, faults), 1}};
  std::vector<ObjectiveTerm> terms;
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    const Node& term = node.items[i];
    const double weight = number_at(term, "weight").value_or(1);
    terms.push_back({read_measured(term, item(place, i), (weight > 0) != maximize, columns, faults), weight});
  }
  return terms;
}

std::vector<OptimizationLimit> read_limits(const Node& list, const std::vector<Column>& columns, FaultList& faults) {
  std::vector<OptimizationLimit> limits;
  for (std::size_t i = 0; i < list.items.size(); ++i) {
    const Node& node = list.items[i];
    const bool at_most = node.find("at_most") != nullptr;
    const double bound = number_at(node, at_most ? "at_most" : "at_least").value_or(0);
    limits.push_back({read_measured(node, item("limits", i), at_most, columns, faults), at_most, bound});
  }
  return limits;
}

}  // namespace grapnel
