// Nastran's matrices: DMIG bulk data entries, and text files of OUTPUT4.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <map>

#include "grapnel/finite_elements/element_text.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel::element_text {
namespace {

std::string upper(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return result;
}

Mark file_mark(const std::string& path) { return {std::make_shared<const std::string>(path), 0, 0}; }

// Which of the matrices that a file has is wanted; empty after a fault.
std::string chosen(const std::vector<std::string>& names, const Wanted& wanted, const std::string& path,
                   const char* kind, FaultList& faults) {
  if (names.empty()) {
    faults.add(file_mark(path), fmt::format("the file has no {} matrix", kind));
    return {};
  }
  if (!wanted.name.empty()) {
    if (std::find(names.begin(), names.end(), upper(wanted.name)) != names.end()) return upper(wanted.name);
    faults.add(file_mark(path), fmt::format("there is no matrix {}{}", in_quotes(wanted.name),
                                            suggestion(upper(wanted.name), names, "there are")));
    return {};
  }
  std::vector<std::string> fitting;
  for (const std::string& name : names) {
    if (names.size() == 1 || name.front() == wanted.initial) fitting.push_back(name);
  }
  if (fitting.size() == 1) return fitting[0];
  faults.add(file_mark(path), fmt::format("the file has {}; say which one with {}", some_of(names),
                                          wanted.initial == 'M' ? "--mass-name" : "--stiffness-name"));
  return {};
}

// --- DMIG ---

// One bulk data entry, as the fields behind its name: of all its lines, eight of 8 characters, four of 16, or what is
// between commas.
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
    std::size_t begin = line.find(',') + 1;  // behind the name, or the mark of a continuation
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

// Calls visit(entry) for every DMIG entry, until one returns false.
template <class Visit>
bool for_dmig_entries(const std::string& path, std::string_view text, Visit visit) {
  Lines lines(path, text);
  BulkEntry entry;
  const auto end_entry = [&] {
    const bool goes_on = entry.fields.empty() || visit(entry);
    entry = {};
    return goes_on;
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
    const std::string plain = upper(name.substr(0, name.find('*')));
    if (plain == "DMIG") append_fields(content, lines, is_wide, entry);
  }
  return end_entry();
}

}  // namespace

