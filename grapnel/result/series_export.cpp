#include "grapnel/result/series_export.hpp"

#include <matio.h>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/result/text_table.hpp"

namespace grapnel {

namespace {

constexpr std::size_t kLongest = 63;  // MATLAB's namelengthmax

constexpr std::array<std::string_view, 20> kKeywords{
    "break",  "case", "catch",     "classdef", "continue",   "else",   "elseif", "end",    "for", "function",
    "global", "if",   "otherwise", "parfor",   "persistent", "return", "spmd",   "switch", "try", "while"};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::string matlab_name(const std::string& name) {
  std::string valid;
  for (const char c : name) valid += is_letter(c) || is_digit(c) ? c : '_';
  const bool keyword = std::find(kKeywords.begin(), kKeywords.end(), valid) != kKeywords.end();
  if (valid.empty() || !is_letter(valid.front()) || keyword) valid.insert(0, 1, 'x');
  return valid.substr(0, kLongest);
}

std::string unique_matlab_name(const std::string& name, std::set<std::string>& taken) {
  const std::string valid = matlab_name(name);
  std::string candidate = valid;
  for (int n = 2; !taken.insert(candidate).second; ++n) {
    const std::string suffix = "_" + std::to_string(n);
    candidate = valid.substr(0, kLongest - suffix.size()) + suffix;
  }
  return candidate;
}

namespace {

constexpr std::size_t kTextBlock = 1 << 20;  // [bytes] written to the file per call

/// A scalar's component has no name, or the name of the quantity, which is not repeated.
std::string column_name(const Series& s, const std::string& component) {
  const std::string own = s.path.substr(s.path.rfind('/') + 1);
  return component.empty() || (s.width() == 1 && component == own) ? s.path : s.path + "/" + component;
}

std::string header(const TimeSeries& series) {
  std::string line = "time [s],phase";
  for (const Series& s : series.series) {
    for (const std::string& component : s.components) {
      line += "," + csv_quoted(column_name(s, component) + " [" + s.unit + "]");
    }
  }
  return line + "\n";
}

void append_rows(const TimeSeries& series, AtomicFile& file, std::string& text) {
  for (std::size_t sample = 0; sample < series.time.size(); ++sample) {
    append_csv_number(series.time[sample], text);
    text += ",";
    text += csv_quoted(series.phases[static_cast<std::size_t>(series.phase[sample])]);
    for (const Series& s : series.series) {
      const std::size_t width = s.components.size();
      for (std::size_t i = 0; i < width; ++i) {
        text += ",";
        append_csv_number(s.data[sample * width + i], text);
      }
    }
    text += "\n";
    if (text.size() >= kTextBlock) {
      file.write(text);
      text.clear();
    }
  }
}

}  // namespace

void write_timeseries_csv(const TimeSeries& series, const std::filesystem::path& path) {
  check_time_series(series);
  AtomicFile file(path);
  std::string text = header(series);
  append_rows(series, file, text);
  file.write(text);
  file.commit();
}

void copy_timeseries_csv(const std::filesystem::path& timeseries, const std::filesystem::path& path) {
  std::optional<AtomicFile> file;  // opened with the first data
  std::string text;
  read_timeseries_blocks(
      timeseries, std::numeric_limits<std::uint64_t>::max(),
      [&](const TimeSeriesHead& head) {
        file.emplace(path);
        text = header(head.names);
      },
      [&](const TimeSeries& block) { append_rows(block, *file, text); });
  file->write(text);
  file->commit();
}

namespace {

// Without a date, so that the same series gives the same bytes.
constexpr const char* kHeader = "MATLAB 5.0 MAT-file, written by Grapnel";

struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

struct CloseMat {
  void operator()(mat_t* mat) const { Mat_Close(mat); }
};
using MatFile = std::unique_ptr<mat_t, CloseMat>;

Variable made(matvar_t* variable) {
  if (variable == nullptr) throw std::bad_alloc();
  return Variable(variable);
}

/// Converts UTF-8 to the UTF-16 of MATLAB's char; invalid UTF-8 becomes U+FFFD.
std::u16string utf16(const std::string& text) {
  std::u16string out;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i++]);
    const int more = lead < 0x80 ? 0 : lead >= 0xF0 && lead < 0xF8 ? 3 : lead >= 0xE0 ? 2 : lead >= 0xC0 ? 1 : -1;
    char32_t point = more <= 0 ? lead : lead & (0x3Fu >> more);
    int left = more;
    for (; left > 0 && i < text.size() && (static_cast<unsigned char>(text[i]) & 0xC0) == 0x80; --left) {
      point = (point << 6) | (static_cast<unsigned char>(text[i++]) & 0x3Fu);
    }
    if (left != 0 || lead >= 0xF8 || point > 0x10FFFF) point = 0xFFFD;
    if (point < 0x10000) {
      out += static_cast<char16_t>(point);
    } else {
      out += static_cast<char16_t>(0xD800 + ((point - 0x10000) >> 10));
      out += static_cast<char16_t>(0xDC00 + ((point - 0x10000) & 0x3FF));
    }
  }
  return out;
}

