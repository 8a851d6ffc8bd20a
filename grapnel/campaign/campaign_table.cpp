#include "grapnel/campaign/campaign_table.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_file.hpp"

namespace grapnel {
namespace {

using hdf5::check;
using hdf5::Handle;

struct Found {
  int order = 0;
  std::string path;
  CampaignTable::Head head;
};

// What of a group's datasets is looked at while HDF5 visits them: an exception must not pass through C.
struct Visit {
  hid_t file;
  std::string group;
  std::vector<Found> found;
  std::string fault;
};

herr_t visit_dataset(hid_t, const char* name, const H5O_info_t* info, void* data) {
  if (info->type != H5O_TYPE_DATASET) return 0;
  auto& visit = *static_cast<Visit*>(data);
  const std::string path = visit.group + "/" + name;
  try {
    const Handle dataset(H5Dopen2(visit.file, path.c_str(), H5P_DEFAULT), H5Dclose, path);
    visit.found.push_back({hdf5::read_int_attribute(dataset, "order", static_cast<int>(visit.found.size())),
                           path,
                           {hdf5::read_string_attribute(dataset, "name"), hdf5::read_string_attribute(dataset, "unit"),
                            hdf5::read_string_attribute(dataset, "description")}});
    return 0;
  } catch (const std::exception& e) {
    visit.fault = e.what();
    return -1;
  }
}

std::vector<Found> datasets_in(const Handle& file, const std::string& group) {
  if (H5Lexists(file.id(), group.c_str(), H5P_DEFAULT) <= 0) return {};
  const Handle opened(H5Gopen2(file.id(), group.c_str(), H5P_DEFAULT), H5Gclose, group);
  Visit visit{file.id(), group, {}, ""};
  const herr_t status = H5Ovisit2(opened.id(), H5_INDEX_NAME, H5_ITER_INC, visit_dataset, &visit, H5O_INFO_BASIC);
  if (!visit.fault.empty()) throw std::runtime_error(visit.fault);
  check(status, "damaged: group '" + group + "'");
  std::stable_sort(visit.found.begin(), visit.found.end(),
                   [](const Found& a, const Found& b) { return a.order < b.order; });
  return visit.found;
}

}  // namespace

struct CampaignTable::File {
  std::filesystem::path path;
  std::optional<Handle> file;
  std::vector<Head> inputs, columns;
  std::vector<std::string> input_paths, column_paths;
  std::uint64_t rows = 0;

  ~File() {
    const hdf5::Session session;
    file.reset();
  }

  /// Runs `action` within HDF5; whatever goes wrong is one error that names the file.
  template <class Action>
  auto reading(Action action) const {
    const hdf5::Session session;
    try {
      return action();
    } catch (const std::exception& e) {
      throw std::runtime_error("cannot read " + path.string() + ": " + e.what());
    }
  }

  void open() {
    // Before HDF5 sees it: it can loop without end on a damaged file.
    check_file_seal(path);
    file.emplace(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, "it is no HDF5 file");
    const Handle root(H5Gopen2(file->id(), "/", H5P_DEFAULT), H5Gclose, "damaged: no root group");
    const std::string schema = hdf5::read_string_attribute(root, "schema");
    if (schema != "grapnel-campaign-table/1")
      throw std::runtime_error("its schema is '" + schema + "', not grapnel-campaign-table/1");
    rows = rows_of("k");
    take(datasets_in(*file, "inputs"), inputs, input_paths);
    take(datasets_in(*file, "columns"), columns, column_paths);
  }

  void take(const std::vector<Found>& found, std::vector<Head>& heads, std::vector<std::string>& paths) const {
    for (const Found& item : found) {
      if (rows_of(item.path) != rows)
        throw std::runtime_error("damaged: '" + item.path + "' has another length than 'k'");
      heads.push_back(item.head);
      paths.push_back(item.path);
    }
  }

  std::uint64_t rows_of(const std::string& dataset_path) const {
    const Handle dataset(H5Dopen2(file->id(), dataset_path.c_str(), H5P_DEFAULT), H5Dclose,
                         "no '" + dataset_path + "'");
    const Handle space(H5Dget_space(dataset.id()), H5Sclose, dataset_path);
    hsize_t extent = 0;
    if (H5Sget_simple_extent_ndims(space.id()) != 1 || H5Sget_simple_extent_dims(space.id(), &extent, nullptr) != 1)
      throw std::runtime_error("damaged: '" + dataset_path + "' is no list");
    return extent;
  }