std::optional<ElementMatrix> read_dmig(const std::string& path, std::string_view text, const Wanted& wanted,
                                       FaultList& faults) {
  std::vector<std::string> names;
  for_dmig_entries(path, text, [&](const BulkEntry& e) {
    const std::string name = upper(e.fields[0]);
    if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    return true;
  });
  const std::string name = chosen(names, wanted, path, "DMIG", faults);
  if (name.empty()) return std::nullopt;
  std::map<ElementDof, int> row_of;
  std::vector<ElementDof> dofs;
  struct Value {
    int row, column;
    double value;
  };
  std::vector<Value> values;
  bool is_symmetric = false, has_head = false;
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
  const bool is_read = for_dmig_entries(path, text, [&](const BulkEntry& e) {
    if (upper(e.fields[0]) != name) return true;
    if (!has_head) {
      const auto form = integer_of(e.fields[2]), type = integer_of(e.fields[3]);
      if (e.fields[1] != "0" || !form || !type) {
        faults.add(e.marks[0],
                   fmt::format("the first entry of matrix {} must be its head, DMIG {} 0 FORM TYPE", name, name));
        return false;
      }
      if (*form != 1 && *form != 6) {
        faults.add(e.marks[2], fmt::format("the form of matrix {} must be 6 (symmetric) or 1 (square), not {}", name,
                                           in_quotes(e.fields[2])));
        return false;
      }
      if (*type != 1 && *type != 2) {
        faults.add(e.marks[3],
                   fmt::format("matrix {} must be real (type 1 or 2), not {}", name, in_quotes(e.fields[3])));
        return false;
      }
      is_symmetric = *form == 6, has_head = true;
      return true;
    }
    const auto column = dof_at(e, 1);
    if (!column) return false;
    for (std::size_t i = 4; i + 3 < e.fields.size(); i += 4) {
      if (e.fields[i].empty()) continue;
      const auto dof = dof_at(e, i);
      if (!dof) return false;
      const auto value = number_of(e.fields[i + 2]);
      if (!value) {
        faults.add(e.marks[i + 2], fmt::format("{} is no finite number", in_quotes(e.fields[i + 2])));
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
  Entries entries(static_cast<int>(dofs.size()));
  for (const Value& v : values) entries.add(v.row, v.column, v.value);
  auto A = entries.symmetric(
      is_symmetric ? Entries::Triangles::one : Entries::Triangles::both, file_mark(path),
      [&](int r) { return dofs[static_cast<std::size_t>(r)].text(); }, faults);
  if (!A) return std::nullopt;
  return ElementMatrix{fmt::format("{}, matrix {}", path, name), std::move(*A), dofs};
}

// --- OUTPUT4 ---

namespace {

// A matrix's head: columns, rows (negative: strings have a line of two numbers), form, type, name, Fortran format.
struct Output4Head {
  int columns = 0, rows = 0;
  bool wide_strings = false;
  long long form = 0, type = 0;
  std::string name;
  int per_line = 5, width = 16;
};

class Output4Reader {
 public:
  Output4Reader(const std::string& path, std::string_view text, FaultList& faults)
      : lines_(path, text), faults_(faults) {}

  // The next matrix's head; empty at the end, and after a fault.
  std::optional<Output4Head> head() {
    std::optional<std::string_view> line;
    do line = lines_.next();
    while (line && trimmed(*line).empty());
    if (!line) return std::nullopt;
    Output4Head head;
    const auto columns = integer(*line, 0), rows = integer(*line, 1), form = integer(*line, 2),
               type = integer(*line, 3);
    if (!columns || !rows || !form || !type || *columns < 1 || std::abs(*rows) < 1 || *columns > 100'000'000 ||
        std::abs(*rows) > 100'000'000) {
      fault(*line, "the head of a matrix must be columns, rows, form and type, of eight characters each, and its name");
      return std::nullopt;
    }
    head.columns = static_cast<int>(*columns), head.rows = static_cast<int>(std::abs(*rows));
    head.wide_strings = *rows < 0 || head.rows > 65535;
    head.form = *form, head.type = *type;
    head.name = upper(trimmed(line->size() > 32 ? line->substr(32, 8) : std::string_view()));
    std::string format = upper(trimmed(line->size() > 40 ? line->substr(40) : std::string_view()));
    if (format.starts_with("1P,")) format.erase(0, 3);
    if (const std::size_t e = format.find_first_of("ED"); e != std::string::npos && e > 0) {
      const auto per_line = integer_of(std::string_view(format).substr(0, e));
      const std::size_t point = format.find('.', e);
      const auto width = integer_of(std::string_view(format).substr(e + 1, point - e - 1));
      if (!per_line || !width || *per_line < 1 || *per_line > 100 || *width < 8 || *width > 60) {
        fault(*line, fmt::format("cannot read numbers of the format {}", in_quotes(format)));
        return std::nullopt;
      }
      head.per_line = static_cast<int>(*per_line), head.width = static_cast<int>(*width);
    }
    return head;
  }

  // What follows a head: put(row, column, value) for every number. False after a fault.
  template <class Put>
  bool columns(const Output4Head& head, Put put) {
    const int words = head.type % 2 == 1 ? 1 : 2;  // that a number counts for in strings
    while (true) {
      const auto line = lines_.next();
      const auto column = line ? integer(*line, 0) : std::nullopt, row = line ? integer(*line, 1) : std::nullopt,
                 count = line ? integer(*line, 2) : std::nullopt;
      if (!column || !row || !count || *column < 1 || *count < 0 || *row < 0) {
        fault(line.value_or(std::string_view()),
              "a column must begin with its number, its first row and the count of what follows");
        return false;
      }
      if (*column > head.columns) return lines_.next().has_value() || true;  // the end, with one number behind it
      if (*row > 0) {
        if (!numbers(head, *row, *count, [&](int r, double v) { put(r, static_cast<int>(*column) - 1, v); }))
          return false;
        continue;
      }
      for (long long left = *count; left > 0;) {
        const auto string_head = lines_.next();
        // The one number of a short head may be longer than a field.
        const auto first = !string_head        ? std::nullopt
                           : head.wide_strings ? integer(*string_head, 0)
                                               : integer_of(trimmed(*string_head));
        const auto second = string_head && head.wide_strings ? integer(*string_head, 1) : std::optional<long long>(0);
        if (!first || !second || *first < 1) {
          fault(string_head.value_or(std::string_view()),
                "a string of numbers must begin with its length and its first row");
          return false;
        }
        const long long length = head.wide_strings ? *first - 1 : (*first >> 16) - 1;
        const long long first_row = head.wide_strings ? *second : *first & 65535;
        left -= length + (head.wide_strings ? 2 : 1);
        if (!numbers(head, first_row, length / words,
                     [&](int r, double v) { put(r, static_cast<int>(*column) - 1, v); }))
          return false;
      }
    }
  }

  std::optional<long long> integer(std::string_view line, std::size_t field) const {
    return 8 * field < line.size() ? integer_of(trimmed(line.substr(8 * field, 8))) : std::nullopt;
  }

 private:
  void fault(std::string_view part, std::string message) { faults_.add(lines_.mark(part), std::move(message)); }

  template <class Put>
  bool numbers(const Output4Head& head, long long first_row, long long count, Put put) {
    if (first_row < 1 || count < 0 || first_row - 1 + count > head.rows) {
      fault({},
            fmt::format("{} numbers from row {} on are beyond the {} rows of the matrix", count, first_row, head.rows));
      return false;
    }
    std::string_view line;
    const auto width = static_cast<std::size_t>(head.width);
    for (long long i = 0; i < count; ++i) {
      const std::size_t at = static_cast<std::size_t>(i % head.per_line) * width;
      if (at == 0) line = lines_.next().value_or(std::string_view());
      const std::string_view word = at < line.size() ? trimmed(line.substr(at, width)) : std::string_view();
      const auto value = number_of(word);
      if (!value) {
        fault(line, fmt::format("number {} of this column, {}, is no finite number", i + 1, in_quotes(word)));
        return false;
      }
      put(static_cast<int>(first_row - 1 + i), *value);
    }
    return true;
  }

  Lines lines_;
  FaultList& faults_;
};

}  // namespace

std::optional<ElementMatrix> read_output4(const std::string& path, std::string_view text, const Wanted& wanted,
                                          FaultList& faults) {
  std::vector<std::string> names;
  const std::size_t before = faults.size();
  {
    Output4Reader reader(path, text, faults);
    while (const auto head = reader.head()) {
      names.push_back(head->name);
      if (!reader.columns(*head, [](int, int, double) {})) return std::nullopt;
    }
  }
  if (faults.size() > before) return std::nullopt;
  const std::string name = chosen(names, wanted, path, "OUTPUT4", faults);
  if (name.empty()) return std::nullopt;
  Output4Reader reader(path, text, faults);
  while (const auto head = reader.head()) {
    const bool is_it = head->name == name;
    if (is_it && (head->columns != head->rows || head->rows > 2'000'000)) {
      faults.add(file_mark(path),
                 fmt::format("matrix {} must be square, not {} by {}", name, head->rows, head->columns));
      return std::nullopt;
    }
    if (is_it && head->type != 1 && head->type != 2) {
      faults.add(file_mark(path),
                 fmt::format("matrix {} must be real (type 1 or 2), not of type {}", name, head->type));
      return std::nullopt;
    }
    Entries entries(is_it ? head->rows : 1);
    reader.columns(*head, [&](int row, int column, double value) {
      if (is_it) entries.add(row, column, value);
    });
    if (!is_it) continue;
    auto A = entries.symmetric(
        head->form == 6 ? Entries::Triangles::one : Entries::Triangles::both, file_mark(path),
        [](int row) { return std::to_string(row + 1); }, faults);
    if (!A) return std::nullopt;
    return ElementMatrix{fmt::format("{}, matrix {}", path, name), std::move(*A), {}};
  }
  return std::nullopt;
}

}  // namespace grapnel::element_text
