// Columns of loads and margins.
#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/campaign/column.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {
namespace {

double least_rating(const LoadRating& r) {
  return std::min({r.force, r.moment, r.impulse, r.angular_impulse, r.driving, r.driving_impulse});
}

// One load of a joint, an end-effector or the base control.
struct LoadQuantity {
  std::string of, name, unit;
  bool rated;    // in the robot file
  bool limited;  // by what a drive can exert
};

// Bodies without load have no record in a result (LoadMonitor): in a completed run their load is zero.
bool bore_nothing(const CaptureResult& result) { return result.status == CaptureStatus::completed; }

// The load with the largest magnitude over all phases, or the smallest margin.
const PeakLoad* largest(const CaptureResult& result, const std::string& of, const std::string& quantity) {
  const PeakLoad* found = nullptr;
  for (const PeakLoad& load : result.peak_loads) {
    if (load.of == of && load.quantity == quantity && (!found || !(load.peak <= found->peak))) found = &load;
  }
  return found;
}
double least_margin(const CaptureResult& result, const std::string& of, const std::string& quantity) {
  double least = NAN;
  for (const PeakLoad& load : result.peak_loads) {
    if (load.of == of && load.quantity == quantity && std::isfinite(load.rating))
      least = std::fmin(least, load.margin());
  }
  if (std::isnan(least) && bore_nothing(result)) return 1;
  return least;
}

void add_quantities(const std::string& of, const LoadRating& rating, const AxisUnits* axis, double effort,
                    std::vector<LoadQuantity>& all) {
  const auto add = [&](const char* name, const char* unit, double limit, bool limited = false) {
    all.push_back({of, name, unit, std::isfinite(limit), limited});
  };
  add("force", "N", rating.force);
  add("moment", "N m", rating.moment);
  add("impulse", "N s", rating.impulse);
  add("angular_impulse", "N m s", rating.angular_impulse);
  if (!axis) return;
  add("driving", axis->effort, rating.driving, std::isfinite(effort));
  add("driving_impulse", axis->impulse, rating.driving_impulse);
}

std::vector<LoadQuantity> load_quantities(const CaptureProblem& problem) {
  const LoadRating none;
  std::vector<LoadQuantity> all;
  for (const BodyDescription& body : problem.robot.bodies) {
    if (body.name == problem.robot.base) continue;
    const auto rating = std::find_if(problem.robot.ratings.begin(), problem.robot.ratings.end(),
                                     [&](const auto& r) { return r.first == body.joint.name; });
    const AxisUnits units = axis_units(body.joint.type);
    add_quantities(body.joint.name, rating == problem.robot.ratings.end() ? none : rating->second,
                   has_one_axis(body.joint.type) ? &units : nullptr, body.joint.limits.effort, all);
  }
  for (const EndEffectorSetup& e : problem.robot.end_effectors) add_quantities(e.name, e.rating, nullptr, NAN, all);
  // Its limit bounds the command and is not a rating.
  const bool controls_base = (problem.approach && problem.approach->base_control) ||
                             problem.post_impact.any([](const auto& p) { return p.base_control.has_value(); });
  for (int k = 0; controls_base && k < 3; ++k)
    all.push_back({"base control", std::string("driving/") + "xyz"[k], "N m", false, false});
  return all;
}

}  // namespace

bool is_rated(const CaptureProblem& problem) {
  const auto& end_effectors = problem.robot.end_effectors;
  return !problem.robot.ratings.empty() ||
         std::any_of(end_effectors.begin(), end_effectors.end(),
                     [](const EndEffectorSetup& e) { return std::isfinite(least_rating(e.rating)); });
}

std::vector<Column> load_columns(const CaptureProblem& problem, bool with_motion) {
  std::vector<Column> columns;
  bool any_limit = false;
  for (const LoadQuantity& q : load_quantities(problem)) {
    if (q.rated || (q.limited && with_motion)) {
      any_limit = true;
      columns.push_back({"margins/" + q.of + "/" + q.name, "1",
                         with_motion ? "1 - load over rating, the worst of all phases"
                                     : "1 - load over rating, the worst of all impacts",
                         [q](const StudyCase&, const CaptureResult& r) { return least_margin(r, q.of, q.name); },
                         with_motion, q.rated});
    }
    if (!with_motion) continue;
    columns.push_back({"loads/" + q.of + "/" + q.name, q.unit, "largest magnitude over all phases",
                       [q](const StudyCase&, const CaptureResult& r) {
                         const PeakLoad* load = largest(r, q.of, q.name);
                         return load ? load->peak : bore_nothing(r) ? 0.0 : NAN;
                       },
                       true, false});
    columns.push_back({"load_times/" + q.of + "/" + q.name, "s", "time of the largest magnitude; NaN: the load is zero",
                       [q](const StudyCase&, const CaptureResult& r) {
                         const PeakLoad* load = largest(r, q.of, q.name);
                         return load && load->peak > 0 ? load->time : NAN;
                       },
                       true, false});
  }
  if (any_limit) {
    columns.push_back({"worst_margin", "1", "minimum of all margins",
                       [](const StudyCase&, const CaptureResult& r) {
                         const PeakLoad* worst = worst_margin(r);
                         return worst ? worst->margin() : bore_nothing(r) ? 1.0 : NAN;
                       },
                       with_motion, is_rated(problem)});
  }
  return columns;
}

}  // namespace grapnel
