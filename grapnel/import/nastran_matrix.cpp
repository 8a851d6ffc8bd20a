// Nastran's DMIG bulk data entries, and common parts of formats with several matrices.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <map>

#include "grapnel/import/element_text.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel::element_text {

std::string chosen(const std::vector<NamedMatrix>& matrices, const Wanted& wanted, const std::string& path,
                   const char* kind, FaultList& faults) {
  std::vector<std::string> names;
  for (const NamedMatrix& m : matrices) names.push_back(m.name);
  if (names.empty()) {
    faults.add(file_mark(path), fmt::format("the file has no {} matrix", kind));
    return {};
  }
  if (!wanted.name.empty()) {
    if (std::find(names.begin(), names.end(), upper(wanted.name)) != names.end()) return upper(wanted.name);
    faults.add(file_mark(path), fmt::format("the file has no matrix {}{}", in_quotes(wanted.name),
                                            suggestion(upper(wanted.name), names, "there are")));
    return {};
  }
  const auto fitting = [&](bool by_initial, bool only_usable) {
    std::vector<std::string> found;
    for (const NamedMatrix& m : matrices) {
      if ((!by_initial || m.name.starts_with(wanted.initial)) && (!only_usable || m.is_usable)) found.push_back(m.name);
    }
    return found;
  };
  if (names.size() == 1) return names[0];
  // Real and square ones first: a complex or rectangular matrix is neither a mass nor a stiffness matrix. Without one,
  // the following error names the only one with the initial.
  for (const bool only_usable : {true, false}) {
    const auto found = fitting(true, only_usable);
    if (found.size() == 1) return found[0];
  }
  if (const auto usable = fitting(false, true); fitting(true, false).empty() && usable.size() == 1) return usable[0];
  faults.add(file_mark(path), fmt::format("the file has {}; select one with {}", some_of(names),
                                          wanted.initial == 'M' ? "--mass-name" : "--stiffness-name"));
  return {};
}

namespace {

// --- DMIG ---

// One bulk data entry, as the fields after its name: of all its lines, eight of 8 characters, four of 16, or
// comma-separated.
struct BulkEntry {
  std::vector<std::string_view> fields;
  std::vector<Mark> marks;
};

void append_fields(std::string_view line, const Lines& lines, bool is_wide, BulkEntry& entry) {
  const auto put = [&](std::string_view field) {
    field = trimmed(field);
    entry.fields.push_back(field);
    entry.marks.push_back(lines.mark(field));
  };
  if (line.find(',') != std::string_view::npos) {
    std::size_t begin = line.find(',') + 1;  // after the name, or the mark of a continuation
    for (int k = 0; k < (is_wide ? 4 : 8); ++k) {
      if (begin > line.size()) {
        put({});
        continue;
      }
      const std::size_t end = std::min(line.find(',', begin), line.size());
      put(line.substr(begin, end - begin));
      begin = end + 1;
    }
    return;
  }
  const std::size_t width = is_wide ? 16 : 8;
  for (std::size_t k = 0; k < (is_wide ? 4u : 8u); ++k) {
    const std::size_t begin = 8 + k * width;
    put(begin < line.size() ? line.substr(begin, width) : std::string_view());
  }
}

// Calls visit(name, entry) for every DMIG, GRID and GRDSET entry, until one returns false.
template <class Visit>
bool for_bulk_entries(const std::string& path, std::string_view text, Visit visit) {
  Lines lines(path, text);
  BulkEntry entry;
  std::string entry_name;
  const auto end_entry = [&] {
    const bool continues = entry.fields.empty() || visit(entry_name, entry);
    entry = {};
    return continues;
  };
  while (const auto line = lines.next()) {
    const std::string_view content = line->substr(0, line->find('$'));
    if (trimmed(content).empty()) continue;
    const std::string_view first =
        content.substr(0, std::min(content.find(','), std::min<std::size_t>(8, content.size())));
    const std::string_view name = trimmed(first);
    const bool is_wide = name.ends_with('*') || name.starts_with('*');
    if (name.empty() || name.front() == '+' || name.front() == '*') {
      if (!entry.fields.empty()) append_fields(content, lines, is_wide, entry);
      continue;
    }
    if (!end_entry()) return false;
    entry_name = upper(name.substr(0, name.find('*')));
    if (entry_name == "DMIG" || entry_name == "GRID" || entry_name == "GRDSET")
      append_fields(content, lines, is_wide, entry);
  }
  return end_entry();
}

// The contents of a file besides the selected matrix.
struct BulkContents {
  std::vector<NamedMatrix> matrices;
  std::map<long long, long long> rotated_nodes;
};

BulkContents contents_of(const std::string& path, std::string_view text) {
  BulkContents contents;
  constexpr long long kEmpty = -2;         // uses that of GRDSET; -1 is that of a fluid, which has no directions
  std::map<long long, long long> systems;  // field CD of nodes
  long long usual = 0;                     // that of GRDSET
  for_bulk_entries(path, text, [&](const std::string& kind, const BulkEntry& e) {
    if (kind != "DMIG") {
      const auto node = integer_of(e.fields[0]);
      const auto system = e.fields.size() > 5 ? integer_of(e.fields[5]) : std::nullopt;
      if (kind == "GRDSET") usual = system.value_or(0);
      if (kind == "GRID" && node) systems[*node] = system.value_or(kEmpty);
      return true;
    }
    const std::string name = upper(e.fields[0]);
    const auto known = std::find_if(contents.matrices.begin(), contents.matrices.end(),
                                    [&](const NamedMatrix& m) { return m.name == name; });
    if (name.empty() || known != contents.matrices.end()) return true;
    const auto form = integer_of(e.fields[2]), type = integer_of(e.fields[3]);
    contents.matrices.push_back({name, (form == 1 || form == 6) && (type == 1 || type == 2)});
    return true;
  });
  for (const auto& [node, system] : systems) {
    const long long its = system == kEmpty ? usual : system;
    if (its > 0) contents.rotated_nodes.emplace(node, its);
  }
  return contents;
}

// An entry of the matrix.
struct DmigValue {
  int row, column;
  double value;
};

struct DmigHead {
  bool is_symmetric, is_single;
};

// The first entry of a matrix.
std::optional<DmigHead> read_dmig_head(const BulkEntry& e, const std::string& name, FaultList& faults) {
  const auto form = integer_of(e.fields[2]), type = integer_of(e.fields[3]);
  if (e.fields[1] != "0" || !form || !type) {
    faults.add(e.marks[0],
               fmt::format("the first entry of matrix {} must be its head, DMIG {} 0 FORM TYPE", name, name));
    return std::nullopt;
  }
  if (*form != 1 && *form != 6) {
    faults.add(e.marks[2], fmt::format("the form of matrix {} must be 6 (symmetric) or 1 (square), not {}", name,
                                       in_quotes(e.fields[2])));
    return std::nullopt;
  }
  if (*type != 1 && *type != 2) {
    faults.add(e.marks[3], fmt::format("matrix {} must be real (type 1 or 2), not {}; type 3 or 4 is complex", name,
                                       in_quotes(e.fields[3])));
    return std::nullopt;
  }
  return DmigHead{*form == 6, *type == 1};
}

}  // namespace

