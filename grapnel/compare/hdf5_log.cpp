#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "grapnel/compare/measured_log.hpp"
#include "grapnel/result/hdf5_file.hpp"

namespace grapnel {
namespace {

using hdf5::check;
using hdf5::Handle;

constexpr int kDeepestLogGroup = 32;  // a group may contain itself

std::string member_name(const Handle& group, hsize_t index) {
  const auto name_into = [&](char* buffer, std::size_t size) {
    return H5Lget_name_by_idx(group.id(), ".", H5_INDEX_NAME, H5_ITER_INC, index, buffer, size, H5P_DEFAULT);
  };
  const ssize_t length = name_into(nullptr, 0);
  if (length <= 0) hdf5::fail("damaged: a name in a group");
  std::string name(static_cast<std::size_t>(length) + 1, '\0');
  if (name_into(name.data(), name.size()) < 0) hdf5::fail("damaged: a name in a group");
  name.pop_back();
  return name;
}

// The text of the attribute `unit` or `units`, if it is a text.
std::string unit_of(const Handle& dataset) {
  for (const char* name : {"unit", "units"}) {
    if (H5Aexists(dataset.id(), name) <= 0) continue;
    try {
      return hdf5::read_string_attribute(dataset, name);
    } catch (const std::exception&) {  // another type
      return {};
    }
  }
  return {};
}

class Hdf5Log {
 public:
  explicit Hdf5Log(const std::filesystem::path& path)
      : bytes_(static_cast<double>(std::filesystem::file_size(path))), file_(hdf5::open_on_disk(path)) {}

  std::vector<LogDataset> read(const std::vector<std::string>& requested) {
    const Handle root(H5Gopen2(file_.id(), "/", H5P_DEFAULT), H5Gclose, "damaged: no root group");
    collect(root, "", 0);
    for (const std::size_t i : requested_datasets(datasets_, requested)) read_values(datasets_[i]);
    return std::move(datasets_);
  }

 private:
  void collect(const Handle& group, const std::string& prefix, int depth) {
    if (depth > kDeepestLogGroup) throw std::runtime_error("damaged: groups are nested too deeply");
    H5G_info_t info;
    check(H5Gget_info(group.id(), &info), "damaged: group '" + prefix + "'");
    for (hsize_t i = 0; i < info.nlinks; ++i) {
      const std::string name = member_name(group, i), path = prefix + name;
      H5L_info_t link;
      check(H5Lget_info(group.id(), name.c_str(), &link, H5P_DEFAULT), "damaged: '" + path + "'");
      if (link.type != H5L_TYPE_HARD) continue;
      const Handle object(H5Oopen(group.id(), name.c_str(), H5P_DEFAULT), H5Oclose, "damaged: '" + path + "'");
      const H5I_type_t type = H5Iget_type(object.id());
      if (type == H5I_GROUP) collect(object, path + "/", depth + 1);
      if (type == H5I_DATASET) datasets_.push_back(described(object, path));
    }
  }

  LogDataset described(const Handle& dataset, const std::string& path) const {
    LogDataset one;
    one.name = path;
    one.unit = unit_of(dataset);
    const Handle space(H5Dget_space(dataset.id()), H5Sclose, path), type(H5Dget_type(dataset.id()), H5Tclose, path);
    const H5T_class_t kind = H5Tget_class(type.id());
    const int rank = H5Sget_simple_extent_ndims(space.id());
    if (kind != H5T_FLOAT && kind != H5T_INTEGER) {
      one.obstacle = "it does not hold numbers";
    } else if (rank != 1 && rank != 2) {
      one.obstacle = "it has " + std::to_string(rank) + " dimensions, must have 1 or 2";
    } else {
      hsize_t extent[2] = {0, 1};
      check(H5Sget_simple_extent_dims(space.id(), extent, nullptr), path);
      one.rows = static_cast<std::size_t>(extent[0]), one.width = static_cast<std::size_t>(extent[1]);
      // Deflate gains a factor of 1032 at most.
      const double numbers = static_cast<double>(extent[0]) * static_cast<double>(extent[1]);
      if (numbers * static_cast<double>(H5Tget_size(type.id())) > 1100 * bytes_)
        one.obstacle = "it declares more numbers than the file can hold";
    }
    return one;
  }

  void read_values(LogDataset& one) const {
    if (!one.obstacle.empty()) return;
    const std::string what = "damaged: dataset '" + one.name + "'";
    const Handle dataset(H5Dopen2(file_.id(), one.name.c_str(), H5P_DEFAULT), H5Dclose, what);
    one.values.resize(one.rows * one.width);
    if (one.values.empty()) return;
    check(H5Dread(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, one.values.data()), what);
  }

  double bytes_;
  Handle file_;
  std::vector<LogDataset> datasets_;
};

}  // namespace

std::vector<LogDataset> read_hdf5_log(const std::filesystem::path& path, const std::vector<std::string>& requested) {
  return Hdf5Log(path).read(requested);
}

}  // namespace grapnel
