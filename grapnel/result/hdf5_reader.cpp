#include "grapnel/result/hdf5_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/child_reader.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_file.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using hdf5::check;
using hdf5::Handle;

constexpr int kDeepestGroup = 32;                // nested groups; deeper is a damaged file that points to itself
constexpr std::uintmax_t kInMemory = 256 << 20;  // [bytes] larger files are read from the disk
constexpr std::uint64_t kBlockBytes = 8 << 20;   // size of one block of numbers

// --- In the child: HDF5
// -----------------------------------------------------------------------------------------------

/// An open file.
struct Source {
  std::uintmax_t bytes;  // its size
  Handle file;
};

/// A dataset of a series, and what is known of it without its numbers.
struct Ordered {
  int order;
  Series series;  // without data
  Handle dataset;
};

std::string bytes_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  if (!stream) throw std::runtime_error(std::generic_category().message(errno));
  const std::streamoff size = stream.tellg();
  if (size < 0) throw std::runtime_error("not a file");
  std::string bytes(static_cast<std::size_t>(size), '\0');
  stream.seekg(0);
  if (!stream.read(bytes.data(), size)) throw std::runtime_error("the file cannot be read");
  return bytes;
}

Source checked(Source source) {
  const Handle root(H5Gopen2(source.file.id(), "/", H5P_DEFAULT), H5Gclose, "damaged: no root group");
  const std::string schema = hdf5::read_string_attribute(root, "schema");
  if (schema != kTimeSeriesSchema) throw std::runtime_error("schema is '" + schema + "', not " + kTimeSeriesSchema);
  return source;
}

/// From memory: no lock on the file, and nothing changes while HDF5 reads.
Source open_small(const fs::path& path) {
  std::string bytes = bytes_of(path);
  unseal(bytes);
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "file access");
  check(H5Pset_fapl_core(access.id(), 1 << 20, false), "file in memory");
  check(H5Pset_file_image(access.id(), bytes.data(), bytes.size()), "file in memory");
  Handle file(H5Fopen("timeseries", H5F_ACC_RDONLY, access.id()), H5Fclose, "truncated or damaged");
  const ssize_t end = H5Fget_file_image(file.id(), nullptr, 0);
  // A seal that was truncated or overwritten: the data before it may be damaged too.
  if (end != static_cast<ssize_t>(bytes.size())) throw std::runtime_error("damaged: data after the end");
  return checked({bytes.size(), std::move(file)});
}

Source open_large(const fs::path& path, std::uintmax_t size) {
  check_file_seal(path);
  return checked({size, hdf5::open_on_disk(path)});
}

Source open(const fs::path& path) {
  const std::uintmax_t size = fs::file_size(path);
  std::string begin(8, ' ');
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(std::generic_category().message(errno));
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  if (begin != "\x89HDF\r\n\x1a\n") throw std::runtime_error("not an HDF5 file");
  return size <= kInMemory ? open_small(path) : open_large(path, size);
}

std::vector<hsize_t> extent_of(const Handle& dataset, const std::string& name) {
  const Handle space(H5Dget_space(dataset.id()), H5Sclose, name);
  const int rank = H5Sget_simple_extent_ndims(space.id());
  if (rank != 1 && rank != 2) throw std::runtime_error("'" + name + "' has " + std::to_string(rank) + " dimensions");
  std::vector<hsize_t> extent(static_cast<std::size_t>(rank));
  check(H5Sget_simple_extent_dims(space.id(), extent.data(), nullptr), name);
  return extent;
}

/// Rows and width of a dataset that the file can hold.
std::vector<hsize_t> checked_extent(const Source& source, const Handle& dataset, std::size_t number_size,
                                    const std::string& name) {
  std::vector<hsize_t> extent = extent_of(dataset, name);
  // Deflate gains a factor of 1032 at most: larger claims are damage, and must not exhaust the memory.
  const double claimed = static_cast<double>(extent[0]) * (extent.size() > 1 ? static_cast<double>(extent[1]) : 1);
  if (claimed * static_cast<double>(number_size) > 1100.0 * static_cast<double>(source.bytes))
    throw std::runtime_error("damaged: '" + name + "' declares more numbers than the file can hold");
  return extent;
}

