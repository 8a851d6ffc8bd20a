#include "grapnel/compare/measured_log.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <new>
#include <stdexcept>
#include <utility>

#include "grapnel/result/child_reader.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_file.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/text_file.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLargestLog = std::size_t{1} << 30;  // [bytes]
constexpr std::uint64_t kMostDatasets = 1 << 20;
constexpr double kGibibyte = 1 << 30;
constexpr double kReadingMemory = 4 * kGibibyte;
constexpr double kReadingMemoryPerByte = 8;  // of the file

LogFormat format_of(const fs::path& path, const std::string& bytes) {
  const std::string begin = bytes.substr(0, 16);
  if (is_mcap(begin) || path.extension() == ".mcap") return LogFormat::mcap;
  if (is_rosbag(begin) || path.extension() == ".bag") return LogFormat::rosbag;
  if (begin.substr(0, 8) == "\x89HDF\r\n\x1a\n") return LogFormat::hdf5;
  return begin.starts_with("MATLAB ") || path.extension() == ".mat" ? LogFormat::mat : LogFormat::csv;
}

void send(const std::vector<LogDataset>& datasets, ToParent& parent) {
  parent.count(datasets.size());
  for (const LogDataset& one : datasets) {
    parent.texts({one.name, one.unit, one.obstacle, one.topic});
    parent.count(one.rows);
    parent.count(one.width);
    parent.numbers(one.values);
  }
}

std::vector<LogDataset> take(FromChild& child) {
  const std::uint64_t count = child.count();
  if (count > kMostDatasets) throw std::runtime_error("implausible number of datasets");
  std::vector<LogDataset> datasets(static_cast<std::size_t>(count));
  for (LogDataset& one : datasets) {
    std::vector<std::string> texts = child.texts();
    if (texts.size() != 4) throw std::runtime_error("the reader failed");
    one.name = std::move(texts[0]), one.unit = std::move(texts[1]), one.obstacle = std::move(texts[2]);
    one.topic = std::move(texts[3]);
    one.rows = static_cast<std::size_t>(child.count());
    one.width = static_cast<std::size_t>(child.count());
    one.values = child.numbers<double>();
    if (!one.values.empty() && (one.width == 0 || one.values.size() / one.width != one.rows))
      throw std::runtime_error("the reader failed");
  }
  return datasets;
}

MessageLog read_parts(const fs::path& path, LogFormat format, const std::string& bytes,
                      const std::vector<std::string>& requested) {
  switch (format) {
    case LogFormat::mcap:
      return read_mcap_log(bytes, requested);
    case LogFormat::rosbag:
      return read_bag_log(bytes, requested);
    case LogFormat::hdf5:
      return {read_hdf5_log(path, requested), {}};
    default:
      return {read_mat_log(path, requested), {}};
  }
}

// Generous limit of memory for reading a file of this size, beyond what the process has.
void allow_memory(double bytes) {
  std::ifstream sizes("/proc/self/statm");
  double pages = 0;
  if (!(sizes >> pages)) return;
  const double most =
      pages * static_cast<double>(::sysconf(_SC_PAGESIZE)) + kReadingMemory + kReadingMemoryPerByte * bytes;
  rlimit memory{};
  ::getrlimit(RLIMIT_AS, &memory);
  memory.rlim_cur = std::min(static_cast<rlim_t>(most), memory.rlim_cur);
  ::setrlimit(RLIMIT_AS, &memory);
}

// In a child process, since libraries can crash or loop on a damaged file, or exhaust the memory.
void read_foreign(const fs::path& path, const std::string& bytes, const std::vector<std::string>& requested,
                  MeasuredLog& log) {
  std::optional<hdf5::Session> session(std::in_place);  // no other thread uses HDF5 at the fork
  read_in_child(
      reading_seconds(static_cast<double>(bytes.size())),
      [&](ToParent& parent) {
        const auto size = static_cast<double>(bytes.size());
        allow_memory(size);
        try {
          const MessageLog read = read_parts(path, log.format, bytes, requested);
          parent.texts(read.warnings);
          send(read.datasets, parent);
        } catch (const std::bad_alloc&) {
          throw std::runtime_error(fmt::format("reading needs more memory than the limit of {:.3g} GiB",
                                               (kReadingMemory + kReadingMemoryPerByte * size) / kGibibyte));
        }
      },
      [&](FromChild& child) {
        session.reset();
        log.warnings = child.texts();
        log.datasets = take(child);
      });
}

