#include "grapnel/result/hdf5_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_handle.hpp"

namespace grapnel {
namespace {

using hdf5::check;
using hdf5::Handle;

constexpr const char* kSchema = "grapnel-timeseries/1";
constexpr int kDeepest = 32;  // nested groups; deeper is a damaged file that points to itself

struct Ordered {
  int order;
  Series series;
};

/// An open file, which HDF5 holds in memory.
struct Source {
  std::size_t bytes;  // its size
  Handle file;
};

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  if (!stream) throw std::runtime_error(std::generic_category().message(errno));
  const std::streamoff size = stream.tellg();
  if (size < 0 || std::filesystem::is_directory(path)) throw std::runtime_error("not a file");
  std::string bytes(static_cast<std::size_t>(size), '\0');
  stream.seekg(0);
  if (!stream.read(bytes.data(), size)) throw std::runtime_error("reading failed");
  return bytes;
}

/// From memory: no lock on the file, and nothing changes under HDF5's hands.
Source open(const std::filesystem::path& path) {
  std::string bytes = bytes_of(path);
  if (!bytes.starts_with("\x89HDF\r\n\x1a\n")) throw std::runtime_error("not an HDF5 file");
  unseal(bytes);
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "file access");
  check(H5Pset_fapl_core(access.id(), 1 << 20, false), "file in memory");
  check(H5Pset_file_image(access.id(), bytes.data(), bytes.size()), "file in memory");
  Handle file(H5Fopen("timeseries", H5F_ACC_RDONLY, access.id()), H5Fclose, "truncated or damaged");
  const ssize_t end = H5Fget_file_image(file.id(), nullptr, 0);
  // A seal that was cut or overwritten, and who knows what before it.
  if (end != static_cast<ssize_t>(bytes.size())) throw std::runtime_error("damaged: it goes on behind its end");
  const Handle root(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose, "damaged: no root group");
  const std::string schema = hdf5::read_string_attribute(root, "schema");
  if (schema != kSchema) throw std::runtime_error("schema is '" + schema + "', not " + kSchema);
  return {bytes.size(), std::move(file)};
}

std::vector<hsize_t> extent_of(const Handle& dataset, const std::string& name) {
  const Handle space(H5Dget_space(dataset.id()), H5Sclose, name);
  const int rank = H5Sget_simple_extent_ndims(space.id());
  if (rank != 1 && rank != 2) throw std::runtime_error("'" + name + "' has " + std::to_string(rank) + " dimensions");
  std::vector<hsize_t> extent(static_cast<std::size_t>(rank));
  check(H5Sget_simple_extent_dims(space.id(), extent.data(), nullptr), name);
  return extent;
}

/// All numbers of a dataset, converted to T.
template <class T>
std::vector<T> numbers(const Source& source, const Handle& dataset, hid_t memory_type, const std::string& name) {
  const std::vector<hsize_t> extent = extent_of(dataset, name);
  // Deflate gains a factor of 1032 at most: larger claims are damage, and must not exhaust the memory.
  const double claimed = static_cast<double>(extent[0]) * (extent.size() > 1 ? static_cast<double>(extent[1]) : 1);
  if (claimed * sizeof(T) > 1100.0 * static_cast<double>(source.bytes)) {
    throw std::runtime_error("damaged: '" + name + "' claims more numbers than the file can hold");
  }
  std::vector<T> values(static_cast<std::size_t>(extent[0] * (extent.size() > 1 ? extent[1] : 1)));
  if (values.empty()) return values;
  check(H5Dread(dataset.id(), memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), "damaged: '" + name + "'");
  return values;
}

Series read_series(const Source& source, const Handle& dataset, const std::string& path) {
  Series s;
  s.path = path;
  s.unit = hdf5::read_string_attribute(dataset, "unit");
  s.description = hdf5::read_string_attribute(dataset, "description");
  s.components = hdf5::read_strings_attribute(dataset, "components");
  const std::vector<hsize_t> extent = extent_of(dataset, path);
  if (s.components.size() != (extent.size() > 1 ? extent[1] : 1)) {
    throw std::runtime_error("'" + path + "': attribute components does not fit its width");
  }
  s.data = numbers<double>(source, dataset, H5T_NATIVE_DOUBLE, path);
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

void collect(const Source& source, const Handle& group, const std::string& prefix, int depth,
             std::vector<Ordered>& found) {
  if (depth > kDeepest) throw std::runtime_error("damaged: groups are nested without end");
  H5G_info_t info;
  check(H5Gget_info(group.id(), &info), "damaged: group '" + prefix + "'");
  for (hsize_t i = 0; i < info.nlinks; ++i) {
    const std::string name = link_name(group, i);
    const std::string path = prefix + name;
    if (path == "time" || path == "phase") continue;
    H5L_info_t link;
    check(H5Lget_info(group.id(), name.c_str(), &link, H5P_DEFAULT), "damaged: '" + path + "'");
    if (link.type != H5L_TYPE_HARD) continue;  // ours has no links elsewhere
    const Handle object(H5Oopen(group.id(), name.c_str(), H5P_DEFAULT), H5Oclose, "damaged: '" + path + "'");
    const H5I_type_t type = H5Iget_type(object.id());
    if (type == H5I_GROUP) collect(source, object, path + "/", depth + 1, found);
    if (type != H5I_DATASET) continue;
    const int order = hdf5::read_int_attribute(object, "order", static_cast<int>(found.size()));
    found.push_back({order, read_series(source, object, path)});
  }
}

TimeSeries read(const Source& source) {
  TimeSeries result;
  const Handle time(H5Dopen2(source.file.id(), "time", H5P_DEFAULT), H5Dclose, "no dataset time");
  result.time = numbers<double>(source, time, H5T_NATIVE_DOUBLE, "time");
  const Handle phase(H5Dopen2(source.file.id(), "phase", H5P_DEFAULT), H5Dclose, "no dataset phase");
  result.phase = numbers<int>(source, phase, H5T_NATIVE_INT, "phase");
  result.phases = hdf5::read_strings_attribute(phase, "names");
  const Handle root(H5Gopen2(source.file.id(), "/", H5P_DEFAULT), H5Gclose, "damaged: no root group");
  std::vector<Ordered> found;
  collect(source, root, "", 0, found);
  std::stable_sort(found.begin(), found.end(), [](const Ordered& a, const Ordered& b) { return a.order < b.order; });
  for (Ordered& item : found) result.series.push_back(std::move(item.series));
  check_time_series(result);
  return result;
}

/// Runs `action` within HDF5; whatever goes wrong is one error that names the file.
template <class Action>
auto reading(const std::filesystem::path& path, Action action) {
  const hdf5::Session session;
  try {
    return action(open(path));
  } catch (const std::exception& e) {
    throw std::runtime_error("cannot read " + path.string() + ": " + e.what());
  }
}

}  // namespace

TimeSeries read_timeseries_hdf5(const std::filesystem::path& path) {
  return reading(path, [](const Source& source) { return read(source); });
}

TimeSeriesMetadata read_timeseries_metadata(const std::filesystem::path& path) {
  return reading(path, [](const Source& source) {
    const Handle root(H5Gopen2(source.file.id(), "/", H5P_DEFAULT), H5Gclose, "damaged: no root group");
    return TimeSeriesMetadata{hdf5::read_string_attribute(root, "version"),
                              hdf5::read_string_attribute(root, "scenario"),
                              hdf5::read_string_attribute(root, "sha256")};
  });
}

}  // namespace grapnel
