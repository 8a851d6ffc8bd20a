// Conflicts of the environment: the orbit's field, and external wrenches.
#include <limits>
#include <numbers>

#include "grapnel/problem/conflict_finder.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/simulate/orbit.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// Fraction of an orbit's radius up to which the linear field is within 1.5 %.
constexpr double kNear = 0.01;

class EnvironmentConflicts : ConflictFinder {
 public:
  using ConflictFinder::ConflictFinder;

  // ---- The orbit ----

  void check_orbit(const OrbitSetup& setup) {
    if (!is_zero(problem_.gravity))
      add_key("gravity",
              "gravity: it is for test beds on the ground; leave it out with 'orbit', whose frame is in free fall");
    if (problem_.robot.base_mode == RobotSetup::Base::fixed)
      add_key("orbit",
              "orbit: the robot's base is fixed to the ground, which is not in orbit; use base mode "
              "free or held");
    if (std::abs(dot(setup.radial, setup.along_track)) > 1e-9) {
      add("orbit.along_track",
          "orbit.along_track must be perpendicular to orbit.radial; their dot product is {:.3g}, the angle between "
          "them "
          "{:.4g} degrees",
          dot(setup.radial, setup.along_track),
          std::acos(std::clamp(dot(setup.radial, setup.along_track), -1.0, 1.0)) * 180 / std::numbers::pi)
          .relies_on = "orbit.radial";
    }
    if (setup.magnetic_field) {
      const std::string fault = fault_of(*setup.magnetic_field);
      if (!fault.empty()) add_key("orbit.magnetic_field", "orbit.magnetic_field: {}", fault);
      if (setup.body != OrbitSetup::Body::earth || setup.mu)
        add_key("orbit.magnetic_field", "orbit.magnetic_field is the Earth's; it requires body: earth, without mu");
    }
    const ReferenceOrbit orbit = reference_orbit(setup);
    if (!fault_of(orbit).empty()) return;  // reported elsewhere
    const double lowest = orbit.semi_major_axis * (1 - orbit.eccentricity), radius = central_body(setup.body).radius;
    if (!setup.mu && lowest < radius) {
      add(setup.altitude ? "orbit.altitude" : "orbit.semi_major_axis",
          "orbit: its lowest point is {:.6g} m from the centre of the body {}, below its surface at {:.6g}; lengths "
          "are "
          "in m, or carry their unit (7000 km)",
          lowest, name_of(setup.body), radius);
      return;
    }
    check_nearness(lowest);
  }

  // Whether the linear field holds at the given positions and those reached during the run.
  void check_nearness(double lowest) {
    const double duration = duration_of(problem_.approach).value_or(0) + duration_of(problem_.post_impact).value_or(0);
    const auto check = [&](const std::string& path, const Vector3d& position, const Vector3d& velocity) {
      const double off = norm(position), travel = norm(velocity) * duration, limit = kNear * lowest;
      if (!(off + travel > limit) || !std::isfinite(off + travel)) return;
      if (off >= travel) {
        add(path + ".position",
            "{}.position: {:.6g} m from the orbit's reference point, which is W's origin; the field near an orbit is "
            "linear and holds within {:.6g} m",
            path, off, limit);
      } else {
        add(path + ".velocity",
            "{}.velocity: it leads {:.6g} m away from the orbit's reference point within the run; velocities are "
            "relative to the orbit, and its field is linear and holds within {:.6g} m",
            path, travel, limit);
      }
    };
    check("initial.base", problem_.X_WB.p, problem_.V_WB ? problem_.V_WB->linear : Vector3d::zero());
    for (std::size_t i = 0; i < problem_.targets.size(); ++i)
      check(fmt::format("targets[{}].state", i), problem_.targets[i].X_WT.p, problem_.targets[i].V_WT.linear);
  }

  // ---- External wrenches ----

  void check_load(const LoadSetup& load, std::size_t i) {
    const std::string path = fmt::format("external_wrenches[{}]", i);
    check_profile(load.profile, path + ".time");
    if (load.frame == LoadFrame::orbit && !problem_.orbit)
      add(path + ".frame", "{}.frame: orbit needs 'orbit' in the scenario", path).relies_on = "orbit";
    if (!load.stream) return;
    if (load.frame == LoadFrame::body) {
      add(path + ".frame",
          "{}.frame: body is not defined for a stream, which does not turn with the body; use world "
          "or orbit",
          path);
    }
    if (const double shares = load.stream->specular + load.stream->diffuse; shares > 1) {
      add(path + ".stream", "{}.stream: the sum of specular and diffuse is {:.6g}, must be at most 1", path, shares);
    }
  }

  void check_profile(const LoadProfile& profile, const std::string& path) {
    const bool ends = profile.shape != LoadProfile::Shape::table && std::isfinite(profile.end);
    if (ends && !(profile.end > profile.start))
      add(path + ".end", "{} ends at {} [s], must end after its start at {}", path, profile.end, profile.start);
    double before = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < profile.times.size(); ++i) {
      const double time = profile.times[i];
      if (!std::isfinite(time)) continue;  // a different error
      const std::string row = fmt::format("{}.values[{}]", path, i);
      if (!(time > before))
        add(row + "[0]", "{}: time {} must be greater than {} of the row before", row, time, before);
      before = time;
    }
  }
};

}  // namespace

void find_orbit_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found) {
  if (problem.orbit) EnvironmentConflicts(problem, found).check_orbit(*problem.orbit);
}

void find_load_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found) {
  EnvironmentConflicts finder(problem, found);
  for (std::size_t i = 0; i < problem.loads.size(); ++i) finder.check_load(problem.loads[i], i);
}

}  // namespace grapnel