// The name without " [unit]" at its end, and the unit.
std::pair<std::string_view, std::string_view> without_unit(std::string_view name) {
  const std::size_t open = name.rfind('[');
  if (open == std::string_view::npos || open == 0 || !name.ends_with(']')) return {name, {}};
  std::string_view stem = name.substr(0, open);
  while (stem.ends_with(' ')) stem.remove_suffix(1);
  return {stem, name.substr(open + 1, name.size() - open - 2)};
}

std::optional<std::size_t> find_dataset(const std::vector<LogDataset>& datasets, std::string_view name) {
  for (std::size_t i = 0; i < datasets.size(); ++i) {
    if (datasets[i].name == name) return i;
  }
  const std::string_view path = name.starts_with('/') ? name.substr(1) : name;
  for (std::size_t i = 0; i < datasets.size(); ++i) {
    const LogDataset& one = datasets[i];
    const bool may_state_unit = one.topic.empty();  // "position[shoulder]" of messages does not
    if (one.name == path || (may_state_unit && without_unit(one.name).first == path)) return i;
  }
  return std::nullopt;
}

}  // namespace

Mark MeasuredLog::mark_of(std::size_t sample) const {
  return {source, sample < lines.size() ? lines[sample] : 0, sample < lines.size() ? 1 : 0};
}

std::optional<LogColumn> find_column(const std::vector<LogDataset>& datasets, std::string_view name) {
  if (const auto whole = find_dataset(datasets, name)) return LogColumn{*whole, {}};
  const auto [stem, index] = without_unit(name);
  std::size_t column = 0;
  const auto [end, error] = std::from_chars(index.data(), index.data() + index.size(), column);
  if (index.empty() || error != std::errc() || end != index.data() + index.size()) return std::nullopt;
  const auto dataset = find_dataset(datasets, stem);
  if (!dataset || column >= datasets[*dataset].width) return std::nullopt;
  return LogColumn{*dataset, column};
}

std::vector<std::size_t> requested_datasets(const std::vector<LogDataset>& datasets,
                                            const std::vector<std::string>& requested) {
  std::vector<std::size_t> found;
  for (const std::string& name : requested) {
    const auto column = find_column(datasets, name);
    if (column && std::find(found.begin(), found.end(), column->dataset) == found.end())
      found.push_back(column->dataset);
  }
  return found;
}

std::optional<MeasuredLog> read_log(const fs::path& path, const std::vector<std::string>& requested,
                                    FaultList& faults) {
  MeasuredLog log;
  log.source = std::make_shared<const std::string>(path.string());
  const Mark whole{log.source, 0, 0};
  const auto bytes = read_file(path, whole, faults, kLargestLog);
  if (!bytes) return std::nullopt;
  log.sha256 = sha256(*bytes);
  log.format = format_of(path, *bytes);
  if (log.format == LogFormat::csv) {
    const auto text = checked_text(*bytes, log.source, faults);
    if (!text || !read_csv_log(*text, requested, log, faults)) return std::nullopt;  // without names
  } else {
    try {
      read_foreign(path, *bytes, requested, log);
    } catch (const std::exception& error) {
      faults.add(whole, fmt::format("cannot read the log: {}", error_text(error)));
      return std::nullopt;
    }
  }
  for (LogDataset& one : log.datasets) {
    if (one.unit.empty() && one.topic.empty()) one.unit = without_unit(one.name).second;
  }
  return log;
}

}  // namespace grapnel