Variable text_variable(const std::string& text) {
  std::u16string characters = utf16(text);
  std::size_t extent[2] = {characters.empty() ? std::size_t{0} : std::size_t{1}, characters.size()};
  return made(Mat_VarCreate(nullptr, MAT_C_CHAR, MAT_T_UTF16, 2, extent, characters.data(), 0));
}

Variable cell_column(std::vector<Variable> cells) {
  std::size_t extent[2] = {cells.size(), 1};
  Variable result = made(Mat_VarCreate(nullptr, MAT_C_CELL, MAT_T_CELL, 2, extent, nullptr, 0));
  for (std::size_t i = 0; i < cells.size(); ++i) Mat_VarSetCell(result.get(), static_cast<int>(i), cells[i].release());
  return result;
}

Variable cell_of_texts(const std::vector<std::string>& texts) {
  std::vector<Variable> cells;
  cells.reserve(texts.size());
  for (const std::string& text : texts) cells.push_back(text_variable(text));
  return cell_column(std::move(cells));
}

/// samples x width, from row-major to MATLAB's column-major order.
Variable matrix(const std::vector<double>& rows, std::size_t samples, std::size_t width) {
  std::vector<double> columns(rows.size());
  for (std::size_t i = 0; i < samples; ++i) {
    for (std::size_t j = 0; j < width; ++j) columns[j * samples + i] = rows[i * width + j];
  }
  std::size_t extent[2] = {samples, width};
  return made(Mat_VarCreate(nullptr, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, extent, columns.data(), 0));
}

/// Phases counted from 1, as MATLAB indexes phase_names.
Variable phase_column(const std::vector<int>& phases) {
  std::vector<std::int32_t> column;
  column.reserve(phases.size());
  for (const int phase : phases) column.push_back(phase + 1);
  std::size_t extent[2] = {column.size(), 1};
  return made(Mat_VarCreate(nullptr, MAT_C_INT32, MAT_T_INT32, 2, extent, column.data(), 0));
}

/// A MATLAB struct under construction, fields in order of insertion.
class Struct {
 public:
  Struct() = default;
  /// `reserved`: names only for add(); groups of series with these names are renamed.
  explicit Struct(std::set<std::string> reserved) : taken_(std::move(reserved)) {}

  void add(const std::string& name, Variable value) {
    fields_.push_back({std::string(1, '\0') + name, name, std::move(value), nullptr});  // no series has this key
  }

  /// Sets the value at `path` below this struct and creates missing structs. Returns the path in MATLAB:
  /// "base.position".
  std::string set(const std::string& path, Variable value) {
    const std::size_t slash = path.find('/');
    Field& field = field_of(path.substr(0, slash));
    if (slash == std::string::npos) {
      field.value = std::move(value);
      return field.name;
    }
    if (!field.group) field.group = std::make_unique<Struct>();
    return field.name + "." + field.group->set(path.substr(slash + 1), std::move(value));
  }

  /// Moves the values to the caller.
  Variable variable(const char* name) {
    std::vector<const char*> names;
    for (const Field& field : fields_) names.push_back(field.name.c_str());
    std::size_t extent[2] = {1, 1};
    Variable result = made(Mat_VarCreateStruct(name, 2, extent, names.data(), static_cast<unsigned>(names.size())));
    for (Field& field : fields_) {
      Variable value = field.group ? field.group->variable(nullptr) : std::move(field.value);
      Mat_VarSetStructFieldByName(result.get(), field.name.c_str(), 0, value.release());
    }
    return result;
  }

 private:
  struct Field {
    std::string key;   // as in the path
    std::string name;  // as in MATLAB
    Variable value;
    std::unique_ptr<Struct> group;
  };

  Field& field_of(const std::string& key) {
    for (Field& field : fields_) {
      if (field.key == key) return field;
    }
    fields_.push_back({key, unique_matlab_name(key, taken_), nullptr, nullptr});
    return fields_.back();
  }

  std::vector<Field> fields_;
  std::set<std::string> taken_;
};

/// The leaf of `info` for the series at the same path.
Variable series_info(const Series& s) {
  Struct info;
  info.add("unit", text_variable(s.unit));
  info.add("description", text_variable(s.description));
  info.add("components", cell_of_texts(s.components));
  info.add("path", text_variable(s.path));
  return info.variable(nullptr);
}

