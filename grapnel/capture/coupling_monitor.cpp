#include "grapnel/capture/coupling_monitor.hpp"

#include <cmath>
#include <map>

#include "grapnel/model/coupling.hpp"

namespace grapnel {

CouplingMonitor::CouplingMonitor(const CaptureProblem& problem) {
  for (const BodyDescription& body : problem.robot.bodies) {
    if (!body.joint.mimic.empty()) names_.push_back(body.joint.name);
  }
}

std::vector<Series> CouplingMonitor::series() const {
  if (names_.empty()) return {};
  return {
      {"couplings/effort", "N m or N", "of couplings on the joints that follow others; NaN at impacts", names_, {}}};
}

// Sample => multipliers of the couplings, by the names of the dependent joints.
void CouplingMonitor::put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const {
  if (names_.empty()) return;
  const LoopSolver* solver = sample.dynamics ? sample.dynamics->loops() : nullptr;
  std::map<std::string_view, double> efforts;
  for (std::size_t k = 0; solver && k < system.model.couplings().size(); ++k) {
    const Body& body = system.model.bodies()[dependent_body(system.model.couplings()[k])];
    efforts[body.description.joint.name] = solver->coupling_multipliers()[k];
  }
  row.put_each(names_.size(), [&](std::size_t i) { return solver ? efforts[names_[i]] : std::nan(""); });
}

}  // namespace grapnel
