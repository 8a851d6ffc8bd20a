// Linear models of scenarios.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "grapnel/linear/linearize.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "problem.hpp"

namespace grapnel::python {
namespace {

LinearModel linear_model_of(const Scenario& scenario, double time, std::optional<double> sample_time, double delay) {
  const std::shared_ptr<const CaptureProblem> problem = scenario.shared_problem();
  const py::gil_scoped_release others_go_on;
  return linearize(*problem, {time, sample_time, delay});
}

void write_linear_model(const LinearModel& model, const std::filesystem::path& file) {
  if (file.extension() == ".mat")
    write_linear_model_mat(model, file);
  else if (file.extension() == ".json")
    write_file_atomically(file, linear_model_json(model));
  else
    throw py::value_error("the name of the file must end in .json or .mat: " + file.string());
}

}  // namespace

void bind_linear(py::module_& module) {
  py::class_<LinearModel>(module, "LinearModel")
      .def("json", [](const LinearModel& model) { return linear_model_json(model); })
      .def("text", [](const LinearModel& model) { return linear_model_text(model); })
      .def("write", &write_linear_model, py::arg("file"));
  module.def("linearize", &linear_model_of, py::arg("problem"), py::arg("time"), py::arg("sample_time"),
             py::arg("delay"));
}

}  // namespace grapnel::python
