// The linear model as a MAT file of version 5.
#include <matio.h>

#include <cstring>
#include <memory>
#include <stdexcept>

#include "grapnel/linear/linear_model.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

struct FreeMatVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using MatVariable = std::unique_ptr<matvar_t, FreeMatVariable>;

struct CloseMatFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
using OpenMatFile = std::unique_ptr<mat_t, CloseMatFile>;

MatVariable matrix_variable(const char* name, const LinearModel::Matrix& rows, std::size_t columns) {
  Eigen::MatrixXd values = matrix_of(rows, columns);
  std::size_t extent[2] = {rows.size(), static_cast<std::size_t>(values.cols())};
  return MatVariable(Mat_VarCreate(name, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, extent, values.data(), 0));
}

MatVariable number_variable(const char* name, double value) { return matrix_variable(name, {{value}}, 1); }

// Names and units of a scenario may have any bytes; MATLAB's text here is printable ASCII.
MatVariable text_variable_of(const char* name, const std::string& given) {
  std::string text = printable_line(given);
  for (char& c : text) c = static_cast<unsigned char>(c) < 0x80 ? c : '?';
  std::size_t extent[2] = {text.empty() ? std::size_t{0} : std::size_t{1}, text.size()};
  return MatVariable(Mat_VarCreate(name, MAT_C_CHAR, MAT_T_UINT8, 2, extent, text.data(), 0));
}

MatVariable texts_variable(const char* name, const std::vector<std::string>& texts) {
  std::size_t extent[2] = {texts.size(), 1};
  MatVariable cells(Mat_VarCreate(name, MAT_C_CELL, MAT_T_CELL, 2, extent, nullptr, 0));
  for (std::size_t i = 0; i < texts.size(); ++i)
    Mat_VarSetCell(cells.get(), static_cast<int>(i), text_variable_of(nullptr, texts[i]).release());
  return cells;
}

std::vector<MatVariable> variables_of(const LinearModel& model) {
  const std::size_t n = model.states.size(), m = model.inputs.size();
  std::vector<MatVariable> all;
  all.push_back(text_variable_of("scenario", model.scenario));
  all.push_back(number_variable("time", model.time));
  all.push_back(matrix_variable("A", model.A, n));
  all.push_back(matrix_variable("B", model.B, m));
  all.push_back(matrix_variable("C", model.C, n));
  all.push_back(matrix_variable("D", model.D, m));
  const auto add = [&](const char* names, const char* units, const char* values,
                       const std::vector<LinearModel::Variable>& variables) {
    std::vector<std::string> name, unit;
    LinearModel::Matrix value;
    for (const LinearModel::Variable& one : variables) {
      name.push_back(one.name), unit.push_back(one.unit);
      value.push_back({one.value.value_or(0)});
    }
    all.push_back(texts_variable(names, name));
    all.push_back(texts_variable(units, unit));
    all.push_back(matrix_variable(values, value, 1));
  };
  add("state_names", "state_units", "x0", model.states);
  add("input_names", "input_units", "u0", model.inputs);
  add("output_names", "output_units", "y0", model.outputs);
  if (model.sampled) {
    all.push_back(number_variable("period", model.sampled->period));
    all.push_back(number_variable("delay", model.sampled->delay));
    all.push_back(number_variable("whole_periods", static_cast<double>(model.sampled->whole_periods)));
    all.push_back(matrix_variable("Ad", model.sampled->Ad, n));
    all.push_back(matrix_variable("Bd", model.sampled->Bd, m));
    all.push_back(matrix_variable("Bd_previous", model.sampled->Bd_previous, m));
  }
  if (model.closed_loop) all.push_back(matrix_variable("K", gain_of_all_states(model), n));
  return all;
}

// matio reports few disk errors, so the matrices are read back.
void save_variables(const std::vector<MatVariable>& variables, const std::filesystem::path& path) {
  Mat_LogInitFunc("grapnel", [](int, char*) {});  // it prints otherwise
  {
    const OpenMatFile file(Mat_CreateVer(path.c_str(), "MATLAB 5.0 MAT-file, written by Grapnel", MAT_FT_MAT5));
    if (!file) throw std::runtime_error("the file cannot be created");
    for (const MatVariable& variable : variables) {
      if (!variable || Mat_VarWrite(file.get(), variable.get(), MAT_COMPRESSION_NONE) != 0)
        throw std::runtime_error("writing failed");
    }
  }
  const OpenMatFile file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  for (const MatVariable& variable : variables) {
    const MatVariable written(file ? Mat_VarRead(file.get(), variable->name) : nullptr);
    const bool is_matrix = variable->class_type == MAT_C_DOUBLE;
    if (!written ||
        (is_matrix && (written->nbytes != variable->nbytes ||
                       (variable->nbytes > 0 && std::memcmp(written->data, variable->data, variable->nbytes) != 0))))
      throw std::runtime_error("the written file is incomplete; is the disk full?");
  }
}

}  // namespace

void write_linear_model_mat(const LinearModel& model, const std::filesystem::path& path) {
  AtomicFile file(path);
  try {
    save_variables(variables_of(model), file.temporary());
  } catch (const std::exception& e) {
    throw CannotWrite("cannot write " + path.string() + ": " + e.what());
  }
  file.commit();
}

}  // namespace grapnel
