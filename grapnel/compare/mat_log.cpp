#include <matio.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "grapnel/compare/measured_log.hpp"

namespace grapnel {
namespace {

struct FreeMatVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
struct CloseMatFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};

constexpr int kDeepestMatStruct = 32;

bool holds_numbers(const matvar_t& variable) {
  switch (variable.class_type) {
    case MAT_C_DOUBLE:
    case MAT_C_SINGLE:
    case MAT_C_INT8:
    case MAT_C_UINT8:
    case MAT_C_INT16:
    case MAT_C_UINT16:
    case MAT_C_INT32:
    case MAT_C_UINT32:
    case MAT_C_INT64:
    case MAT_C_UINT64:
      return !variable.isComplex;
    default:
      return false;
  }
}

template <class T>
double element(const matvar_t& variable, std::size_t i) {
  return static_cast<double>(static_cast<const T*>(variable.data)[i]);
}

// Numbers in memory have the type of their class.
double element_of(const matvar_t& variable, std::size_t i) {
  switch (variable.class_type) {
    case MAT_C_SINGLE:
      return element<float>(variable, i);
    case MAT_C_INT8:
      return element<std::int8_t>(variable, i);
    case MAT_C_UINT8:
      return element<std::uint8_t>(variable, i);
    case MAT_C_INT16:
      return element<std::int16_t>(variable, i);
    case MAT_C_UINT16:
      return element<std::uint16_t>(variable, i);
    case MAT_C_INT32:
      return element<std::int32_t>(variable, i);
    case MAT_C_UINT32:
      return element<std::uint32_t>(variable, i);
    case MAT_C_INT64:
      return element<std::int64_t>(variable, i);
    case MAT_C_UINT64:
      return element<std::uint64_t>(variable, i);
    default:
      return element<double>(variable, i);
  }
}

// A matrix with a row per sample; a row vector has a sample per element. All values are read: the file is a MAT file
// of at most a gigabyte.
LogDataset matrix_of(const matvar_t& variable, const std::string& name) {
  LogDataset one;
  one.name = name;
  if (!holds_numbers(variable)) {
    one.obstacle = variable.isComplex ? "it is complex" : "it does not hold numbers";
  } else if (variable.rank != 2) {
    one.obstacle = "it has " + std::to_string(variable.rank) + " dimensions, must have 2";
  } else {
    const std::size_t rows = variable.dims[0], columns = variable.dims[1];
    const bool is_row = rows == 1;
    one.rows = is_row ? columns : rows, one.width = is_row ? 1 : columns;
    if (rows * columns > 0 &&
        (!variable.data || variable.nbytes < rows * columns * static_cast<std::size_t>(variable.data_size)))
      throw std::runtime_error("damaged: variable '" + name + "'");
    one.values.resize(rows * columns);
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t j = 0; j < columns; ++j) one.values[i * columns + j] = element_of(variable, j * rows + i);
    }
  }
  return one;
}

void collect(matvar_t& variable, const std::string& name, int depth, std::vector<LogDataset>& datasets) {
  if (depth > kDeepestMatStruct) throw std::runtime_error("damaged: structs are nested too deeply");
  const bool is_single = variable.rank == 2 && variable.dims[0] == 1 && variable.dims[1] == 1;
  if (variable.class_type != MAT_C_STRUCT || !is_single) {
    datasets.push_back(matrix_of(variable, name));
    return;
  }
  const unsigned count = Mat_VarGetNumberOfFields(&variable);
  char* const* names = Mat_VarGetStructFieldnames(&variable);
  for (unsigned i = 0; names && i < count; ++i) {
    if (matvar_t* field = Mat_VarGetStructFieldByIndex(&variable, i, 0))
      collect(*field, name + "." + names[i], depth + 1, datasets);
  }
}

}  // namespace

std::vector<LogDataset> read_mat_log(const std::filesystem::path& path, const std::vector<std::string>& requested) {
  Mat_LogInitFunc("grapnel", [](int, char*) {});  // it prints otherwise
  const std::unique_ptr<mat_t, CloseMatFile> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file) throw std::runtime_error("not a MAT file, truncated or damaged");
  std::vector<LogDataset> datasets;
  while (const std::unique_ptr<matvar_t, FreeMatVariable> variable{Mat_VarReadNext(file.get())})
    collect(*variable, variable->name ? variable->name : "", 0, datasets);
  if (datasets.empty()) throw std::runtime_error("it has no variables, or is truncated or damaged");
  std::vector<bool> is_requested(datasets.size(), false);
  for (const std::size_t i : requested_datasets(datasets, requested)) is_requested[i] = true;
  for (std::size_t i = 0; i < datasets.size(); ++i) {
    if (!is_requested[i]) datasets[i].values = {};
  }
  return datasets;
}

}  // namespace grapnel