/// Rows `begin` to `begin` + `count`, converted to T.
template <class T>
std::vector<T> rows(const Handle& dataset, hid_t memory_type, hsize_t begin, hsize_t count, hsize_t width,
                    const std::string& name) {
  std::vector<T> values(static_cast<std::size_t>(count * width));
  if (values.empty()) return values;
  const std::string what = "damaged: '" + name + "'";
  const Handle on_disk(H5Dget_space(dataset.id()), H5Sclose, what);
  const int rank = H5Sget_simple_extent_ndims(on_disk.id());
  const hsize_t from[2]{begin, 0}, size[2]{count, width};
  check(H5Sselect_hyperslab(on_disk.id(), H5S_SELECT_SET, from, nullptr, size, nullptr), what);
  const Handle in_memory(H5Screate_simple(rank, size, nullptr), H5Sclose, what);
  check(H5Dread(dataset.id(), memory_type, in_memory.id(), on_disk.id(), H5P_DEFAULT, values.data()), what);
  return values;
}

Series describe(const Source& source, const Handle& dataset, const std::string& path, hsize_t samples) {
  Series s;
  s.path = path;
  s.unit = hdf5::read_string_attribute(dataset, "unit");
  s.description = hdf5::read_string_attribute(dataset, "description");
  s.components = hdf5::read_strings_attribute(dataset, "components");
  const std::vector<hsize_t> extent = checked_extent(source, dataset, sizeof(double), path);
  if (s.components.size() != (extent.size() > 1 ? extent[1] : 1))
    throw std::runtime_error("'" + path + "': attribute components does not fit its width");
  if (extent[0] != samples)
    throw std::runtime_error("'" + path + "' has " + std::to_string(extent[0]) + " rows, not " +
                             std::to_string(samples));
  return s;
}

std::string link_name(const Handle& group, hsize_t index) {
  const auto name_into = [&](char* buffer, std::size_t size) {
    return H5Lget_name_by_idx(group.id(), ".", H5_INDEX_NAME, H5_ITER_INC, index, buffer, size, H5P_DEFAULT);
  };
  const ssize_t length = name_into(nullptr, 0);
  if (length <= 0) hdf5::fail("damaged: a name in a group");
  std::vector<char> buffer(static_cast<std::size_t>(length) + 1);
  if (name_into(buffer.data(), buffer.size()) < 0) hdf5::fail("damaged: a name in a group");
  return {buffer.data(), static_cast<std::size_t>(length)};
}

void collect(const Source& source, const Handle& group, const std::string& prefix, int depth, hsize_t samples,
             std::vector<Ordered>& found) {
  if (depth > kDeepestGroup) throw std::runtime_error("damaged: groups are nested too deeply");
  H5G_info_t info;
  check(H5Gget_info(group.id(), &info), "damaged: group '" + prefix + "'");
  for (hsize_t i = 0; i < info.nlinks; ++i) {
    const std::string name = link_name(group, i);
    const std::string path = prefix + name;
    if (path == "time" || path == "phase") continue;
    H5L_info_t link;
    check(H5Lget_info(group.id(), name.c_str(), &link, H5P_DEFAULT), "damaged: '" + path + "'");
    if (link.type != H5L_TYPE_HARD) continue;  // ours has no links elsewhere
    Handle object(H5Oopen(group.id(), name.c_str(), H5P_DEFAULT), H5Oclose, "damaged: '" + path + "'");
    const H5I_type_t type = H5Iget_type(object.id());
    if (type == H5I_GROUP) collect(source, object, path + "/", depth + 1, samples, found);
    if (type != H5I_DATASET) continue;
    const int order = hdf5::read_int_attribute(object, "order", static_cast<int>(found.size()));
    Series series = describe(source, object, path, samples);
    found.push_back({order, std::move(series), std::move(object)});
  }
}