Variable document(const TimeSeries& series, const TimeSeriesMetadata& metadata) {
  Struct top({"schema", "version", "scenario", "sha256", "time", "phase", "phase_names", "info", "names"});
  top.add("schema", text_variable(kTimeSeriesSchema));
  top.add("version", text_variable(metadata.version));
  top.add("scenario", text_variable(metadata.scenario_name));
  top.add("sha256", text_variable(metadata.scenario_sha256));
  top.add("time", matrix(series.time, series.time.size(), 1));
  top.add("phase", phase_column(series.phase));
  top.add("phase_names", cell_of_texts(series.phases));
  Struct info;
  std::vector<std::string> matlab_names, paths;
  for (const Series& s : series.series) {
    if (s.width() == 0) continue;
    matlab_names.push_back(top.set(s.path, matrix(s.data, series.time.size(), s.components.size())));
    paths.push_back(s.path);
    info.set(s.path, series_info(s));
  }
  top.add("info", info.variable(nullptr));
  Struct names;
  names.add("matlab", cell_of_texts(matlab_names));
  names.add("path", cell_of_texts(paths));
  top.add("names", names.variable(nullptr));
  return top.variable("grapnel");
}

bool same(matvar_t& a, matvar_t& b);

bool same_children(matvar_t& a, matvar_t& b, std::size_t count) {
  const auto* of_a = static_cast<matvar_t* const*>(a.data);
  const auto* of_b = static_cast<matvar_t* const*>(b.data);
  for (std::size_t i = 0; i < count; ++i) {
    if (of_a[i] == nullptr || of_b[i] == nullptr || !same(*of_a[i], *of_b[i])) return false;
  }
  return true;
}

/// Whether two variables hold the same numbers, texts and fields.
bool same(matvar_t& a, matvar_t& b) {
  if (a.class_type != b.class_type || a.rank != 2 || b.rank != 2) return false;
  if (a.dims[0] != b.dims[0] || a.dims[1] != b.dims[1]) return false;
  const std::size_t items = a.dims[0] * a.dims[1];
  if (a.class_type == MAT_C_CELL) return same_children(a, b, items);
  if (a.class_type == MAT_C_STRUCT) {
    const unsigned fields = Mat_VarGetNumberOfFields(&a);
    return fields == Mat_VarGetNumberOfFields(&b) && same_children(a, b, items * fields);
  }
  if (items == 0) return true;
  return a.nbytes == b.nbytes && a.data != nullptr && b.data != nullptr && std::memcmp(a.data, b.data, a.nbytes) == 0;
}

/// matio reports few disk errors, so the file is read back. Throws the reason.
void save(matvar_t& document, const std::filesystem::path& path) {
  Mat_LogInitFunc("grapnel", [](int, char*) {});  // it prints otherwise
  {
    const MatFile file(Mat_CreateVer(path.c_str(), kHeader, MAT_FT_MAT5));
    if (!file) throw std::runtime_error("the file cannot be created");
    if (Mat_VarWrite(file.get(), &document, MAT_COMPRESSION_ZLIB) != 0) throw std::runtime_error("writing failed");
  }
  const MatFile file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  const Variable written(file ? Mat_VarRead(file.get(), document.name) : nullptr);
  if (!written || !same(document, *written))
    throw std::runtime_error("the written file is incomplete; is the disk full?");
}

/// The format counts bytes with 32 bits, and MATLAB stops at 2 GiB per variable.
void check_size(const TimeSeries& series) {
  std::size_t numbers = 2 * series.time.size();
  for (const Series& s : series.series) numbers += s.data.size();
  constexpr std::size_t kMost = (std::size_t{1} << 31) - (std::size_t{1} << 24);  // room for names and texts
  if (numbers * sizeof(double) > kMost) {
    throw std::runtime_error("the series take more than 2 GiB, the limit of MAT files of version 5; use timeseries.h5");
  }
}

}  // namespace

void write_timeseries_mat(const TimeSeries& series, const TimeSeriesMetadata& metadata,
                          const std::filesystem::path& path) {
  check_time_series(series);
  AtomicFile file(path);
  try {
    check_size(series);
    save(*document(series, metadata), file.temporary());
  } catch (const std::exception& e) {
    throw CannotWrite("cannot write " + path.string() + ": " + e.what());
  }
  file.commit();
}

std::filesystem::path export_csv(const std::filesystem::path& folder) {
  std::filesystem::path path = folder / "timeseries.csv";
  copy_timeseries_csv(folder / "timeseries.h5", path);
  return path;
}

std::filesystem::path export_mat(const std::filesystem::path& folder) {
  const std::filesystem::path source = folder / "timeseries.h5";
  std::filesystem::path path = folder / "timeseries.mat";
  const ReadTimeSeries read = read_timeseries(source);
  write_timeseries_mat(read.series, read.head.metadata, path);
  return path;
}

}  // namespace grapnel
