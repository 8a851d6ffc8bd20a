// Names of the rows of a matrix: CalculiX's .dof files, and similar lists.

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "grapnel/import/element_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"

namespace grapnel::element_text {
namespace {

// 0 to 6, or the names of Ansys and others.
std::optional<int> component_of(std::string_view word) {
  if (const auto number = integer_of(word))
    return *number >= 0 && *number <= 6 ? std::optional(static_cast<int>(*number)) : std::nullopt;
  static constexpr std::string_view kNames[][6] = {{"UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"},
                                                   {"T1", "T2", "T3", "R1", "R2", "R3"},
                                                   {"U1", "U2", "U3", "UR1", "UR2", "UR3"},
                                                   {"TX", "TY", "TZ", "RX", "RY", "RZ"}};
  const std::string name = upper(word);
  for (const auto& names : kNames) {
    const auto* const found = std::find(std::begin(names), std::end(names), name);
    if (found != std::end(names)) return static_cast<int>(found - std::begin(names)) + 1;
  }
  return std::nullopt;
}

// The name in the line of row `row`; empty if it is not a name.
std::optional<ElementDof> dof_of(std::string_view line, std::size_t row) {
  auto words = words_of(line, " \t,;");
  if (words.size() == 1) {
    const std::size_t point = words[0].find('.');
    if (point == std::string_view::npos) return std::nullopt;
    words = {words[0].substr(0, point), words[0].substr(point + 1)};
  } else if (words.size() == 3) {
    if (integer_of(words[0]) != static_cast<long long>(row)) return std::nullopt;
    words.erase(words.begin());
  }
  if (words.size() != 2) return std::nullopt;
  const auto node = integer_of(words[0]);
  const auto component = component_of(words[1]);
  if (!node || !component) return std::nullopt;
  return ElementDof{*node, *component};
}

}  // namespace

std::optional<std::vector<ElementDof>> read_dof_names(const std::filesystem::path& path, FaultList& faults) {
  const auto text = read_file(path, file_mark(path.string()), faults, kLargestMatrixFile);
  if (!text) return std::nullopt;
  Lines lines(path.string(), *text);
  std::vector<ElementDof> dofs;
  while (const auto line = lines.next()) {
    const std::string_view content = trimmed(line->substr(0, line->find_first_of("#!$")));
    if (content.empty()) continue;
    const auto dof = dof_of(content, dofs.size() + 1);
    const bool is_heading = dofs.empty() && std::isalpha(static_cast<unsigned char>(content.front())) != 0;
    if (!dof && is_heading) continue;
    if (!dof) {
      faults.add(lines.mark(content),
                 fmt::format("must be NODE.COMPONENT, such as 12.3, NODE COMPONENT or ROW NODE COMPONENT with row {}, "
                             "not {}; components are 0 to 6 or UX, UY, UZ, ROTX, ROTY, ROTZ",
                             dofs.size() + 1, in_quotes(content)));
      return std::nullopt;
    }
    dofs.push_back(*dof);
    if (dofs.size() <= static_cast<std::size_t>(kMaxRows)) continue;
    faults.add(lines.mark(content), fmt::format("a matrix has at most {} rows", kMaxRows));
    return std::nullopt;
  }
  if (!dofs.empty()) return dofs;
  faults.add(file_mark(path.string()), "the file names no rows");
  return std::nullopt;
}

}  // namespace grapnel::element_text