/// Selects the samples to send: every `every`-th, and the first and the last of each phase.
std::vector<std::size_t> selected_samples(const std::vector<int>& phase, std::uint64_t begin, std::uint64_t end,
                                          std::uint64_t every) {
  std::vector<std::size_t> which;
  for (std::uint64_t i = begin; i < end; ++i) {
    const bool first = i == 0 || phase[i] != phase[i - 1], last = i + 1 == phase.size() || phase[i] != phase[i + 1];
    if (i % every == 0 || first || last) which.push_back(static_cast<std::size_t>(i - begin));
  }
  return which;
}

template <class T>
void send_rows(ToParent& parent, const std::vector<T>& values, std::size_t width,
               const std::vector<std::size_t>& which) {
  std::vector<T> sent;
  sent.reserve(which.size() * width);
  for (const std::size_t row : which)
    sent.insert(sent.end(), values.begin() + static_cast<std::ptrdiff_t>(row * width),
                values.begin() + static_cast<std::ptrdiff_t>((row + 1) * width));
  parent.numbers(sent);
}

void send_metadata(ToParent& parent, const Source& source) {
  const Handle root(H5Gopen2(source.file.id(), "/", H5P_DEFAULT), H5Gclose, "damaged: no root group");
  for (const char* name : {"version", "scenario", "sha256"}) parent.text(hdf5::read_string_attribute(root, name));
}

struct Opened {
  Handle time, phase;
  std::vector<int> phases;  // of each sample
  std::vector<Ordered> series;
  hsize_t samples = 0;
  std::uint64_t row_bytes = 0;
};

Opened open_series(const Source& source) {
  Opened o{{H5Dopen2(source.file.id(), "time", H5P_DEFAULT), H5Dclose, "no dataset time"},
           {H5Dopen2(source.file.id(), "phase", H5P_DEFAULT), H5Dclose, "no dataset phase"},
           {},
           {}};
  const std::vector<hsize_t> time = checked_extent(source, o.time, sizeof(double), "time"),
                             phase = checked_extent(source, o.phase, sizeof(int), "phase");
  if (time.size() != 1 || phase.size() != 1 || time[0] != phase[0])
    throw std::runtime_error("damaged: 'phase' does not fit 'time'");
  o.samples = time[0];
  o.phases = rows<int>(o.phase, H5T_NATIVE_INT, 0, o.samples, 1, "phase");
  const Handle root(H5Gopen2(source.file.id(), "/", H5P_DEFAULT), H5Gclose, "damaged: no root group");
  collect(source, root, "", 0, o.samples, o.series);
  std::stable_sort(o.series.begin(), o.series.end(),
                   [](const Ordered& a, const Ordered& b) { return a.order < b.order; });
  o.row_bytes = sizeof(double) + sizeof(int);
  for (const Ordered& one : o.series) o.row_bytes += sizeof(double) * one.series.components.size();
  return o;
}

void send_series(const fs::path& path, std::uint64_t max_bytes, ToParent& parent) {
  const Source source = open(path);
  const Opened o = open_series(source);
  send_metadata(parent, source);
  parent.texts(hdf5::read_strings_attribute(o.phase, "names"));
  parent.count(o.series.size());
  for (const Ordered& one : o.series) {
    parent.text(one.series.path);
    parent.text(one.series.unit);
    parent.text(one.series.description);
    parent.texts(one.series.components);
  }
  const std::uint64_t max_rows = std::max<std::uint64_t>(max_bytes / o.row_bytes, 1);
  const std::uint64_t every = o.samples <= max_rows ? 1 : (o.samples + max_rows - 1) / max_rows;
  parent.count(o.samples);
  parent.count(every);
  const hsize_t at_once = std::max<hsize_t>(kBlockBytes / o.row_bytes, 1);
  for (hsize_t begin = 0; begin < o.samples; begin += at_once) {
    const hsize_t count = std::min(at_once, o.samples - begin);
    const std::vector<std::size_t> which = selected_samples(o.phases, begin, begin + count, every);
    send_rows(parent, rows<double>(o.time, H5T_NATIVE_DOUBLE, begin, count, 1, "time"), 1, which);
    send_rows(parent,
              std::vector<int>(o.phases.begin() + static_cast<std::ptrdiff_t>(begin),
                               o.phases.begin() + static_cast<std::ptrdiff_t>(begin + count)),
              1, which);
    for (const Ordered& one : o.series) {
      const std::size_t width = one.series.components.size();
      send_rows(parent, rows<double>(one.dataset, H5T_NATIVE_DOUBLE, begin, count, width, one.series.path), width,
                which);
    }
  }
}