  void read(const std::string& dataset_path, hid_t type, std::uint64_t first, std::uint64_t count, void* out) const {
    if (count == 0) return;
    const Handle dataset(H5Dopen2(file->id(), dataset_path.c_str(), H5P_DEFAULT), H5Dclose,
                         "no '" + dataset_path + "'");
    const Handle on_disk(H5Dget_space(dataset.id()), H5Sclose, dataset_path);
    const hsize_t begin = first, size = count;
    check(H5Sselect_hyperslab(on_disk.id(), H5S_SELECT_SET, &begin, nullptr, &size, nullptr), dataset_path);
    const Handle in_memory(H5Screate_simple(1, &size, nullptr), H5Sclose, dataset_path);
    check(H5Dread(dataset.id(), type, in_memory.id(), on_disk.id(), H5P_DEFAULT, out),
          "damaged: '" + dataset_path + "'");
  }

  template <class T>
  std::vector<T> all(const std::string& dataset_path, hid_t type) const {
    return reading([&] {
      if (rows_of(dataset_path) != rows) throw std::runtime_error("damaged: '" + dataset_path + "'");
      std::vector<T> values(rows);
      read(dataset_path, type, 0, rows, values.data());
      return values;
    });
  }
};

CampaignTable::CampaignTable(const std::filesystem::path& table) : file_(std::make_unique<File>()) {
  file_->path = table;
  file_->reading([&] {
    try {
      file_->open();
    } catch (...) {
      file_->file.reset();
      throw;
    }
  });
}

CampaignTable::~CampaignTable() = default;

const std::vector<CampaignTable::Head>& CampaignTable::inputs() const { return file_->inputs; }
const std::vector<CampaignTable::Head>& CampaignTable::columns() const { return file_->columns; }
std::uint64_t CampaignTable::rows() const { return file_->rows; }

std::vector<double> CampaignTable::input(std::size_t i) const {
  return file_->all<double>(file_->input_paths.at(i), H5T_NATIVE_DOUBLE);
}
std::vector<double> CampaignTable::column(std::size_t i) const {
  return file_->all<double>(file_->column_paths.at(i), H5T_NATIVE_DOUBLE);
}
void CampaignTable::read_input(std::size_t i, std::uint64_t first, std::span<double> out) const {
  file_->reading([&] { file_->read(file_->input_paths.at(i), H5T_NATIVE_DOUBLE, first, out.size(), out.data()); });
}
void CampaignTable::read_column(std::size_t i, std::uint64_t first, std::span<double> out) const {
  file_->reading([&] { file_->read(file_->column_paths.at(i), H5T_NATIVE_DOUBLE, first, out.size(), out.data()); });
}

std::vector<std::uint64_t> CampaignTable::indices() const { return file_->all<std::uint64_t>("k", H5T_NATIVE_UINT64); }
std::vector<std::uint8_t> CampaignTable::status() const { return file_->all<std::uint8_t>("status", H5T_NATIVE_UINT8); }
std::vector<std::uint8_t> CampaignTable::success() const {
  return file_->all<std::uint8_t>("success", H5T_NATIVE_UINT8);
}
std::vector<std::int32_t> CampaignTable::reasons() const {
  return file_->all<std::int32_t>("reason", H5T_NATIVE_INT32);
}

std::string CampaignTable::reason_text(std::int32_t number) const {
  return file_->reading([&] {
    const Handle type = hdf5::string_type(false);
    char* text = nullptr;
    file_->read("reasons", type.id(), static_cast<std::uint64_t>(number), 1, &text);
    const std::string result = text ? text : "";
    const hsize_t one = 1;
    const Handle space(H5Screate_simple(1, &one, nullptr), H5Sclose, "reasons");
    check(H5Dvlen_reclaim(type.id(), space.id(), H5P_DEFAULT, &text), "reasons");
    return result;
  });
}

}  // namespace grapnel