std::optional<ElementMatrix> read_dmig(const std::string& path, std::string_view text, const Wanted& wanted,
                                       FaultList& faults) {
  const BulkContents contents = contents_of(path, text);
  const std::string name = chosen(contents.matrices, wanted, path, "DMIG", faults);
  if (name.empty()) return std::nullopt;
  std::map<ElementDof, int> row_of;
  std::vector<ElementDof> dofs;
  std::vector<DmigValue> values;
  std::optional<DmigHead> head;
  const auto row = [&](const ElementDof& dof) {
    const auto [at, is_new] = row_of.emplace(dof, static_cast<int>(dofs.size()));
    if (is_new) dofs.push_back(dof);
    return at->second;
  };
  const auto dof_at = [&](const BulkEntry& e, std::size_t i) -> std::optional<ElementDof> {
    const auto node = integer_of(e.fields[i]);
    const auto component = e.fields[i + 1].empty() ? std::optional<long long>(0) : integer_of(e.fields[i + 1]);
    if (node && *node > 0 && component && *component >= 0 && *component <= 6)
      return ElementDof{*node, static_cast<int>(*component)};
    faults.add(e.marks[i], fmt::format("must be a node and its component from 0 to 6, not {} and {}",
                                       in_quotes(e.fields[i]), in_quotes(e.fields[i + 1])));
    return std::nullopt;
  };
  const bool is_read = for_bulk_entries(path, text, [&](const std::string& kind, const BulkEntry& e) {
    if (kind != "DMIG" || upper(e.fields[0]) != name) return true;
    if (!head) {
      head = read_dmig_head(e, name, faults);
      return head.has_value();
    }
    const auto column = dof_at(e, 1);
    if (!column) return false;
    for (std::size_t i = 4; i + 3 < e.fields.size(); i += 4) {
      if (e.fields[i].empty()) continue;
      const auto dof = dof_at(e, i);
      if (!dof) return false;
      const auto value = number_of(e.fields[i + 2]);
      if (!value) {
        faults.add(e.marks[i + 2], fmt::format("{} is not a finite number", in_quotes(e.fields[i + 2])));
        return false;
      }
      values.push_back({row(*dof), row(*column), *value});
    }
    return true;
  });
  if (!is_read) return std::nullopt;
  if (values.empty()) {
    faults.add(file_mark(path), fmt::format("matrix {} has no entries", name));
    return std::nullopt;
  }
  Entries entries(static_cast<int>(dofs.size()), head->is_single ? Entries::kSingleRounding : Entries::kRounding);
  for (const DmigValue& v : values) entries.add(v.row, v.column, v.value);
  auto A = entries.symmetric(
      head->is_symmetric ? Entries::Triangles::one : Entries::Triangles::both, file_mark(path),
      [&](int r) { return dofs[static_cast<std::size_t>(r)].text(); }, faults);
  if (!A) return std::nullopt;
  return ElementMatrix{fmt::format("{}, matrix {}", path, name), std::move(*A), dofs, contents.rotated_nodes};
}

}  // namespace grapnel::element_text
