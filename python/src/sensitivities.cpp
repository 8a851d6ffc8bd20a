// Sensitivities of scenarios and campaigns.
#include "grapnel/campaign/sensitivities.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "grapnel/campaign/campaign_folder.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "problem.hpp"

namespace grapnel::python {
namespace {

using Names = std::vector<std::string>;

SensitivityReport report_of(const std::function<SensitivityTask()>& load, int threads) {
  SensitivityReport report;
  run_interruptibly([&](const std::stop_token& stop) {
    try {
      report = sensitivities(load(), {.threads = threads_of(threads), .stop = stop});
    } catch (const SensitivitiesStopped&) {
      throw Stopped{};
    }
  });
  return report;
}

SensitivityReport of_problem(const Scenario& scenario, const Names& of, const Names& by, bool impact_only,
                             bool plan_once, int threads) {
  const std::shared_ptr<const CaptureProblem> problem = scenario.shared_problem();
  SensitivityChoice choice{by, of, impact_only ? StudyMode::impact : StudyMode::run,
                           plan_once ? CampaignPlan::nominal : CampaignPlan::per_case};
  choice.text = scenario.text(scenario.file());
  return report_of(
      [&] {
        SensitivityTask task = load_sensitivities(scenario.file(), choice);
        task.sha256 = problem->sha256;
        return task;
      },
      threads);
}

SensitivityReport of_campaign(const std::filesystem::path& file, const Names& of, int threads) {
  SensitivityChoice choice;
  choice.of = of;
  return report_of([&] { return load_sensitivities(file, choice); }, threads);
}

}  // namespace

void bind_sensitivities(py::module_& module) {
  py::class_<SensitivityReport>(module, "SensitivityReport")
      .def("json", [](const SensitivityReport& report) { return sensitivities_json(report); })
      .def("csv", [](const SensitivityReport& report) { return sensitivities_csv(report); })
      .def("text", [](const SensitivityReport& report) { return sensitivities_text(report); });
  module.def("sensitivities", &of_problem, py::arg("problem"), py::arg("of"), py::arg("by"), py::arg("impact_only"),
             py::arg("plan_once"), py::arg("threads"));
  module.def("campaign_sensitivities", &of_campaign, py::arg("file"), py::arg("of"), py::arg("threads"));
}

}  // namespace grapnel::python
