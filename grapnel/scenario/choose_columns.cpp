#include "grapnel/scenario/choose_columns.hpp"

#include <fmt/format.h>

#include "grapnel/text/message_text.hpp"

namespace grapnel {

std::vector<bool> chosen_columns(const Node& list, const std::vector<Column>& columns, FaultList& faults) {
  std::vector<std::string> names;
  for (const Column& column : columns) names.push_back(column.name);
  std::vector<bool> chosen(columns.size(), false);
  for (std::size_t c = 0; !list.is_sequence() && c < columns.size(); ++c) chosen[c] = columns[c].by_default;
  for (const Node& pattern : list.items) {
    bool any = false;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (!column_matches(pattern.text, names[c])) continue;
      chosen[c] = any = true;
    }
    if (any || columns.empty() || pattern.text.empty()) continue;
    const std::string near = nearest(pattern.text, names);
    faults.add(pattern.mark, fmt::format("no column {}{}", in_quotes(pattern.text),
                                         near.empty() ? "; without 'columns' the table has all but those of loads"
                                                      : "; did you mean " + in_quotes(near) + "?"));
  }
  return chosen;
}

}  // namespace grapnel