// --- Here: what comes from the child
// -----------------------------------------------------------------------------------

constexpr std::uint64_t kMaxSeries = 1 << 20;

TimeSeriesMetadata take_metadata(FromChild& child) {
  TimeSeriesMetadata metadata;
  metadata.version = child.text();
  metadata.scenario_name = child.text();
  metadata.scenario_sha256 = child.text();
  return metadata;
}

TimeSeriesHead take_head(FromChild& child) {
  TimeSeriesHead head;
  head.metadata = take_metadata(child);
  head.names.phases = child.texts();
  const std::uint64_t count = child.count();
  if (count > kMaxSeries) throw std::runtime_error("damaged: implausible number of series");
  for (std::uint64_t i = 0; i < count; ++i) {
    Series s;
    s.path = child.text();
    s.unit = child.text();
    s.description = child.text();
    s.components = child.texts();
    head.names.series.push_back(std::move(s));
  }
  head.samples = child.count();
  head.every = child.count();
  check_time_series(head.names);
  return head;
}

void take_blocks(FromChild& child, const TimeSeriesHead& head, const std::function<void(const TimeSeries&)>& take) {
  TimeSeries block = head.names;
  std::uint64_t row_bytes = sizeof(double) + sizeof(int);
  for (const Series& s : block.series) row_bytes += sizeof(double) * s.components.size();
  const std::uint64_t at_once = std::max<std::uint64_t>(kBlockBytes / row_bytes, 1);
  for (std::uint64_t begin = 0; begin < head.samples; begin += at_once) {
    block.time = child.numbers<double>();
    block.phase = child.numbers<int>();
    for (Series& s : block.series) s.data = child.numbers<double>();
    check_samples(block);
    take(block);
  }
}

/// Runs both sides; all failures become one error that names the file. The child uses HDF5, so no other thread may be
/// using HDF5 at the fork.
void reading(const fs::path& path, const std::function<void(ToParent&)>& send,
             const std::function<void(FromChild&)>& take) {
  try {
    std::error_code none;
    if (fs::exists(path, none) && !fs::is_regular_file(path, none)) throw std::runtime_error("not a file");
    const std::uintmax_t size = fs::file_size(path, none);
    if (none) throw std::runtime_error(none.message());
    std::optional<hdf5::Session> session(std::in_place);
    read_in_child(reading_seconds(static_cast<double>(size)), send, [&](FromChild& child) {
      session.reset();  // the child has its own
      take(child);
    });
  } catch (const CannotWrite&) {  // of what `take` writes
    throw;
  } catch (const std::exception& e) {
    throw std::runtime_error("cannot read " + path.string() + ": " + e.what());
  }
}

}  // namespace

void read_timeseries_blocks(const fs::path& path, std::uint64_t max_bytes,
                            const std::function<void(const TimeSeriesHead&)>& begin,
                            const std::function<void(const TimeSeries&)>& take) {
  reading(
      path, [&](ToParent& parent) { send_series(path, max_bytes, parent); },
      [&](FromChild& child) {
        const TimeSeriesHead head = take_head(child);
        begin(head);
        take_blocks(child, head, take);
      });
}

ReadTimeSeries read_timeseries(const fs::path& path, std::uint64_t max_bytes) {
  ReadTimeSeries all;
  read_timeseries_blocks(
      path, max_bytes,
      [&](const TimeSeriesHead& head) {
        all.head = head;
        all.series = head.names;
      },
      [&](const TimeSeries& block) { append_samples(block, all.series); });
  return all;
}

}  // namespace grapnel
